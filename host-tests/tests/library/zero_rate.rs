//! Standing still: what it teaches of the bias, what it must not, and that no turn is lost to it.

use gyronet::bias::{ZeroRate, ZeroRateConfig, ZeroRateOutcome};
use gyronet::estimate::YawEstimate;
use gyronet::health::slow::{Evidence, Knowledge, SlowStatus, Verdict};
use gyronet::health::{Faults, Status};
use gyronet::pipeline::{BoardState, Output, Pipeline, PipelineConfig};
use gyronet::sample::{ImuSample, RATE_HZ, Standstill, Validity, WHEELS, WheelSample};
use gyronet::standstill::{Standing, StandstillSource};
use gyronet::units::{AngularRate, WheelSpeed};
use gyronet_host_tests::noise::Noise;
use gyronet_host_tests::stream::constant;
use gyronet_host_tests::synthetic::{noisy, rate, turning};

/// Bias of the gyro, rad/s, and of the network's estimates.
const BIAS: f64 = 0.003;
const NETWORK: f64 = 0.0002;

fn wheels(sample: &ImuSample, standstill: Standstill) -> WheelSample {
    WheelSample { time: sample.time, speeds: [Some(WheelSpeed(0)); WHEELS], standstill }
}

/// A car with its engine off.
fn parked(tick: u64, noise: &mut Noise) -> ImuSample {
    noisy(
        ImuSample { angular_rate: [rate(BIAS); 3], ..turning(tick, AngularRate::ZERO) },
        [0.001, 0.02],
        noise,
    )
}

/// Runs a car that turns at `turn(tick)`, rad/s, and is quiet otherwise, with wheels that report `standstill(tick)`.
fn run(
    ticks: u64,
    turn: impl Fn(u64) -> f64,
    standstill: impl Fn(u64) -> Option<Standstill>,
) -> (Pipeline, Vec<Output>) {
    run_with(PipelineConfig::DEFAULT, NETWORK, 0..ticks, turn, standstill)
}

fn run_with(
    config: PipelineConfig,
    network: f64,
    ticks: impl IntoIterator<Item = u64>,
    turn: impl Fn(u64) -> f64,
    standstill: impl Fn(u64) -> Option<Standstill>,
) -> (Pipeline, Vec<Output>) {
    let mut noise = Noise::new(3);
    let mut pipeline = Pipeline::new(config);
    let mut network = constant(network);
    let mut outputs = Vec::new();
    for tick in ticks {
        let mut sample = parked(tick, &mut noise);
        sample.angular_rate[2].0 += rate(turn(tick)).0;
        let report = standstill(tick).map(|standstill| wheels(&sample, standstill));
        let output =
            pipeline.correct(sample, report.as_ref(), &BoardState::GOOD).expect("a place on the grid");
        if let Some(due) = &output.window {
            pipeline.deliver(due.end, network(due).expect("an estimate"));
        }
        outputs.push(output);
    }
    (pipeline, outputs)
}

fn sigma(output: &Output) -> f64 {
    output.vehicle.live.sigma.expect("a rate").rad_per_sec()
}

fn moves_from(tick: u64) -> impl Fn(u64) -> Option<Standstill> {
    move |now| Some(if now < tick { Standstill::Still } else { Standstill::Moving })
}

fn deg(rad: f64) -> f64 {
    rad.to_degrees()
}

#[test]
fn proven_standstill_is_zero() {
    let (_, outputs) = run(3_000, |_| 0.0, |_| Some(Standstill::Still));
    let held = |rate: &YawEstimate| rate.rate == AngularRate::ZERO && rate.status == Status::Ready;
    assert!(outputs[400..].iter().all(|output| held(&output.vehicle.live) && held(&output.vehicle.delayed)));
}

/// The sum of the errors of static initialisation and network without any turn, deg.
fn drift(ticks: u64) -> f64 {
    let alone = PipelineConfig { zero_rate: None, ..PipelineConfig::DEFAULT };
    let (_, outputs) = run_with(alone, NETWORK, 0..ticks, |_| 0.0, |_| None);
    outputs.last().map_or(0.0, |output| deg(output.vehicle.delayed.yaw.rad()))
}

/// Below every limit of static initialisation, and nothing but the gyro to see it; the last one takes a minute to begin.
#[test]
fn a_slow_turn_is_no_bias() {
    let steps = [0.05, 0.1, 0.3, 1.0, -0.1].map(|turn| (turn, 0.0, 9_000));
    for (deg_per_sec, ramp_s, ticks) in steps.into_iter().chain([(0.3, 60.0, 13_000)]) {
        let begun = |tick: u64| tick.saturating_sub(999) as f64 / f64::max(100.0 * ramp_s, 1.0);
        let turn = |tick| f64::to_radians(deg_per_sec) * begun(tick).min(1.0);
        let (pipeline, outputs) = run(ticks, turn, |_| None);
        let turned = deg(outputs[ticks as usize - 1].vehicle.delayed.yaw.rad()) - drift(ticks);
        let truth: f64 = (0..ticks).map(|tick| deg(turn(tick)) * 0.01).sum();
        let bias = deg(pipeline.bias().rad_per_sec());
        println!("{deg_per_sec} deg/s: {turned:.3} of {truth:.3} deg, bias {bias:+.6} deg/s");
        assert!((turned - truth).abs() < 0.1 * truth.abs(), "{deg_per_sec} deg/s: {turned} of {truth} deg");
        assert!(ramp_s > 0.0 || bias.abs() < 0.02, "{deg_per_sec} deg/s became bias");
    }
}

#[test]
fn quiet_without_wheels_updates_but_never_holds() {
    let (pipeline, outputs) = run(6_000, |_| 0.0, |_| None);
    assert!(pipeline.counters().zero_rate_updates > 30, "{}", pipeline.counters().zero_rate_updates);
    assert!(
        outputs[400..].iter().filter(|output| output.vehicle.delayed.rate == AngularRate::ZERO).count() < 10
    );
    // Where there are wheels they decide, though all is quiet.
    let (pipeline, _) =
        run(3_000, |_| 0.0, |tick| Some(if tick < 300 { Standstill::Still } else { Standstill::Unknown }));
    assert_eq!(pipeline.counters().zero_rate_updates, 0);
}

#[test]
fn wheels_that_see_the_car_pull_away_late_cost_no_angle() {
    // Full lock at walking pace, half a second before a passive wheel sensor shows anything.
    let turn = |tick: u64| if (2_950..3_400).contains(&tick) { 0.15 } else { 0.0 };
    let (pipeline, outputs) = run(5_000, turn, moves_from(3_000));
    let truth = 4.5 * 0.15;
    let turned = outputs[4_999].vehicle.delayed.yaw.rad() + pipeline.pending().rad();
    let live = outputs[4_999].vehicle.live.yaw.rad();
    println!("{turned:.4} and live {live:.4} of {truth:.4} rad");
    assert!((turned - truth).abs() < 0.01 && (live - truth).abs() < 0.01);
    assert!(pipeline.bias().rad_per_sec().abs() < 5e-4, "nor did it become bias");
}

#[test]
fn a_turntable_is_a_turn_whatever_the_wheels_say() {
    // Down to 0.2 deg/s: a ferry.
    for speed in [0.1, 0.0035] {
        let turn = |tick: u64| if tick >= 2_000 { speed } else { 0.0 };
        let (pipeline, outputs) = run(8_000, turn, |_| Some(Standstill::Still));
        let turned = outputs[7_999].vehicle.delayed.yaw.rad() + pipeline.pending().rad();
        println!("{turned:.3} of {:.3} rad, bias {:+.6}", 60.0 * speed, pipeline.bias().rad_per_sec());
        assert!((turned - 60.0 * speed).abs() < 0.05 * 60.0 * speed, "{turned} at {speed} rad/s");
        assert!(pipeline.counters().contradicted > 50);
        // What remains open is part of sigma: the vehicle turns, or the bias was wrong.
        assert!(sigma(&outputs[7_999]) > 0.9 * speed);
        assert!(pipeline.bias().rad_per_sec().abs() < 2e-4, "it is not learnt");
        let SlowStatus { bias, verdict, evidence, .. } = pipeline.status(Some(Standstill::Still));
        assert_eq!((bias, verdict, evidence), (Knowledge::Refused, Verdict::Unknown, Evidence::Wheels));
    }
}

#[test]
fn locked_wheels_in_a_turn_never_hold_the_rate_at_zero() {
    // Braking on ice: the wheels stand after 30 s, the vehicle slides on round the bend.
    let turn = |tick: u64| if tick >= 2_900 { 0.3 } else { 0.0 };
    let locked = |tick: u64| {
        let still = tick < 2_900 || (3_000..3_200).contains(&tick);
        Some(if still { Standstill::Still } else { Standstill::Moving })
    };
    let (_, outputs) = run(3_400, turn, locked);
    for (tick, output) in outputs.iter().enumerate().skip(2_910) {
        assert!((output.vehicle.delayed.rate.rad_per_sec() - 0.3).abs() < 0.01, "sample {tick}");
        let reported = output.vehicle.delayed.faults.0 & Faults::WHEELS.0 != 0;
        assert_eq!(reported, (3_001..3_200).contains(&tick), "sample {tick}");
    }
}

/// Initialised on a ferry that turns at 1 deg/s; then half a minute of driving and of standing in turn.
#[test]
fn stops_that_agree_heal_a_bias_that_was_wrong_from_the_start() {
    let ferry = f64::to_radians(1.0);
    let still = |tick: u64| tick < 1_000 || (tick - 1_000) % 6_000 >= 3_000;
    let (pipeline, outputs) = run(
        25_000,
        |tick| if tick < 1_000 { ferry } else { 0.0 },
        |tick| Some(if still(tick) { Standstill::Still } else { Standstill::Moving }),
    );
    let error = |tick: usize| outputs[tick].vehicle.live.rate.rad_per_sec().abs();
    // The first stop shows that something is wrong, and sigma says so from then on.
    for tick in (4_700..18_900).filter(|tick| !still(*tick as u64)) {
        let sigma = sigma(&outputs[tick]);
        assert!(error(tick) < 2.0 * sigma, "sample {tick}: {} with sigma {sigma}", error(tick));
    }
    let healed = pipeline.bias().rad_per_sec() + ferry;
    println!("bias {healed:+.6} rad/s after three stops, {} contradicted", pipeline.counters().contradicted);
    assert!(healed.abs() < 3e-4, "{healed}");
    let sigma = sigma(&outputs[24_999]);
    assert!(sigma < 5e-4, "no doubt remains: {sigma}");
}

#[test]
fn warming_does_not_open_the_gate_to_a_slow_bend() {
    let mut zero_rate = ZeroRate::new(ZeroRateConfig::DEFAULT);
    let smooth = Standing { source: StandstillSource::Inertial, probability: 0.0, is_contradicted: false };
    let bend = f64::to_radians(0.08);
    for _ in 0..12_000 {
        zero_rate.observe(Some(rate(bend)), smooth, 6e-4);
    }
    let bias = zero_rate.bias().rad_per_sec();
    assert!(bias < 0.1 * bend, "{bias} of {bend} rad/s");
}

#[test]
fn a_stop_that_agrees_with_the_bias_withdraws_the_doubt() {
    let stop = |zero_rate: &mut ZeroRate, left: f64| {
        for _ in 0..600 {
            zero_rate.observe(Some(rate(left)), Standing::WHEELS, 0.0);
        }
        zero_rate.observe(None, Standing::UNKNOWN, 0.0);
        (zero_rate.is_doubted(), zero_rate.bias().rad_per_sec())
    };
    let mut zero_rate = ZeroRate::new(ZeroRateConfig::DEFAULT);
    for _ in 0..4 {
        for _ in 0..2 {
            let (doubted, bias) = stop(&mut zero_rate, 0.01);
            assert!(doubted && bias.abs() < 3e-4, "{bias}");
            assert!(zero_rate.sigma() > 0.009);
        }
        let (doubted, _) = stop(&mut zero_rate, 0.0);
        assert!(!doubted && zero_rate.sigma() < 2e-4);
    }
    // Stops that do not agree with each other prove nothing.
    for left in [0.01, -0.02, 0.03, -0.04] {
        assert!(stop(&mut zero_rate, left).1.abs() < 3e-4);
    }
    // Three that do are the bias, which one that agrees with it defends in turn.
    let (_, bias) = [0.02; 3].map(|left| stop(&mut zero_rate, left))[2];
    assert!((bias - 0.02).abs() < 3e-4, "{bias}");
    assert_eq!([0.03, 0.02].map(|left| stop(&mut zero_rate, left).0), [true, false]);
}

#[test]
fn uncertainty_grows_with_time_and_temperature_and_shrinks_at_stops() {
    let mut zero_rate = ZeroRate::new(ZeroRateConfig::DEFAULT);
    let mut go = |seconds: u32, source, thermal: f32| {
        for _ in 0..100 * seconds {
            zero_rate.observe(Some(rate(0.0001)), source, thermal);
        }
        (zero_rate.sigma(), zero_rate.bias().rad_per_sec())
    };
    let (start, _) = go(1, Standing::UNKNOWN, 0.0);
    let (stop, bias) = go(20, Standing::WHEELS, 0.0);
    assert!(stop < start && bias > 0.0, "{start} {stop} {bias}");
    let (drive, kept) = go(600, Standing::UNKNOWN, 0.0);
    assert!(drive > stop && (drive / stop) < 5.0, "{stop} {drive}");
    assert!(kept > 0.0 && kept < bias, "the offset of the stop is no bias: {bias} {kept}");
    let (warm, _) = go(2, Standing::UNKNOWN, 0.0017);
    assert!((warm - 0.0017).abs() < 2e-4, "{warm}");
    let (hot, _) = go(2, Standing::UNKNOWN, 0.1);
    // The root of the bound is right to 2e-6.
    assert!(hot <= ZeroRateConfig::DEFAULT.max_bias * (1.0 + 2e-6), "bounded: {hot}");
}

fn second(zero_rate: &mut ZeroRate, left: f64) -> Option<ZeroRateOutcome> {
    let sample = |_| zero_rate.observe(Some(rate(left)), Standing::WHEELS, 0.0);
    (0..RATE_HZ).filter_map(sample).last()
}

#[test]
fn one_steady_second_contradicts_the_bias_and_one_in_which_a_turn_begins_does_not() {
    for (begin, end, doubted) in [(0.01, 0.01, true), (0.0, 0.02, false)] {
        let mut zero_rate = ZeroRate::new(ZeroRateConfig::DEFAULT);
        (0..2).for_each(|_| _ = second(&mut zero_rate, 0.0));
        for sample in 0..RATE_HZ {
            let left = begin + (end - begin) * f64::from(sample) / f64::from(RATE_HZ);
            zero_rate.observe(Some(rate(left)), Standing::WHEELS, 0.0);
        }
        assert_eq!(zero_rate.is_doubted(), doubted, "{begin} to {end} rad/s");
    }
}

/// A bias that steps where the vehicle has stood, whether the judge then sees a standstill or the step.
#[test]
fn a_turn_since_a_standstill_without_wheels_is_expected_until_the_vehicle_drives_off() {
    let quiet = Standing { source: StandstillSource::Inertial, probability: 0.98, ..Standing::UNKNOWN };
    let pass = |zero_rate: &mut ZeroRate, left: f64, standing, samples: u32| {
        for _ in 0..samples {
            zero_rate.observe(Some(rate(left)), standing, 0.0);
            zero_rate.contradicts_wheels(rate(left));
        }
        zero_rate.sigma()
    };
    let mut zero_rate = ZeroRate::new(ZeroRateConfig::DEFAULT);
    assert!(pass(&mut zero_rate, 0.0, quiet, 300) < 3e-4);
    assert!(pass(&mut zero_rate, 0.0, Standing::UNKNOWN, 10) < 3e-4);
    let begun = pass(&mut zero_rate, 0.01, Standing::UNKNOWN, 90);
    assert!((5e-3..0.011).contains(&begun), "the judge was not sure when it began: {begun}");
    assert!(pass(&mut zero_rate, 0.01, quiet, 90) > 5e-3);
    assert!(pass(&mut zero_rate, 0.01, Standing::UNKNOWN, 5 * RATE_HZ) > 5e-3);
    let mut ended = zero_rate.clone();
    assert!(pass(&mut ended, 0.0, Standing::UNKNOWN, 100) < 3e-4, "it has ended");
    pass(&mut ended, 0.01, Standing::UNKNOWN, 200);
    ended.moves();
    assert!(pass(&mut ended, 0.01, Standing::UNKNOWN, 100) < 3e-4, "it pulled away in a turn");
    zero_rate.moves();
    let doubt = pass(&mut zero_rate, 0.0, Standing::UNKNOWN, 1_000);
    assert!((0.009..0.011).contains(&doubt), "nothing pulls away so slowly: {doubt}");
}

/// A deck may have turned since the bias was read: four sigma of two means that each have an offset and a noise.
#[test]
fn the_last_reading_before_driving_off_is_the_bias_where_it_differs_by_more_than_noise() {
    let ZeroRateConfig { initial, standstill, noise, .. } = ZeroRateConfig::DEFAULT;
    let gate = 4.0 * (2.0 * (initial * initial + standstill * standstill + noise * noise)).sqrt();
    for (share, is_taken) in [(0.95, false), (1.05, true), (-0.95, false), (-1.05, true)] {
        let mut zero_rate = ZeroRate::claimed(ZeroRateConfig::DEFAULT, 0.0, Some(0.0), 0.0);
        zero_rate.rest(share * gate, 0.0);
        zero_rate.moves();
        let due = if is_taken { f64::from(share * gate) } else { 0.0 };
        let bias = zero_rate.bias().rad_per_sec();
        assert!((bias - due).abs() < 1e-7 && zero_rate.is_confirmed(), "{share} of the gate: {bias}");
        assert!((zero_rate.sigma() - initial).abs() < 1e-3 * initial, "{}", zero_rate.sigma());
    }
}

/// A first reading that changed while it was taken: a turn had begun.
#[test]
fn a_bad_first_reading_leaves_the_later_ones_their_weight() {
    let initial = ZeroRateConfig::DEFAULT.initial;
    for (changed, sigma) in [(0.0, initial), (6.0 * initial, initial), (0.006, 0.006 - 5.0 * initial)] {
        let stated = ZeroRate::claimed(ZeroRateConfig::DEFAULT, 0.0, Some(0.0), changed).sigma();
        assert!((stated - sigma).abs() < 1e-3 * sigma, "changed by {changed}: {stated}");
    }
    let mut zero_rate = ZeroRate::claimed(ZeroRateConfig::DEFAULT, 0.0, Some(0.0), 0.006);
    for _ in 0..20 * RATE_HZ {
        zero_rate.observe(Some(AngularRate::ZERO), Standing::WHEELS, 0.0);
    }
    zero_rate.rest(0.005, 0.0);
    zero_rate.moves();
    assert!((zero_rate.bias().rad_per_sec() - 0.005).abs() < 1e-7);
}

/// The largest bias bounds what is learnt, and how far the warming of the sensor opens the gate.
#[test]
fn no_standstill_teaches_more_than_the_largest_bias() {
    let largest = f64::from(ZeroRateConfig::DEFAULT.max_bias);
    let mut zero_rate = ZeroRate::new(ZeroRateConfig { initial: 0.1, ..ZeroRateConfig::DEFAULT });
    (0..5).for_each(|_| _ = second(&mut zero_rate, 0.3));
    assert!(zero_rate.bias().rad_per_sec() <= 2.0 * largest, "with the offset of this standstill");
    zero_rate.observe(None, Standing::UNKNOWN, 0.0);
    assert!((zero_rate.bias().rad_per_sec() - largest).abs() < 1e-6);
    let mut hot = ZeroRate::new(ZeroRateConfig::DEFAULT);
    let outcome = (0..RATE_HZ).filter_map(|_| hot.observe(Some(rate(0.6)), Standing::WHEELS, 10.0)).last();
    assert_eq!(outcome, Some(ZeroRateOutcome::Refused));
}

/// The bias and the offset of the standstill are both part of what the reading is held against.
#[test]
fn a_second_in_which_a_turn_begins_is_expected_as_far_as_it_is_off() {
    let config = ZeroRateConfig { initial: 0.01, standstill: 0.01, ..ZeroRateConfig::DEFAULT };
    let mut zero_rate = ZeroRate::new(config);
    (0..10).for_each(|_| _ = second(&mut zero_rate, 0.02));
    for sample in 0..RATE_HZ {
        let left = 0.06 + 0.04 * f64::from(sample) / f64::from(RATE_HZ);
        zero_rate.observe(Some(rate(left)), Standing::WHEELS, 0.0);
    }
    let sigma = f64::from(zero_rate.sigma());
    assert!((0.058..0.064).contains(&sigma), "0.08 rad/s, of which 0.02 are known: {sigma}");
}

/// What is hardly taken for a standstill may be a bend that begins: its rate is not the bias.
#[test]
fn a_bend_that_may_be_a_standstill_is_no_bias() {
    let quiet = Standing { source: StandstillSource::Inertial, probability: 0.5, ..Standing::UNKNOWN };
    let mut zero_rate = ZeroRate::new(ZeroRateConfig::DEFAULT);
    for second in 0..60 {
        for _ in 0..RATE_HZ {
            zero_rate.observe(Some(rate(5e-5 * f64::from(second))), quiet, 0.0);
        }
    }
    zero_rate.observe(None, Standing::UNKNOWN, 0.0);
    let found = zero_rate.bias().rad_per_sec();
    assert!((1e-7..1e-5).contains(&found), "a hundredth of it at most: {found:e}");
}

/// Ten seconds; then another stop must confirm the bias, once the vehicle has moved.
#[test]
fn a_reading_at_rest_is_evidence_for_ten_seconds() {
    let claimed = || ZeroRate::claimed(ZeroRateConfig::DEFAULT, 0.0, Some(0.0), 0.0);
    let pass = |zero_rate: &mut ZeroRate, samples: u32| {
        for _ in 0..samples {
            zero_rate.observe(None, Standing::UNKNOWN, 0.0);
        }
    };
    for (samples, is_evidence) in [(10 * RATE_HZ - 1, true), (10 * RATE_HZ, false)] {
        let mut zero_rate = claimed();
        zero_rate.rest(0.0, 0.0);
        pass(&mut zero_rate, samples);
        zero_rate.moves();
        assert_eq!(zero_rate.is_confirmed(), is_evidence, "{samples}");
    }
    for (has_moved, left) in [(false, 0.0), (true, 0.0), (false, 0.01), (true, 0.01)] {
        let mut zero_rate = claimed();
        pass(&mut zero_rate, 10 * RATE_HZ);
        if has_moved {
            zero_rate.moves();
        }
        (0..3).for_each(|_| _ = second(&mut zero_rate, left));
        pass(&mut zero_rate, 1);
        assert_eq!(zero_rate.is_confirmed(), has_moved, "{left}");
        let bias = zero_rate.bias().rad_per_sec();
        let due = if has_moved { left } else { 0.0 };
        assert!((bias - due).abs() < 1e-4, "{has_moved} {left}: {bias}");
    }
}

/// The reading at rest before a vehicle drives off is its bias. Neither a saturated reading nor creeping, in which the wheels
/// turn and nothing else shows, is part of it.
#[test]
fn only_valid_readings_of_standing_wheels_are_a_reading_at_rest() {
    let bias_after = |validity: Validity, speed: WheelSpeed, added: f64| {
        let (mut noise, mut pipeline) = (Noise::new(3), Pipeline::new(PipelineConfig::DEFAULT));
        for tick in 0..2_000 {
            let mut sample = parked(tick, &mut noise);
            if (1_000..1_700).contains(&tick) {
                sample.angular_rate[2].0 += rate(added).0;
                sample.validity = if tick % 10 == 0 { validity } else { Validity::Good };
            }
            let speed = match tick {
                ..1_000 => WheelSpeed(0),
                1_000..1_700 => speed,
                _ => WheelSpeed(5 << WheelSpeed::FRACTION_BITS),
            };
            let standstill = if speed.0 == 0 { Standstill::Unknown } else { Standstill::Moving };
            let report = WheelSample { time: sample.time, speeds: [Some(speed); WHEELS], standstill };
            pipeline.correct(sample, Some(&report), &BoardState::GOOD).expect("a place on the grid");
        }
        pipeline.bias().rad_per_sec()
    };
    let half = WheelSpeed(1 << (WheelSpeed::FRACTION_BITS - 1));
    let rest = bias_after(Validity::Good, WheelSpeed(0), 0.004);
    assert!((rest - 0.004).abs() < 2e-4, "a deck that turned until then: {rest}");
    for (validity, speed) in [(Validity::Saturated, WheelSpeed(0)), (Validity::Good, half)] {
        let bias = bias_after(validity, speed, 0.004);
        assert!(bias.abs() < 2e-4, "{validity:?} at {speed:?}: {bias}");
    }
}

#[test]
fn a_stop_begins_without_the_offset_of_the_one_before() {
    let mut zero_rate = ZeroRate::new(ZeroRateConfig::DEFAULT);
    (0..20).for_each(|_| _ = second(&mut zero_rate, 0.0006));
    let standing = zero_rate.bias();
    zero_rate.observe(None, Standing::UNKNOWN, 0.0);
    let driving = zero_rate.bias();
    assert!(2 * standing.0 > 3 * driving.0 && driving.0 > 0, "{standing:?} {driving:?}");
    zero_rate.observe(Some(rate(0.0006)), Standing::WHEELS, 0.0);
    assert_eq!(zero_rate.bias(), driving);
}

/// Runs a parked car with a gap of some samples at a tick, and with wheels that stand, if there are any.
fn parked_with_gap(ticks: u64, gap: std::ops::Range<u64>, wheels_stand: bool) -> (Pipeline, Vec<Output>) {
    let ticks = (0..ticks).filter(|tick| !gap.contains(tick));
    run_with(PipelineConfig::DEFAULT, 0.0, ticks, |_| 0.0, |_| wheels_stand.then_some(Standstill::Still))
}

#[test]
fn no_second_at_standstill_spans_a_gap() {
    let updates = |gap| parked_with_gap(1_500, gap, true).0.counters().zero_rate_updates;
    let (whole, broken) = (updates(0..0), updates(860..863));
    assert!(whole >= 9 && broken < whole, "{broken} updates of {whole}");
}

#[test]
fn no_quiet_spans_a_gap() {
    let (_, outputs) = parked_with_gap(1_500, 860..863, false);
    let source = |tick: usize| outputs[tick].standing.source;
    assert_eq!(source(859), StandstillSource::Inertial);
    // Two seconds are wanted again.
    for tick in (860..1_050).step_by(10) {
        assert_eq!(source(tick), StandstillSource::None, "tick {tick}");
    }
    assert_eq!(source(1_100), StandstillSource::Inertial);
}

/// A vehicle that pulls away before its wheels show it: what was held back is carried, and reported while it is.
#[test]
fn too_much_to_carry_is_reported_until_it_is_carried() {
    let mut config = PipelineConfig::DEFAULT;
    config.compensate.max_revision = AngularRate::from_deg_per_sec(0.1);
    let implausible = |turn: f64| {
        let turning = move |tick: u64| if (940..1_000).contains(&tick) { turn } else { 0.0 };
        let (_, outputs) = run_with(config, 0.0, 0..1_300, turning, moves_from(1_000));
        let is = |output: &&Output| output.vehicle.live.faults.0 & Faults::IMPLAUSIBLE.0 != 0;
        assert!(!outputs[1_250..].iter().any(|output| is(&output)), "it has been carried");
        outputs.iter().filter(is).count()
    };
    assert_eq!(implausible(0.0), 0);
    let reported = implausible(0.003);
    assert!((40..=110).contains(&reported), "{reported}");
}
