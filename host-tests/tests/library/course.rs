//! Courses: what the board learns from them while it drives, and what false ones must not teach it.

use gyronet::fog::FogErrors;
use gyronet::heading::{Gain, Heading};
use gyronet::health::slow::Knowledge;
use gyronet::health::{Quality, Status};
use gyronet::pipeline::{BoardState, Output, Pipeline, PipelineConfig};
use gyronet::sample::{RATE_HZ, Standstill, WHEELS, WheelSample};
use gyronet::units::{AngularRate, WheelSpeed};
use gyronet_host_tests::noise::Noise;
use gyronet_host_tests::stream::constant;
use gyronet_host_tests::synthetic::{force, rate, turning};
use gyronet_host_tests::winding::{BIAS, GAIN, road};
use std::f64::consts::{PI, TAU};

/// Sigma of a course at 15 m/s, rad; that of a slow vehicle's speed across it, m/s, which its receiver states.
const NOISE: f64 = 0.01;
const ACROSS: f64 = 0.02;
const SECOND: usize = RATE_HZ as usize;

/// The course that arrives at a second, from the headings so far.
type Course<'a> = dyn Fn(usize, &[f64]) -> Option<f64> + 'a;

/// A drive: how long it stands first, s, its yaw rate, and its courses.
#[derive(Clone, Copy)]
struct Drive<'a> {
    stands: usize,
    /// Yaw rate while the wheels stand, rad/s.
    creeps: f64,
    turn: &'a dyn Fn(f64) -> f64,
    course: &'a Course<'a>,
}

struct Part {
    noise: Noise,
    gain: f64,
    /// Random walk of the bias in 10 ms, rad/s.
    walk: f64,
    /// Speed of the vehicle that it is on, m/s; backwards negative.
    speed: fn(f64) -> f64,
    /// True if every three seconds three samples are lost.
    is_lossy: bool,
}

fn fast(_second: f64) -> f64 {
    15.0
}

/// The pipeline after a drive of `seconds`, its outputs, and the true headings of every sample.
fn drive(seconds: usize, drive: &Drive<'_>) -> (Pipeline, Vec<Output>, Vec<f64>) {
    let part = Part { noise: Noise::new(7), gain: GAIN, walk: 0.0, speed: fast, is_lossy: false };
    drive_with(PipelineConfig::DEFAULT, part, seconds, drive)
}

fn drive_with(
    config: PipelineConfig,
    Part { mut noise, gain, walk, speed, is_lossy }: Part,
    seconds: usize,
    drive: &Drive<'_>,
) -> (Pipeline, Vec<Output>, Vec<f64>) {
    let (mut bias, mut receiver) = (BIAS, Noise::new(3));
    let mut pipeline = Pipeline::new(config);
    let mut network = constant(0.0);
    let (mut outputs, mut headings) = (Vec::new(), Vec::new());
    let mut heading = 1.0;
    for tick in 0..seconds * SECOND {
        let moves = tick >= drive.stands * SECOND;
        let yaw_rate = if moves { (drive.turn)(tick as f64 * 0.01) } else { drive.creeps };
        heading += yaw_rate * 0.01;
        headings.push(heading);
        if walk > 0.0 {
            bias += walk * noise.normal();
        }
        let mut sample = turning(tick as u64, rate((1.0 + gain) * yaw_rate + bias + 0.002 * noise.normal()));
        for axis in 0..3 {
            sample.specific_force[axis].0 += force(0.3 * noise.normal()).0;
        }
        for axis in 0..2 {
            sample.angular_rate[axis] = rate(0.01 * noise.normal());
        }
        if moves
            && tick % SECOND == 0
            && let Some(course) = (drive.course)(tick / SECOND, &headings)
        {
            let speed = speed(tick as f64 * 0.01);
            let sigma = if speed < 3.0 { ACROSS / speed.abs() } else { NOISE };
            let course = course + sigma * receiver.normal() + if speed < 0.0 { PI } else { 0.0 };
            pipeline.course(&Heading {
                course: Some((-course).rem_euclid(TAU) as f32),
                course_sigma: Some(sigma as f32).filter(|_| speed < 3.0),
                speed: Some(speed.abs() as f32),
                speed_sigma: None,
            });
        }
        let (speed, standstill) = if moves {
            (15 << WheelSpeed::FRACTION_BITS, Standstill::Moving)
        } else {
            (0, Standstill::Still)
        };
        let wheels = WheelSample { time: sample.time, speeds: [Some(WheelSpeed(speed)); WHEELS], standstill };
        if is_lossy && tick % (3 * SECOND) < 3 {
            continue;
        }
        let output = pipeline.correct(sample, Some(&wheels), &BoardState::GOOD).expect("a place on the grid");
        if let Some(due) = &output.window {
            pipeline.deliver(due.end, network(due).expect("an estimate"));
        }
        outputs.push(output);
    }
    (pipeline, outputs, headings)
}

fn ago(headings: &[f64], seconds: f64) -> Option<f64> {
    headings.len().checked_sub(1 + (seconds * 100.0) as usize).map(|at| headings[at])
}

/// The error of the yaw over the last `seconds`, rad.
fn error(outputs: &[Output], headings: &[f64], seconds: usize) -> f64 {
    let [from, to] = [outputs.len() - seconds * SECOND, outputs.len() - 1];
    let tick = |at: usize| outputs[at].vehicle.delayed.tick as usize;
    let turned = outputs[to].vehicle.delayed.yaw.rad() - outputs[from].vehicle.delayed.yaw.rad();
    turned - (headings[tick(to)] - headings[tick(from)])
}

fn true_course(second: usize, headings: &[f64]) -> Option<f64> {
    ago(headings, 0.4).filter(|_| second >= 1)
}

#[test]
fn a_vehicle_that_never_stands_is_usable_in_20_s_and_good_in_60() {
    // One course in so many is off by 30 deg, which delays the start. The bias then stays at the sigma with which a rate becomes
    // good, 1.7 deg in a minute: the limit is two of them.
    for (is_lossy, outliers, [soon, later], off) in
        [(false, 1000, [20.0, 60.0], 0.6), (true, 1000, [20.0, 60.0], 0.6), (false, 7, [50.0, 130.0], 3.4)]
    {
        let course = |second: usize, headings: &[f64]| {
            let off = if second % outliers == outliers - 1 { 0.5 } else { 0.0 };
            true_course(second, headings).filter(|_| second < later as usize + 30).map(|course| course + off)
        };
        let moving = Drive { stands: 0, creeps: 0.0, turn: &road, course: &course };
        let driven = |seconds| {
            let part = Part { noise: Noise::new(7), gain: GAIN, walk: 0.0, speed: fast, is_lossy };
            drive_with(PipelineConfig::DEFAULT, part, seconds, &moving)
        };
        let (pipeline, outputs, headings) = driven(later as usize + 90);
        let first = |wanted: &dyn Fn(&Output) -> bool| {
            outputs.iter().find(|output| wanted(output)).map(|output| f64::from(output.vehicle.tick) * 0.01)
        };
        let usable = first(&|output| output.vehicle.delayed.status != Status::Init).expect("a rate");
        let good = first(&|output| output.vehicle.delayed.quality == Quality::Good).expect("a good rate");
        println!("usable after {usable} s, good after {good} s, {:?}", pipeline.course_counters());
        assert!(usable <= soon && good <= later);
        // No rate is good whose bias is coarse.
        let known = [good - 1.0, good + 2.0].map(|at| driven(at as usize).0.status(None).bias);
        assert_eq!(known, [Knowledge::Coarse, Knowledge::Fine]);
        let held = error(&outputs, &headings, 58).to_degrees();
        println!("heading held for a minute: {held:.3} deg");
        assert!(held.abs() < off, "{held} deg");
        assert_eq!(pipeline.status(None).bias, Knowledge::Fine);
    }
    // Without courses it never starts.
    let (_, outputs, _) = drive(60, &Drive { stands: 0, creeps: 0.0, turn: &road, course: &|_, _| None });
    assert!(outputs.iter().all(|output| output.vehicle.delayed.status == Status::Init));
}

#[test]
fn the_gain_is_learnt_between_straights_where_the_vehicle_turns_both_ways() {
    let turns = Drive { stands: 5, creeps: 0.0, turn: &streets, course: &true_course };
    let (pipeline, ..) = drive(1_800, &turns);
    let (gain, sigma) = pipeline.gain();
    println!("gain {gain:.5}, sigma {sigma:?}");
    assert!((f64::from(gain) - GAIN).abs() < 0.002, "{gain}");
    assert!(pipeline.status(None).gain != Knowledge::Unknown);

    // At the next start it holds from the first sample on, without a course.
    let of = PipelineConfig::DEFAULT.gain_of;
    let known = sigma.map(|sigma| Gain { share: gain, sigma, of }.aged());
    assert!(known.is_some_and(|known| known.sigma < 0.002), "{known:?}");
    let config = PipelineConfig { gain: known, ..PipelineConfig::DEFAULT };
    let without = Drive { stands: 5, creeps: 0.0, turn: &|_| 0.3, course: &|_, _| None };
    let part = Part { noise: Noise::new(8), gain: GAIN, walk: 0.0, speed: fast, is_lossy: false };
    let (pipeline, outputs, headings) = drive_with(config, part, 60, &without);
    assert_eq!(pipeline.status(None).gain, Knowledge::Coarse);
    let (_, alone, _) = drive(60, &without);
    let [with, alone] = [&outputs, &alone].map(|outputs| error(outputs, &headings, 50).abs().to_degrees());
    println!("a circle of 50 s without courses: {with:.2} deg with the gain, {alone:.2} without");
    assert!(with < 0.35 * alone);
    // A sensor that hangs differently has another gain.
    let mut moved = pipeline;
    moved.mount_moved();
    let (share, sigma) = moved.gain();
    assert!(share == 0.0 && sigma.is_some_and(|sigma| sigma > 0.004_9), "{share} {sigma:?}");
}

#[test]
fn a_gain_replaces_one_that_is_less_accurate_or_that_it_contradicts() {
    let gain = |share, sigma, of| Gain { share, sigma, of };
    let stored = gain(0.01, 1.9e-3, 7);
    for (new, replaces) in [
        (gain(0.01, 1.4e-3, 7), false),
        (gain(0.01, 1.3e-3, 7), true),
        (gain(0.0115, 1.9e-3, 7), false),
        (gain(0.0125, 1.9e-3, 7), true),
        (gain(0.01, 1.9e-3, 8), true),
        (gain(0.01, 2.1e-3, 8), false),
    ] {
        assert_eq!(new.replaces(Some(&stored)), replaces, "{new:?}");
    }
    for (share, sigma, is_plausible) in [
        (0.05, 2e-3, true),
        (-0.05, 1e-4, true),
        (0.051, 1e-3, false),
        (0.01, 0.0, false),
        (0.01, 2.1e-3, false),
    ] {
        assert_eq!(gain(share, sigma, 0).is_plausible(), is_plausible, "{share}, {sigma}");
    }
}

#[test]
fn false_courses_teach_nothing_and_are_counted() {
    let bad: [(&str, &Course<'_>); 5] = [
        ("stands", &|_, _| Some(1.0)),
        ("is 18 s old", &|_, headings| ago(headings, 18.0)),
        ("jumps by pi", &|second, headings| Some(headings.last()? + if second % 40 < 20 { PI } else { 0.0 })),
        ("is another vehicle's", &|second, _| Some(0.3 * (second as f64 / 7.0).sin() + 0.02 * second as f64)),
        ("is noise", &|second, _| Some((second * second) as f64)),
    ];
    let known = Drive { stands: 30, creeps: 0.0, turn: &road, course: &|_, _| None };
    let (without, ..) = drive(300, &known);
    for (name, course) in bad {
        let (pipeline, ..) = drive(300, &Drive { course, ..known });
        let moved = (pipeline.bias().rad_per_sec() - without.bias().rad_per_sec()).to_degrees() * 60.0;
        println!("{name}: bias moved by {moved:+.3} deg/min, {:?}", pipeline.course_counters());
        assert_eq!(pipeline.status(None).gain, Knowledge::Refused, "{name}");
        assert!(pipeline.course_counters().refused > 20, "{name}: {:?}", pipeline.course_counters());
        assert!(moved.abs() < 0.01 && pipeline.gain().0 == 0.0, "{name}: bias moved by {moved} deg/min");
    }
}

/// The median and the 90 % of the errors of a minute without courses after three with them, over 20 parts, deg.
fn after_courses(
    turn: &dyn Fn(f64) -> f64,
    course: &Course<'_>,
    speed: fn(f64) -> f64,
    check: impl Fn(&Pipeline),
) -> [f64; 2] {
    let part = |seed: u64| {
        let mut noise = Noise::new(100 + seed);
        let part = Part { gain: 0.005 * noise.normal(), noise, walk: 2e-6, speed, is_lossy: false };
        let drive = Drive { stands: 10, creeps: 0.0, turn, course };
        let (pipeline, outputs, headings) = drive_with(PipelineConfig::DEFAULT, part, 240, &drive);
        check(&pipeline);
        error(&outputs, &headings, 59).abs().to_degrees()
    };
    let mut errors: Vec<f64> = (0..20).map(part).collect();
    errors.sort_by(f64::total_cmp);
    [errors[10], errors[18]]
}

#[test]
fn a_slow_vehicle_that_reverses_learns_where_the_accuracy_is_stated() {
    let course = |second, headings: &[f64]| ago(headings, 0.0).filter(|_| second < 180);
    let due = after_courses(&road, &|_, _| None, fast, |_| {});
    let to_and_fro = |second: f64| if second % 40.0 < 20.0 { 0.7 } else { -0.7 };
    // The heading of two antennas stays as it is while the vehicle goes backwards.
    let antennas = |second: usize, headings: &[f64]| {
        course(second, headings).map(|course| course + if second % 40 < 20 { 0.0 } else { PI })
    };
    type Case<'a> = (&'a str, fn(f64) -> f64, &'a Course<'a>);
    let cases: [Case<'_>; 3] = [
        ("forwards", |_| 0.85, &course),
        ("to and fro", to_and_fro, &course),
        ("to and fro, two antennas", to_and_fro, &antennas),
    ];
    for (name, speed, course) in cases {
        let own = after_courses(&road, course, speed, |pipeline| {
            let counters = pipeline.course_counters();
            assert!(counters.refused == 0 && counters.restarts == 0, "{name}: {counters:?}");
        });
        println!("{name}: {own:.2?} deg, {due:.2?} without courses");
        assert!(own[0] < due[0] + 0.1 && own[1] < 0.75 * due[1], "{name}: {own:?}, {due:?} without courses");
    }
    // Three times as inaccurate it is ignored.
    let inaccurate = |_| 0.28;
    let own =
        after_courses(&road, &course, inaccurate, |pipeline| assert_eq!(pipeline.course_counters().used, 0));
    assert_eq!(own, due);
}

#[test]
fn a_slow_vehicle_whose_receiver_states_no_accuracy_keeps_the_bias_of_its_rest() {
    let due = after_courses(&road, &|_, _| None, fast, |_| {});
    // A speed across of 0.3 m/s by reflections, which comes and goes.
    let reflected = |second: usize, headings: &[f64]| {
        Some(ago(headings, 0.3)? + 0.085 * (second as f64 / 13.0).sin()).filter(|_| second < 180)
    };
    let own = after_courses(
        &road,
        &reflected,
        |_| 3.5,
        |pipeline| {
            let gain = pipeline.status(None).gain;
            assert!(pipeline.course_counters().used > 100 && gain == Knowledge::Unknown, "{gain:?}");
        },
    );
    println!("{own:.2?} deg, {due:.2?} without courses");
    assert!(own[0] < due[0] + 0.1 && own[1] < due[1] + 0.1, "{own:?}, {due:?} without courses");
}

/// Yaw rate of streets, rad/s: a right angle each 20 s, to the left and to the right by turns.
fn streets(second: f64) -> f64 {
    let turns = if (second / 40.0).fract() < 0.5 { 0.1 * PI } else { -0.1 * PI };
    if (second / 20.0).fract() < 0.75 { 0.0 } else { turns }
}

/// Receivers that smooth, run ahead, scale or are on a trailer. A scaled course on streets teaches its scale as a gain.
#[test]
fn courses_that_show_turns_wrongly_leave_the_gain_within_two_sigma() {
    let smoothed = |_: usize, headings: &[f64]| {
        let last = headings.len().checked_sub(1)?;
        let weights = (0..500).map(|ago| (-0.01 * f64::from(ago)).exp());
        let sum: f64 = weights.clone().sum();
        Some(
            weights.zip(0..).map(|(weight, ago)| weight * headings[last.saturating_sub(ago)]).sum::<f64>()
                / sum,
        )
    };
    let ahead = |second: usize, headings: &[f64]| {
        let turn: f64 = (0..100).map(|tick| 0.01 * road(second as f64 + 0.01 * f64::from(tick))).sum();
        Some(headings.last()? + turn)
    };
    let scaled = |_: usize, headings: &[f64]| Some(1.02 * ago(headings, 0.3)?);
    let trailer = |_: usize, headings: &[f64]| {
        let mut trailer = *headings.first()?;
        headings.iter().for_each(|heading| trailer += 0.01 * (fast(0.0) / 8.0) * (heading - trailer).sin());
        Some(trailer)
    };
    type Case<'a> = (&'a str, &'a dyn Fn(f64) -> f64, &'a Course<'a>);
    let cases: [Case<'_>; 6] = [
        ("winding, smoothed", &road, &smoothed),
        ("winding, ahead", &road, &ahead),
        ("winding, scaled", &road, &scaled),
        ("winding, trailer", &road, &trailer),
        ("streets, smoothed", &streets, &smoothed),
        ("streets, trailer", &streets, &trailer),
    ];
    for (name, turn, course) in cases {
        for seed in 0..4 {
            let part =
                Part { noise: Noise::new(40 + seed), gain: 0.0, walk: 2e-6, speed: fast, is_lossy: false };
            let drive = Drive { stands: 10, creeps: 0.0, turn, course };
            let (pipeline, ..) = drive_with(PipelineConfig::DEFAULT, part, 900, &drive);
            let (gain, sigma) = pipeline.gain();
            println!("{name}: gain {gain:+.5}, sigma {sigma:?}");
            // On streets it is learnt: 0.005 is its sigma before.
            let most = if name.starts_with("streets") { 0.002 } else { 0.005 };
            let is_right = |sigma| gain.abs() < 2.0 * sigma && sigma < most;
            assert!(sigma.is_some_and(is_right), "{name}: {gain}, {sigma:?}");
        }
    }
}

/// The receiver is deceived, or the bias of the gyro has jumped: at first nobody can know.
#[test]
fn a_confirmed_bias_is_held_for_two_minutes_against_courses_that_drift_away() {
    let straight = |second: f64| 0.01 * (second / 40.0).sin();
    // By so much, rad/s, from 100 s on, for so long.
    let learnt = |drift: f64, lasts: f64, seconds| {
        let course = |second: usize, headings: &[f64]| {
            Some(ago(headings, 0.3)? + drift * (second as f64 - 100.0).clamp(0.0, lasts))
        };
        let part = Part { noise: Noise::new(7), gain: 0.0, walk: 0.0, speed: fast, is_lossy: false };
        let drive = Drive { stands: 10, creeps: 0.0, turn: &straight, course: &course };
        let (pipeline, outputs, _) = drive_with(PipelineConfig::DEFAULT, part, seconds, &drive);
        let (status, live) = (pipeline.status(None), outputs.last().expect("outputs").vehicle.live);
        let sigma = live.sigma.expect("a sigma").rad_per_sec();
        (pipeline.bias().rad_per_sec(), (status.bias, status.gain, live.quality), sigma)
    };
    let (before, ..) = learnt(0.0, 0.0, 100);
    let (fine, refused, unknown) = (Knowledge::Fine, Knowledge::Refused, Knowledge::Unknown);
    for (drift, lasts, seconds, moved, state, least) in [
        (0.2, 500.0, 140, 0.0..0.15, (fine, refused, Quality::Good), 2e-3),
        (0.2, 500.0, 230, 0.0..0.15, (fine, refused, Quality::Good), 2e-3),
        (0.2, 500.0, 250, 0.5..1.5, (Knowledge::Coarse, unknown, Quality::Degraded), 1e-3),
        (0.2, 500.0, 320, 0.9..1.1, (fine, unknown, Quality::Good), 2e-4),
        (0.2, 50.0, 240, 0.0..0.15, (fine, unknown, Quality::Good), 2e-4),
        // Such courses are soon refused, and the heading starts again and again.
        (0.6, 500.0, 180, -0.1..0.15, (fine, refused, Quality::Good), 2e-3),
        (0.6, 500.0, 400, 0.9..1.1, (fine, unknown, Quality::Good), 2e-4),
    ] {
        let drift = f64::to_radians(drift);
        let (bias, known, sigma) = learnt(drift, lasts, seconds);
        let share = (before - bias) / drift;
        println!(
            "{seconds} s, drift for {lasts} s: the bias has taken {share:.2} of it, {known:?}, {sigma:.5}"
        );
        assert!(
            moved.contains(&share) && known == state && (least..3.0 * least).contains(&sigma),
            "{lasts}, {seconds}"
        );
    }
}

/// Nothing has confirmed the bias of the standstill when courses begin to drift away from it.
#[test]
fn courses_that_contradict_the_bias_of_one_rest_degrade_the_rate() {
    let course =
        |second: usize, headings: &[f64]| Some(ago(headings, 0.3)? + 0.02 * (second as f64 - 15.0).max(0.0));
    let (pipeline, outputs, _) =
        drive(60, &Drive { stands: 10, creeps: 0.0, turn: &|_| 0.0, course: &course });
    let (status, live) = (pipeline.status(None), outputs.last().expect("outputs").vehicle.live);
    let counters = pipeline.course_counters();
    assert!(counters.restarts >= 2, "{counters:?}");
    assert_eq!((status.bias, live.quality), (Knowledge::Coarse, Quality::Degraded));
}

/// Courses against zero-rate updates alone.
#[test]
fn courses_never_make_the_heading_worse_than_zero_rate_updates() {
    type Road<'a> = (&'a str, &'a dyn Fn(f64) -> f64, &'a [(&'a str, &'a Course<'a>)]);
    fn straight(second: f64) -> f64 {
        0.01 * (second / 40.0).sin()
    }
    let after = |second: usize, off: f64| if second > 100 { off } else { 0.0 };
    let reflected = |second: usize, headings: &[f64]| {
        Some(ago(headings, 0.3)? + after(second, 0.3 * (1.0 - (2.1 * second as f64).cos())))
    };
    let winding: [(&str, &Course<'_>); 13] = [
        ("latency 0 s", &|_, headings| ago(headings, 0.0)),
        ("latency 1 s", &|_, headings| ago(headings, 1.0)),
        ("latency 2 s", &|_, headings| ago(headings, 2.0)),
        ("latency 0 to 2 s", &|second, headings| ago(headings, 1.0 + (second as f64 / 9.0).sin())),
        ("latency 0 to 2 s, another phase", &|second, headings| {
            ago(headings, 1.0 + (second as f64 / 9.0 + 1.2).sin())
        }),
        ("backwards", &|second, headings| Some(ago(headings, 0.3)? + after(second, PI))),
        ("jumps by 90 deg", &|second, headings| Some(ago(headings, 0.3)? + after(second, 0.5 * PI))),
        ("spoofed, 3 deg/s", &|second, headings| {
            Some(ago(headings, 0.3)? + after(second, 0.05 * (second as f64 - 100.0)))
        }),
        ("spoofed, 0.5 deg/s", &|second, headings| {
            Some(ago(headings, 0.3)? + after(second, 0.0087 * (second as f64 - 100.0)))
        }),
        // Reflections off houses on one side: most courses are refused, the others are off to the same side.
        ("reflections", &reflected),
        ("reflections, few", &|second, headings| reflected(second, headings).filter(|_| second % 11 < 2)),
        ("one in seven off by 30 deg", &|second, headings| {
            Some(ago(headings, 0.3)? + if second % 7 == 0 { after(second, 0.5) } else { 0.0 })
        }),
        ("outages", &|second, headings| ago(headings, 0.5).filter(|_| second % 60 < 30)),
    ];
    let steady: [(&str, &Course<'_>); 2] = [
        ("true", &|_, headings| ago(headings, 0.5)),
        ("slip grows", &|second, headings| Some(headings.last()? + 2e-4 * second as f64)),
    ];
    let roads: [Road<'_>; 3] =
        [("winding", &road, &winding), ("circle", &|_| 0.3, &steady), ("straight", &straight, &steady[..1])];
    for (name, turn, courses) in roads {
        // A slip that grows as the driver goes faster looks like a gain.
        let errors = |course: &Course<'_>| {
            after_courses(turn, course, fast, |pipeline| {
                assert!(name == "winding" || pipeline.gain().0 == 0.0)
            })
        };
        let due = errors(&|_, _| None);
        for (course_name, course) in courses {
            let own = errors(&|second, headings| course(second, headings).filter(|_| second < 180));
            println!("{name}, {course_name}: {own:.2?} deg, {due:.2?} without courses");
            for (own, due) in own.into_iter().zip(due) {
                assert!(own <= (1.05 * due).max(due + 0.1), "{name}, {course_name}: {own}, {due} without");
            }
        }
    }
}

#[test]
fn courses_hardly_move_the_bias_of_an_optical_gyro_that_its_data_sheet_describes() {
    let known = Drive { stands: 30, creeps: 0.0, turn: &road, course: &|_, _| None };
    let bias = |config, course| {
        let part = Part { noise: Noise::new(7), gain: 0.0, walk: 0.0, speed: fast, is_lossy: false };
        drive_with(config, part, 300, &Drive { course, ..known }).0.bias().rad_per_sec()
    };
    let moved = |config| (bias(config, &true_course) - bias(config, known.course)).abs();
    let sheet = PipelineConfig::DEFAULT.with_gyro(&FogErrors::DSP1760);
    assert!(moved(sheet) < 0.1 * moved(PipelineConfig::DEFAULT), "{} rad/s", moved(sheet));
}

#[test]
fn a_wrong_start_heals_by_courses() {
    // Initialised on a ferry that turns.
    let creeps = AngularRate::from_deg_per_sec(0.5).rad_per_sec();
    let (_, outputs, headings) = drive(420, &Drive { stands: 5, creeps, turn: &road, course: &true_course });
    let held = error(&outputs, &headings, 60).to_degrees();
    println!("{held:.2} deg in the last minute");
    assert!(held.abs() < 1.0);
}
