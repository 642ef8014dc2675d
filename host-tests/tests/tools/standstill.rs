//! Standing still on recordings: half an hour of it, and what looks like it on the road.

use gyronet::bias::{QuietConfig, QuietDetector, STATIC_SAMPLES, StaticConfig, StaticInit};
use gyronet::model::window::WINDOW;
use gyronet::model::{Estimate, SCALE_MIN};
use gyronet::pipeline::{BoardState, Pipeline, PipelineConfig};
use gyronet::sample::{ImuSample, PERIOD_US, Standstill, Validity, WHEELS, WheelSample};
use gyronet::units::{AngularRate, Micros, WheelSpeed};
use gyronet_host_tests::recordings;
use gyronet_host_tests::require::{self, Need};
use gyronet_host_tests::synthetic::{force, rate};
use gyronet_tools::drive::recording::{Recording, Row};
use std::ops::RangeInclusive;

/// The largest yaw in half an hour at rest while the wheels are known to stand, deg.
const LARGEST_YAW: f64 = 0.2;
/// The largest yaw with static initialisation alone, deg: what the other two are compared with.
const DRIFT: RangeInclusive<f64> = 25.0..=40.0;
/// A wheel stands below, and turns above these rates, rad/s.
const STANDS: f64 = 0.15;
const TURNS: f64 = 0.5;

/// Returns the sample of a row in g and deg/s, of a part with z down and forward x.
fn sample(tick: u64, line: &str) -> ImuSample {
    let fields: Vec<f64> = line.split(',').map(|field| field.parse().expect("a number")).collect();
    let &[_, ax, ay, az, gx, gy, gz] = fields.as_slice() else { panic!("seven columns: {line}") };
    ImuSample {
        time: Micros(tick * PERIOD_US),
        specific_force: [ax, -ay, -az].map(|g| force(g * 9.806_65)),
        angular_rate: [gx, -gy, -gz].map(|dps| rate(dps.to_radians())),
        temperature: None,
        validity: Validity::Good,
    }
}

/// Returns the largest and the last yaw, deg, of half an hour at rest, and the number of zero-rate updates.
fn stand(text: &str, config: PipelineConfig, wheels: bool) -> (f64, f64, u32) {
    let mut pipeline = Pipeline::new(config);
    let (mut largest, mut last) = (0.0f64, 0.0);
    for (tick, line) in (0..).zip(text.lines().skip(1)) {
        let sample = sample(tick, line);
        let (speeds, standstill) = ([Some(WheelSpeed(0)); WHEELS], Standstill::Still);
        let wheels = wheels.then_some(WheelSample { time: sample.time, speeds, standstill });
        let output =
            pipeline.correct(sample, wheels.as_ref(), &BoardState::GOOD).expect("a place on the grid");
        assert_eq!(output.refused, None);
        // No network has been trained for this part.
        if let Some(due) = output.window {
            let estimate =
                Estimate { corrections: [AngularRate::ZERO; WINDOW], scale: SCALE_MIN, ..Estimate::NONE };
            pipeline.deliver(due.end, estimate);
        }
        last = output.vehicle.delayed.yaw.rad().to_degrees();
        largest = largest.max(f64::abs(last));
    }
    (largest, last, pipeline.counters().zero_rate_updates)
}

#[test]
fn half_an_hour_at_rest_turns_by_no_more_than_the_bias_allows() {
    let path = recordings::folder().join("static_adis16405/static_100hz.csv");
    let text = std::fs::read_to_string(&path).map_err(|error| format!("{}: {error}", path.display()));
    let Some(text) =
        require::wants("half_an_hour_at_rest_turns_by_no_more_than_the_bias_allows", Need::Data, text)
    else {
        return;
    };
    assert_eq!(text.lines().count(), 180_001);
    let alone = PipelineConfig { zero_rate: None, ..PipelineConfig::DEFAULT };
    let [alone, quiet, stands] = [
        ("static initialisation alone", alone, false),
        ("quiet, no wheels", PipelineConfig::DEFAULT, false),
        ("wheels stand", PipelineConfig::DEFAULT, true),
    ]
    .map(|(name, config, wheels)| {
        let (largest, last, updates) = stand(&text, config, wheels);
        println!("{name}: yaw {last:+.3} deg after 30 min, at most {largest:.3}, {updates} updates");
        largest
    });
    assert!(DRIFT.contains(&alone), "this part drifts: {alone} deg");
    assert!(quiet <= alone, "quiet makes nothing worse: {quiet} deg, {alone} without");
    assert!(stands <= LARGEST_YAW, "{stands} deg");
}

/// Returns the fastest and the slowest of the wheels that were recorded, rad/s.
fn wheels(row: &Row) -> (f64, f64) {
    let rates = || row.wheels.iter().flatten().map(|rate| rate.abs());
    (rates().fold(0.0, f64::max), rates().fold(f64::MAX, f64::min))
}

#[test]
fn quiet_is_found_at_rest_and_hardly_ever_on_the_road() {
    let test = "quiet_is_found_at_rest_and_hardly_ever_on_the_road";
    let Some(paths) = recordings::trials(test, &[2, 3, 4, 6, 7, 8, 9, 11]) else { return };
    let (mut still, mut still_quiet, mut driven, mut driven_quiet) = (0, 0, 0, 0);
    for path in paths {
        let recording = Recording::read(&path).expect("a recording");
        let (start, rest) = recording.rows.split_at(STATIC_SAMPLES as usize);
        let mut init = StaticInit::new(StaticConfig::DEFAULT);
        let judged = start.iter().filter_map(|row| init.add(&row.sample)).last();
        let at_rest = judged.expect("a verdict").expect("it stands");
        let mut detector = QuietDetector::new(QuietConfig::DEFAULT, &StaticConfig::DEFAULT, &at_rest);
        for row in rest {
            let quiet = detector.observe(&row.sample);
            let (fastest, slowest) = wheels(row);
            if fastest < STANDS {
                still += 1;
                still_quiet += i32::from(quiet);
            } else if slowest > TURNS {
                driven += 1;
                driven_quiet += i32::from(quiet);
            }
        }
    }
    println!("quiet: {still_quiet} of {still} samples at rest, {driven_quiet} of {driven} driven");
    assert!(still > 5_000 && driven > 50_000);
    // The second in which it pulls away is judged when it is over.
    assert!(f64::from(driven_quiet) < 0.01 * f64::from(driven), "{driven_quiet} of {driven}");
    assert!(f64::from(still_quiet) > 0.2 * f64::from(still), "{still_quiet} of {still}");
}
