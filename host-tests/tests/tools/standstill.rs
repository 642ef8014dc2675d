//! Standing still on recordings: half an hour of it, and what looks like it on the road.

use crate::standstill_truth::{Truth, read};
use gyronet::coprocessor::{Clock, Config, Coprocessor};
use gyronet::model::Estimate;
use gyronet::pipeline::{BoardState, Pipeline, PipelineConfig};
use gyronet::sample::{ImuSample, Standstill, WHEELS, WheelSample};
use gyronet::units::{AngularRate, WheelSpeed};
use gyronet_host_tests::recordings;
use gyronet_host_tests::synthetic::{force, rate, turning};
use gyronet_tools::board::Uncorrected;
use gyronet_tools::drive::recording::Row;
use gyronet_tools::drive::stream::Recording;
use gyronet_tools::drive::wheel_frames;
use std::ops::RangeInclusive;

/// The largest yaw in half an hour at rest while the wheels are known to stand, deg.
const LARGEST_YAW: f64 = 0.2;
/// The largest yaw with static initialisation alone, deg: what the other two are compared with.
const DRIFT: RangeInclusive<f64> = 25.0..=40.0;

/// The sample of a row in g and deg/s, of a part with z down and forward x.
fn sample(tick: u64, line: &str) -> ImuSample {
    let fields: Vec<f64> = line.split(',').map(|field| field.parse().expect("a number")).collect();
    let &[_, ax, ay, az, gx, gy, gz] = fields.as_slice() else { panic!("seven columns: {line}") };
    ImuSample {
        specific_force: [ax, -ay, -az].map(|g| force(g * 9.806_65)),
        angular_rate: [gx, -gy, -gz].map(|dps| rate(dps.to_radians())),
        ..turning(tick, AngularRate::ZERO)
    }
}

/// The largest and the last yaw, deg, of half an hour at rest, and the number of zero-rate updates.
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
            pipeline.deliver(due.end, Estimate::NONE);
        }
        last = output.vehicle.delayed.yaw.rad().to_degrees();
        largest = largest.max(f64::abs(last));
    }
    (largest, last, pipeline.counters().zero_rate_updates)
}

#[test]
fn half_an_hour_at_rest_turns_by_no_more_than_the_bias_allows() {
    let Some(path) = recordings::found("static_adis16405/static_100hz.csv") else { return };
    let text = std::fs::read_to_string(path).expect("a recording");
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

/// Seconds of motion that may be claimed as standstill on a recording, and the least shares of the stops of three
/// seconds or more that are found: with wheels, and without.
const CLAIMED_S: f64 = 0.5;
const FOUND: [f64; 2] = [0.95, 0.6];

/// At which rows the board says that the vehicle stands.
fn claims(recording: &Recording, with_wheels: bool) -> Option<Vec<bool>> {
    let mut wheels = with_wheels.then(|| recording.wheels()).map_or(Some(None), |wheels| wheels.map(Some))?;
    let receiver = wheels.as_ref().map(|_| wheel_frames::receiver());
    let config = Config { wheels: receiver, clock: Clock::Sensor, ..Config::DEFAULT };
    let mut board = Coprocessor::new(config);
    let claim = |row: &Row| {
        let now = row.sample.time;
        if let Some(frame) = wheels.as_mut().and_then(|wheels| wheels.next(row)) {
            let _ = board.can(&frame, now);
        }
        let stands = board
            .imu(row.sample, now, &mut ())
            .is_ok_and(|seen| seen.is_some_and(|seen| seen.standing.is_likely()));
        board.estimate(&mut Uncorrected);
        stands
    };
    Some(recording.rows.iter().map(claim).collect())
}

#[test]
fn standstills_of_every_recording_with_a_speed() {
    let Some(paths) = recordings::with_speed() else { return };
    println!("recording, s of motion claimed, stops of 3 s found");
    let (mut stops, mut used, mut failed) = ([0; 2], [0; 2], Vec::new());
    let rows = gyronet_host_tests::parallel::map(&paths, |path| {
        let recording = read(path);
        let truth = Truth::read(path, &recording)?;
        let judged = [true, false].map(|with_wheels| {
            let claims = claims(&recording, with_wheels)?;
            let claimed = claims.iter().zip(&truth.moves).filter(|(claim, moves)| **claim && **moves).count();
            let count =
                |stop: &std::ops::Range<usize>| claims[stop.clone()].iter().filter(|claim| **claim).count();
            let stops = truth.stops();
            let found = stops.iter().filter(|stop| count(stop) >= 100).count();
            Some((claimed as f64 / 100.0, found, stops.len()))
        });
        Some((recording.name().to_owned(), judged))
    });
    for (name, judged) in rows.into_iter().flatten() {
        for (kind, judged) in judged.into_iter().enumerate() {
            let Some((claimed, found, all)) = judged else { continue };
            let how = ["with wheels", "without"][kind];
            println!("{name:<28} {how:<11} {claimed:.2} s, {found} of {all}");
            (stops[kind], used[kind]) = (stops[kind] + all, used[kind] + found);
            failed.extend((claimed > CLAIMED_S).then(|| format!("{name}: {claimed} s of motion claimed")));
        }
    }
    println!("found: {} of {} stops with wheels, {} of {} without", used[0], stops[0], used[1], stops[1]);
    assert!(failed.is_empty(), "{failed:?}");
    for kind in [0, 1] {
        assert!(f64::from(used[kind] as u32) >= FOUND[kind] * f64::from(stops[kind] as u32));
    }
}
