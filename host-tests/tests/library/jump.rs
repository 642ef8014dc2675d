//! Readings that no vehicle can have: limits to the code, how long a reading is refused, and what goes
//! out meanwhile.

use gyronet::coprocessor::{Config, Coprocessor, Observation};
use gyronet::health::{Faults, Quality, Status};
use gyronet::monitor::SensorMonitor;
use gyronet::sample::{ImuSample, PERIOD_US, Validity};
use gyronet::units::Micros;
use gyronet_host_tests::noise::Noise;
use gyronet_host_tests::synthetic::{force, idling, noisy, rate, turning};
use gyronet_host_tests::{parallel, recordings};
use gyronet_tools::drive::recording::Reader;
use std::fs::File;

/// 1 and 0.3 rad/s in codes of 2^-27 rad/s: about x and y, and about z.
const TILT_LIMIT: i32 = 134_217_728;
const RATE_LIMIT: i32 = 40_265_318;
/// 30 m/s^2 in codes of 2^-20 m/s^2.
const FORCE_LIMIT: i32 = 31_457_280;

/// A vehicle that stands with its engine running, past static initialisation.
struct Drive {
    coprocessor: Coprocessor,
    noise: Noise,
    tick: u64,
    last: ImuSample,
}

impl Drive {
    fn new() -> Self {
        let (mut coprocessor, mut noise) = (Coprocessor::new(Config::DEFAULT), Noise::new(7));
        let mut last = idling(0, 0.001, &mut noise);
        for tick in 0..400 {
            last = idling(tick, 0.001, &mut noise);
            coprocessor.imu(last, Micros(last.time.0), &mut ()).expect("in time");
        }
        assert_eq!(coprocessor.monitor_counters().wrong, 0, "no reading of an idling engine is doubted");
        Self { coprocessor, noise, tick: 399, last }
    }

    /// The next sample: the last one that was believed, with one axis off by some codes.
    fn off_by(&mut self, axis: usize, codes: i32) -> Observation {
        let mut sample = self.last;
        match axis {
            0..3 => sample.angular_rate[axis].0 += codes,
            _ => sample.specific_force[axis - 3].0 += codes,
        }
        self.send(sample)
    }

    /// The next sample of the idling engine, with one axis off by some codes.
    fn shaken(&mut self, axis: usize, codes: i32) -> Observation {
        self.last = idling(self.tick + 1, 0.001, &mut self.noise);
        self.off_by(axis, codes)
    }

    fn send(&mut self, sample: ImuSample) -> Observation {
        self.tick += 1;
        let time = Micros(self.tick * PERIOD_US);
        self.coprocessor.imu(ImuSample { time, ..sample }, time, &mut ()).expect("in time").expect("a step")
    }
}

/// Nobody runs the network here, so every window is late.
fn without_late(faults: Faults) -> Faults {
    Faults(faults.0 & !Faults::LATE.0)
}

fn assert_refused(output: &Observation, why: &str) {
    assert_eq!(output.vehicle.live.status, Status::Clipped, "{why}");
    assert_eq!(output.vehicle.live.quality, Quality::Unusable, "{why}");
    assert_eq!(without_late(output.vehicle.live.faults), Faults::IMPLAUSIBLE, "{why}");
}

fn assert_believed(output: &Observation, why: &str) {
    assert_eq!(output.vehicle.live.status, Status::Degraded, "{why}");
    assert_eq!(output.vehicle.live.quality, Quality::Degraded, "{why}");
    assert_eq!(without_late(output.vehicle.live.faults), Faults::NONE, "{why}");
}

#[test]
fn a_step_of_the_limit_is_believed_and_a_thousandth_more_is_not() {
    for (axis, limit) in
        [TILT_LIMIT, TILT_LIMIT, RATE_LIMIT, FORCE_LIMIT, FORCE_LIMIT, FORCE_LIMIT].into_iter().enumerate()
    {
        let limit = limit - limit / 2_000;
        for sign in [1, -1] {
            let why = format!("axis {axis}, sign {sign}");
            let mut drive = Drive::new();
            assert_believed(&drive.off_by(axis, sign * limit), &why);
            assert_eq!(drive.coprocessor.monitor_counters().wrong, 0, "{why}");
            let mut drive = Drive::new();
            assert_refused(&drive.off_by(axis, sign * (limit + limit / 1_000)), &why);
            assert_eq!(drive.coprocessor.monitor_counters().wrong, 1, "{why}");
        }
    }
}

/// A bit that flips turns the yaw by less than a limit, which no vehicle's usual steps explain.
#[test]
fn a_step_that_is_plausible_and_unusual_is_part_of_sigma_for_a_second() {
    let mut drive = Drive::new();
    let sigma = |output: &Observation| output.vehicle.live.sigma.expect("a rate").rad_per_sec();
    let before = sigma(&drive.shaken(2, 0));
    let mut grown = |codes: i32| {
        let sigma = sigma(&drive.shaken(2, codes));
        (sigma * sigma - before * before).max(0.0).sqrt()
    };
    let found = grown(RATE_LIMIT / 10 * 9);
    assert!((2e-3..3.2e-3).contains(&found), "0.27 rad/s, and the engine, for 10 ms: {found}");
    assert!((0..100).all(|_| grown(0) > 0.9 * found));
    let after = (0..20).map(|_| grown(0)).last().expect("a sample");
    assert!(after < 2e-4, "{after}");
}

/// The monitor alone, with a yaw rate that shakes by 1e-3 rad/s.
struct Shown {
    monitor: SensorMonitor,
    noise: Noise,
    tick: u64,
    rate: f64,
    forward: f64,
}

impl Shown {
    /// After samples at this rate.
    fn new(rate: f64, samples: u32) -> Self {
        let (monitor, noise) = (SensorMonitor::new(false), Noise::new(7));
        let mut shown = Self { monitor, noise, tick: 0, rate, forward: 0.0 };
        (0..samples).for_each(|_| assert_eq!(shown.read(rate, 5e-4), Validity::Good));
        shown
    }

    /// Reaches a rate in this many samples, and keeps it for others; returns what the last one is worth.
    fn go(&mut self, to: f64, within: u32, kept: u32) -> Validity {
        let from = self.rate;
        let ramp = (1..=within).map(|step| from + (to - from) * f64::from(step) / f64::from(within));
        ramp.chain((0..kept).map(|_| to)).map(|rate| self.read(rate, 5e-4)).last().expect("samples")
    }

    fn read(&mut self, to: f64, shake: f64) -> Validity {
        (self.rate, self.tick) = (to, self.tick + 1);
        let shake = if self.tick.is_multiple_of(2) { shake } else { -shake };
        let mut sample = turning(self.tick, rate(to + shake));
        sample.specific_force[0] = force(self.forward);
        self.monitor.judge(&noisy(sample, [1e-5, 1e-4], &mut self.noise))
    }
}

/// Where it begins to shake by 0.29 rad/s, at the start or after a wrong reading.
#[test]
fn an_axis_gets_used_to_steps_but_not_in_the_second_after_a_wrong_reading() {
    for (glitch, jump, validity) in [(false, 2.0, Validity::Good), (true, 1.0, Validity::Implausible)] {
        let mut shown = Shown::new(0.0, if glitch { 200 } else { 0 });
        if glitch {
            assert_eq!(shown.read(1.0, 0.0), Validity::Implausible);
        }
        assert!((0..60).all(|_| shown.read(0.0, 0.145) == Validity::Good));
        assert_eq!(shown.read(jump, 0.0), validity, "{jump} rad/s");
    }
}

#[test]
fn a_step_is_suspect_beyond_six_times_the_usual_ones_for_a_second() {
    for (by, suspect) in [(0.08, 0.0), (0.13, 1.5e-3), (-0.17, 1.5e-3)] {
        let mut shown = Shown::new(0.0, 1);
        (0..200).for_each(|_| assert_eq!(shown.read(0.0, 0.01), Validity::Good));
        let mut after = |samples: u32| {
            (0..samples).for_each(|_| assert_eq!(shown.read(by, 0.01), Validity::Good));
            f64::from(shown.monitor.suspect())
        };
        // From -0.01 to 0.01 rad/s beside the new rate.
        let found = [after(1), after(111), after(2)];
        assert!(
            found.iter().zip([suspect, suspect, 0.0]).all(|(found, due)| (found - due).abs() < 1e-5),
            "{by}: {found:?}"
        );
    }
}

/// Rates (rad/s, samples to reach it, samples that keep it), and the shift that is reported then.
#[test]
fn a_jump_that_lasts_is_a_shift_until_jumps_have_taken_it_back() {
    type Moves<'a> = &'a [(f64, u32, u32, f32)];
    let scenes: [(&str, Moves<'_>); 4] = [
        ("it goes back, and the vehicle turns", &[(1.4, 0, 40, 1.0), (0.4, 0, 40, 0.0), (0.9, 50, 10, 0.0)]),
        (
            "by two jumps, back by one",
            &[(1.4, 0, 10, 1.0), (2.4, 0, 10, 2.0), (0.4, 0, 40, 0.0), (0.9, 50, 10, 0.0)],
        ),
        ("a turn that takes it back is none", &[(1.4, 0, 10, 1.0), (0.6, 80, 40, 1.0)]),
        (
            "back by steps that are no jumps",
            &[(0.9, 0, 10, 0.5), (0.65, 0, 5, 0.25), (0.4, 0, 40, 0.0), (0.9, 50, 10, 0.0)],
        ),
    ];
    for (name, moves) in scenes {
        let mut shown = Shown::new(0.4, 200);
        for (to, within, kept, shift) in moves {
            shown.go(*to, *within, *kept);
            let found = shown.monitor.shift();
            assert!((found - shift).abs() < 5e-3, "{name}: {found} at {to} rad/s");
        }
    }
    // What stands is right, and the rates of the samples before are sent later.
    let mut shown = Shown::new(0.4, 200);
    shown.go(1.4, 0, 10);
    shown.monitor.settle();
    shown.go(1.4, 0, 11);
    assert!(shown.monitor.shift() > 0.9);
    shown.go(1.4, 0, 1);
    assert_eq!(shown.monitor.shift(), 0.0);
    // Another axis that jumps shifts no yaw.
    let mut shown = Shown::new(0.4, 200);
    shown.forward = 100.0;
    shown.go(0.4, 0, 6);
    shown.go(0.9, 5, 3);
    assert_eq!(shown.monitor.shift(), 0.0);
}

#[test]
fn the_fourth_reading_in_a_row_is_believed_wherever_it_is() {
    for axis in [2, 5] {
        let limit = if axis < 3 { RATE_LIMIT } else { FORCE_LIMIT };
        let mut drive = Drive::new();
        for number in 1..=3 {
            assert_refused(&drive.off_by(axis, limit + 100_000 * number), &format!("reading {number}"));
        }
        let fourth = drive.off_by(axis, limit + 400_000);
        if axis == 2 {
            // The yaw rate may be off by the jump until it is back.
            let live = &fourth.vehicle.live;
            assert_eq!((live.status, without_late(live.faults)), (Status::Degraded, Faults::IMPLAUSIBLE));
            assert!(live.sigma.expect("a rate").0 >= limit, "{live:?}");
            continue;
        }
        assert_believed(&fourth, "reading 4");
        assert_eq!(drive.coprocessor.monitor_counters().wrong, 3);
        // Others are held against this one from there on, with the same limit: a fault is not what an axis is used to.
        assert_refused(&drive.off_by(axis, 0), "more than a limit away");
        assert_believed(&drive.off_by(axis, 500_000), "less than a limit away");
        assert_eq!(drive.coprocessor.monitor_counters().wrong, 4);
    }
}

#[test]
fn readings_are_held_against_the_last_good_one_and_one_near_it_ends_it() {
    let mut drive = Drive::new();
    assert_refused(&drive.off_by(2, 2 * RATE_LIMIT), "two limits off");
    // One limit from the refused one, three from the last that was believed.
    assert_refused(&drive.off_by(2, 3 * RATE_LIMIT), "three limits off");
    assert_believed(&drive.off_by(2, RATE_LIMIT - 100), "one limit off");
    let mut drive = Drive::new();
    for _ in 0..2 {
        assert_refused(&drive.off_by(2, 4 * RATE_LIMIT), "off");
        assert_refused(&drive.off_by(2, -4 * RATE_LIMIT), "off, the other way");
        assert_believed(&drive.off_by(2, 1_000), "near the one before");
    }
    assert_eq!(drive.coprocessor.monitor_counters().wrong, 4);
}

/// The last reading says nothing of the next one after 50 ms without a sample.
#[test]
fn across_a_gap_any_reading_is_believed() {
    for (missing, refused) in [(4, true), (5, false)] {
        let mut drive = Drive::new();
        drive.tick += missing;
        let output = drive.off_by(2, 2 * RATE_LIMIT);
        assert_eq!(output.vehicle.live.status == Status::Clipped, refused, "{missing} samples missing");
        assert_eq!(drive.coprocessor.monitor_counters().wrong, u32::from(refused));
        assert_eq!(output.vehicle.delayed.faults.with(Faults::GAP), output.vehicle.delayed.faults);
    }
}

/// A sensor that shakes ever harder, with steps of up to 3 rad/s and 90 m/s^2, is believed; an axis beside it keeps
/// its limit, and the shaken one has its own back when it is calm again.
#[test]
fn a_limit_follows_the_steps_of_its_axis() {
    for (axis, limit) in [(1, TILT_LIMIT), (2, RATE_LIMIT), (5, FORCE_LIMIT)] {
        let mut drive = Drive::new();
        for k in 0..200 {
            let size = 3 * (limit / 200 * k) / 2;
            drive.shaken(axis, if k % 2 == 0 { size } else { -size });
        }
        assert_eq!(drive.coprocessor.monitor_counters().wrong, 0, "axis {axis}");
        let (beside, far) = if axis == 2 { (5, 2 * FORCE_LIMIT) } else { (2, 2 * RATE_LIMIT) };
        let mut jump = |axis: usize, by: i32| {
            drive.shaken(axis, 0);
            drive.shaken(axis, by).vehicle.live.status == Status::Clipped
        };
        assert!(!jump(axis, 3 * limit), "axis {axis} shakes");
        assert!(jump(beside, far), "axis {beside} does not");
        for _ in 0..600 {
            drive.shaken(axis, 0);
        }
        assert_refused(&drive.shaken(axis, 2 * limit), "calm again");
    }
}

#[test]
fn nothing_that_was_recorded_is_implausible() {
    let Some(files) = recordings::with_speed() else { return };
    assert!(files.len() > 40, "{}", files.len());
    let doubted = parallel::map(&files, |path| {
        let (reader, mut monitor) =
            (Reader::new("", File::open(path).expect("it is there")), SensorMonitor::new(false));
        for row in reader.expect("a drive") {
            monitor.judge(&row.expect("a row").sample);
        }
        monitor.counters.wrong
    });
    let doubted: Vec<_> = files.iter().zip(doubted).filter(|(_, wrong)| *wrong > 0).collect();
    assert!(doubted.is_empty(), "{doubted:?}");
}
