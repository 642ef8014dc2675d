//! Estimates that come late, not at all or wrong, and rates that do not fit: the pipeline falls
//! back to the gyro less its bias, or says that there is no good rate.

use embedded_can::Frame;
use gyronet::can::bosch::{Message, SignalStatus};
use gyronet::can::config::Config;
use gyronet::can::encoder::CanEncoder;
use gyronet::compensate::{CompensateConfig, DELAY, MAX_MEAN};
use gyronet::estimate::YawEstimate;
use gyronet::health::Status::{Degraded, Init, Ready};
use gyronet::health::{Faults, Quality, Source};
use gyronet::model::Estimate;
use gyronet::model::window::WINDOW;
use gyronet::pipeline::{BoardState, DueWindow, Output, Pipeline, PipelineConfig};
use gyronet::units::{AngularRate, Yaw};
use gyronet_host_tests::stream::{constant, drive, faults, new, run, statuses};
use gyronet_host_tests::synthetic::{rate, turning};

/// The angle that the delayed rate owes where all samples that wait for it are alike, and no revision.
fn waiting(last: &YawEstimate) -> Yaw {
    Yaw(CompensateConfig::DEFAULT.lag.samples() as i64 * i64::from(last.rate.0))
}

/// In time is up to the sample before its turn.
#[test]
fn an_estimate_that_is_late_or_missing_is_counted() {
    let stride = CompensateConfig::DEFAULT.stride.samples() as usize;
    for (lateness, used) in [(1, 18), (DELAY as usize, 0), (stride, 0), (20, 0), (usize::MAX, 0)] {
        let mut pipeline = new();
        let mut waiting: Vec<(usize, DueWindow)> = Vec::new();
        for (now, sample) in drive(0..400).enumerate() {
            let output = pipeline.correct(sample, None, &BoardState::GOOD).expect("a place on the grid");
            waiting.retain(|(since, due)| {
                let deliver = now - since >= lateness;
                if deliver {
                    pipeline.deliver(due.end, constant(0.01)(due).expect("an estimate"));
                }
                !deliver
            });
            waiting.extend(output.window.map(|due| (now, due)));
            let live = output.vehicle.live;
            let is_late = matches!(live.status, Init | Degraded) && live.correction == AngularRate(0);
            assert!(used > 0 || is_late, "{lateness} late at {now}");
        }
        let counters = pipeline.counters();
        assert_eq!((counters.windows, counters.late), (used, 18 - used), "{lateness} samples late");
    }
}

#[test]
fn a_network_that_dies_leaves_the_gyro_less_its_bias() {
    let mut pipeline = new();
    let mut alive = constant(0.01);
    let outputs = run(&mut pipeline, drive(0..600), |due| if due.end < 450 { alive(due) } else { None });
    assert_eq!(statuses(&outputs)[2].0, Ready);
    let last = outputs[599].vehicle.live;
    assert_eq!((last.status, pipeline.pending()), (Degraded, waiting(&last)));
    assert_eq!(faults(&outputs), [(Faults::NONE, 456), (Faults::LATE, 144)]);
    assert_eq!(last.correction, AngularRate(0), "an old estimate must not be applied for ever");
}

#[test]
fn an_implausible_estimate_is_not_believed() {
    let mut pipeline = new();
    let limit = MAX_MEAN;
    let corrections = |due: &DueWindow| if due.end < 350 { limit } else { AngularRate(limit.0 + 1) };
    let outputs = run(&mut pipeline, drive(0..400), |due| {
        Some(Estimate { corrections: [corrections(due); WINDOW], clamped_inputs: 1, ..Estimate::NONE })
    });
    assert_eq!(statuses(&outputs), [(Init, 300), (Degraded, 11), (Ready, 45), (Degraded, 44)]);
    assert_eq!((pipeline.counters().implausible, pipeline.counters().clamped_inputs), (9, 18));
    assert_eq!(outputs.iter().filter(|output| output.implausible.is_some()).count(), 9);
    assert_eq!(faults(&outputs), [(Faults::NONE, 356), (Faults::IMPLAUSIBLE, 44)]);
    let last = outputs[399].vehicle.live;
    assert_eq!((last.correction, pipeline.pending()), (AngularRate(0), waiting(&last)));
}

#[test]
fn a_rate_beyond_the_signal_is_marked() {
    let mut pipeline = new();
    let samples = (0..320).map(|tick| turning(tick, rate(if tick < 310 { 0.0 } else { 3.0 })));
    let outputs = run(&mut pipeline, samples, constant(0.0));
    let mut encoder = CanEncoder::new(Config::DEFAULT);
    for (number, tx1) in tx1(&mut encoder, &outputs).iter().enumerate() {
        let failed = (tx1.rate, tx1.rate_status) == (0xFFFF, SignalStatus::FAILURE);
        assert_eq!(failed, number >= 310, "{number}");
    }
    assert_eq!(encoder.out_of_range, 10);
    // Neither do the largest codes wrap.
    let samples = (0..400).map(|tick| turning(tick, AngularRate(if tick < 300 { 1_000 } else { i32::MIN })));
    let outputs = run(&mut new(), samples, constant(0.01));
    assert_eq!(outputs[399].vehicle.live.rate, AngularRate(i32::MIN));
    let last = *tx1(&mut CanEncoder::new(Config::DEFAULT), &outputs).last().expect("samples");
    assert_eq!((last.rate, last.rate_status), (0, SignalStatus::FAILURE));
}

fn tx1(encoder: &mut CanEncoder, outputs: &[Output]) -> Vec<Message> {
    let mut first = |output: &Output| encoder.encode(&output.vehicle)[0];
    outputs.iter().map(|output| Message::parse(first(output).data()).expect("a good checksum")).collect()
}

#[test]
fn a_model_that_is_switched_off_corrects_nothing_and_the_rate_is_good() {
    let mut config = PipelineConfig::DEFAULT;
    config.compensate.model = false;
    let outputs = |config, network: &mut dyn FnMut(&DueWindow) -> Option<Estimate>| {
        run(&mut Pipeline::new(config), drive(0..600), network)
    };
    // A correction of any size is neither used nor refused.
    let off = outputs(config, &mut constant(9.0));
    let on = outputs(PipelineConfig::DEFAULT, &mut constant(0.0));
    for (off, on) in off.iter().zip(&on) {
        for (off, on) in [(off.vehicle.live, on.vehicle.live), (off.vehicle.delayed, on.vehicle.delayed)] {
            let source = if on.source == Source::Model { Source::Static } else { on.source };
            assert_eq!(off, YawEstimate { source, sigma: off.sigma, ..on });
            // The network expects a small error of what it corrects.
            assert!(on.source != Source::Model || off.sigma > on.sigma);
        }
    }
    let last = off.last().expect("samples").vehicle.delayed;
    assert_eq!((last.source, last.status), (Source::Static, Ready));
}

#[test]
fn the_rate_of_a_sensor_that_was_moved_is_degraded() {
    // A bias beyond doubt.
    let mut pipeline = Pipeline::new(PipelineConfig { zero_rate: None, ..PipelineConfig::DEFAULT });
    let mut quality = |ticks| {
        let outputs = run(&mut pipeline, drive(ticks), constant(0.0));
        let quality = outputs.last().expect("samples").vehicle.delayed.quality;
        pipeline.mount_moved();
        quality
    };
    assert_eq!([quality(0..900), quality(900..910)], [Quality::Good, Quality::Degraded]);
}
