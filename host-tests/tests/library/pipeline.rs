//! The pipeline on made-up streams: status from initialisation to a corrected rate, and what a
//! gap, clipping, motion or a jumping clock does to it.

use gyronet::compensate::{CompensateConfig, DELAY};
use gyronet::estimate::VehicleSample;
use gyronet::health::Status::{Clipped, Degraded, Init, Ready};
use gyronet::health::{Faults, Quality, Source, judge};
use gyronet::model::window::WINDOW;
use gyronet::pipeline::{BoardState, Output};
use gyronet::sample::{ImuSample, Validity};
use gyronet::units::AngularRate;
use gyronet_host_tests::stream::{KNOWN, constant, drive, faults, new, run, statuses};
use gyronet_host_tests::synthetic::{rate, turning};

/// First tick that a window covers: ten samples, then the delay.
const COVERED: u64 = KNOWN + WINDOW as u64 - 1 + DELAY as u64;

#[test]
fn init_then_degraded_then_ready() {
    let mut pipeline = new();
    let outputs = run(&mut pipeline, drive(0..400), constant(0.002));
    assert_eq!(
        statuses(&outputs),
        [(Init, 300), (Degraded, (COVERED - KNOWN) as usize), (Ready, 400 - COVERED as usize)]
    );
    assert_eq!(pipeline.gyro_bias(), Some([AngularRate(0), AngularRate(0), rate(0.001)]));
    let at = |tick: u64| outputs[tick as usize].vehicle.live;
    assert_eq!((at(0).rate, at(299).yaw.0), (rate(0.001), 0), "raw, and nothing summed yet");
    let less_bias = AngularRate(rate(0.25).0 - rate(0.001).0);
    assert_eq!(at(COVERED - 1).rate, less_bias);
    assert_eq!(at(399).rate, less_bias, "a constant correction is taken out");
    for output in &outputs {
        let VehicleSample { live, delayed, tick, .. } = output.vehicle;
        // It has not driven off, so nothing confirms the bias.
        for (estimate, is_modelled) in [(&live, false), (&delayed, true)] {
            let (source, quality) = judge(estimate.status);
            let quality = if quality == Quality::Good { Quality::Degraded } else { quality };
            let source = if source == Source::Model && !is_modelled { Source::Static } else { source };
            assert_eq!((estimate.source, estimate.quality), (source, quality));
        }
        assert_eq!((live.faults, delayed.faults, tick), (Faults::NONE, Faults::NONE, live.tick));
    }
    // The first window ends with the tenth sample, the others follow every fifth.
    let ends: Vec<u32> = outputs.iter().filter_map(|output| Some(output.window?.end)).collect();
    assert_eq!(
        ends,
        (309..400).step_by(CompensateConfig::DEFAULT.stride.samples() as usize).collect::<Vec<u32>>()
    );
    assert_eq!(pipeline.counters().windows, 18, "the one that ended at 399 is still out");
}

#[test]
fn windows_hold_the_features_in_the_order_of_the_training_oldest_first() {
    let standing = |tick: u64| tick < KNOWN;
    let samples = (0..KNOWN + 40).map(|tick| {
        let [x, y, z] = if standing(tick) { [7, 9, 5] } else { [107, 209, tick as i32] };
        let mut sample = turning(tick, AngularRate(z));
        (sample.specific_force[0].0, sample.specific_force[1].0) = (11, 22);
        (sample.angular_rate[0].0, sample.angular_rate[1].0) = (x, y);
        sample
    });
    let up = turning(0, AngularRate(0)).specific_force[2].0;
    for due in run(&mut new(), samples, constant(0.0)).iter().filter_map(|output| output.window) {
        for (features, tick) in due.features.iter().zip(due.end + 1 - WINDOW as u32..) {
            // Specific force x, y, z; angular rate x, y, z less the bias: what the weights were trained on.
            assert_eq!(features, &[11, 22, up, 100, 200, tick as i32 - 5]);
        }
    }
}

#[test]
fn a_gap_of_more_than_a_fifth_of_a_second_restarts_static_initialisation() {
    for (lost, init) in [(21, 500), (20, 300)] {
        let ticks = (0..200).chain(200 + lost..700);
        let outputs = run(&mut new(), ticks.map(|t| turning(t, rate(0.001))), constant(0.0));
        assert_eq!(statuses(&outputs)[0], (Init, init));
    }
}

#[test]
fn a_vehicle_that_moves_is_refused_and_tried_again_without_a_clipped_sample() {
    let mut pipeline = new();
    let samples = (0..700).map(|tick| ImuSample {
        validity: Validity::reported(tick == 300),
        ..turning(
            tick,
            rate(if tick < 150 {
                0.3
            } else if tick == 300 {
                0.06
            } else {
                0.001
            }),
        )
    });
    let outputs = run(&mut pipeline, samples, constant(0.0));
    assert!(outputs[299].refused.is_some());
    assert_eq!(outputs.iter().filter(|output| output.refused.is_some()).count(), 1);
    assert_eq!(statuses(&outputs)[..3], [(Init, 300), (Clipped, 1), (Init, 300)]);
    assert_eq!(pipeline.counters().moving, 1);
    assert_eq!(pipeline.gyro_bias(), Some([AngularRate(0), AngularRate(0), rate(0.001)]));
}

/// Time that no sample covers is reported, wherever between two grid steps the clock lands. A sample that is late by
/// less than half a period is not taken for two.
#[test]
fn a_clock_that_jumps_by_a_few_milliseconds_is_a_gap() {
    for jump_us in (-45_050_i64..=45_000).step_by(100) {
        let mut pipeline = new();
        run(&mut pipeline, drive(0..400), constant(0.0));
        let stamped = drive(400..700).enumerate().map(|(k, mut sample)| {
            // No two readings of a part are the same.
            sample.specific_force[0].0 += 1 + k as i32;
            sample.time.0 = sample.time.0.strict_add_signed(jump_us);
            sample
        });
        let outputs: Vec<Output> =
            stamped.filter_map(|sample| pipeline.correct(sample, None, &BoardState::GOOD).ok()).collect();
        let counters = pipeline.counters();
        let counted = counters.missing + counters.misplaced + counters.clock_jumps;
        let within = (-10_000..6_000).contains(&jump_us);
        assert_eq!(counted > 0, !within, "{jump_us} us");
        assert_eq!(outputs[0].vehicle.delayed.faults == Faults::GAP, !within, "{jump_us} us");
    }
}

#[test]
fn a_clock_jump_is_counted_survived_and_a_doubt() {
    let mut pipeline = new();
    run(&mut pipeline, drive(0..400), constant(0.0));
    let before = pipeline.status(None);
    let later = |tick: u64| tick + 1_000_000;
    assert!(pipeline.correct(drive([later(0)]).next().unwrap(), None, &BoardState::GOOD).is_err());
    let outputs = run(&mut pipeline, drive((1..100).map(later)), constant(0.0));
    assert_eq!(statuses(&outputs), [(Degraded, 11), (Ready, 88)]);
    assert_eq!((pipeline.counters().clock_jumps, pipeline.counters().missing), (1, 0));
    assert_eq!(faults(&outputs), [(Faults::GAP, WINDOW), (Faults::NONE, 99 - WINDOW)]);
    assert_eq!(outputs[0].vehicle.live.tick, 400);
    // A second at least may be missing: 0.249 rad, and what a rate may do in a second.
    let after = pipeline.status(None);
    assert_eq!((before.gaps, after.gaps), (Some(0), Some(1)));
    let grown = 0.01 * f64::from(after.doubt.expect("known") - before.doubt.expect("known"));
    assert!((12.0..29.0).contains(&grown), "{grown} deg");
}

#[test]
fn a_gap_degrades_and_heals_and_the_delayed_rate_leaves_none_out() {
    let lag = CompensateConfig::DEFAULT.lag.samples();
    let mut pipeline = new();
    let outputs = run(&mut pipeline, drive((0..400).chain(403..500)), constant(0.002));
    let broken = WINDOW - 1 + DELAY as usize;
    assert_eq!(
        statuses(&outputs),
        [(Init, 300), (Degraded, 11), (Ready, 89), (Degraded, broken), (Ready, 97 - broken)]
    );
    assert_eq!(outputs[400].vehicle.tick, 403, "a receiver sees what is missing");
    assert_eq!(faults(&outputs), [(Faults::NONE, 400), (Faults::GAP, WINDOW), (Faults::NONE, 97 - WINDOW)]);
    assert_eq!((pipeline.counters().missing, pipeline.counters().samples), (3, 497));
    let (init, sent) = outputs.split_at(KNOWN as usize + lag);
    assert!(
        init.iter().all(|output| output.vehicle.delayed.status == Init && output.vehicle.delayed.yaw.0 == 0)
    );
    // A gap delays what came before it, it swallows none.
    let expected: Vec<u32> = (KNOWN as u32..400).chain(403..500 - lag as u32).collect();
    assert_eq!(sent.iter().map(|output| output.vehicle.delayed.tick).collect::<Vec<_>>(), expected);
    let late = |output: &Output| output.vehicle.delayed.latency_us;
    let across_the_gap = sent.iter().filter(|output| late(output) != Some(10_000 * lag as u32));
    assert_eq!(across_the_gap.map(late).collect::<Vec<_>>(), vec![Some(10_000 * (lag as u32 + 3)); lag]);
    // The first four after start and gap go out before a window has covered them, and the gap
    // takes the last five before it their window.
    let degraded = sent
        .iter()
        .filter(|output| output.vehicle.delayed.status == Degraded)
        .map(|o| o.vehicle.delayed.tick);
    assert_eq!(
        degraded.collect::<Vec<_>>(),
        [300, 301, 302, 303, 395, 396, 397, 398, 399, 403, 404, 405, 406]
    );
    // They are made up for all the same.
    let less = i64::from(rate(0.25).0 - rate(0.001).0);
    let sum: i64 = sent.iter().map(|output| i64::from(output.vehicle.delayed.rate.0)).sum();
    assert_eq!(sum + pipeline.pending().0, less * 197);
}
