//! Sensors of any rate through the coprocessor: the yaw is right, or the rate is named.

use gyronet::align::AlignError;
use gyronet::coprocessor::{InputError, Observation};
use gyronet::health::{Faults, Quality, Status};
use gyronet::model::Estimate;
use gyronet::sample::{ImuSample, NO_STAMP};
use gyronet::units::{AngularRate, Micros, Yaw};
use gyronet::{Config, Coprocessor};
use gyronet_host_tests::noise::Noise;
use gyronet_host_tests::sent::Sent;
use gyronet_host_tests::synthetic::{noisy, rate, turning};

/// A sensor and its stamps: samples a second of true time, the sensor's clock against true time, jitter of the stamps
/// in parts of the period, and of the arrival, microseconds.
#[derive(Clone, Copy, Debug)]
struct Sensor {
    hz: f64,
    clock: f64,
    jitter: f64,
    late_us: i64,
    stamped: bool,
}

const EXACT: Sensor = Sensor { hz: 100.0, clock: 1.0, jitter: 0.0, late_us: 0, stamped: true };
const RATE: f64 = 10.0;
const BEGINS_S: f64 = 12.0;
const LASTS_S: f64 = 10.0;

/// Rests, turns and rests again; returns the turn by the live yaw over the true one, the observations and errors, and how
/// often the clocks were off.
fn drive(sensor: Sensor) -> (f64, Vec<Observation>, Vec<InputError>, u32) {
    let config = Config { clock_is_exact: true, ..Config::DEFAULT };
    let (mut coprocessor, mut noise) = (Coprocessor::new(config), Noise::new(8));
    let (mut sent, mut errors, mut turned) = (Sent::default(), Vec::new(), 0.0);
    for k in 1..=((BEGINS_S + LASTS_S + 2.0) * sensor.hz) as u64 {
        let at = 3.0 + k as f64 / sensor.hz;
        let turns = (BEGINS_S..BEGINS_S + LASTS_S).contains(&(at - 3.0));
        turned += if turns { RATE / sensor.hz } else { 0.0 };
        let yaw_rate = if turns { RATE.to_radians() } else { 0.0 };
        let sample = noisy(turning(0, rate(yaw_rate + 0.002)), [2e-4, 2e-3], &mut noise);
        let jitter = sensor.jitter / sensor.hz * noise.int(-1_000, 1_000) as f64 * 1e-3;
        let stamp = Micros(((at + jitter) * sensor.clock * 1e6) as u64);
        let time = if sensor.stamped { stamp } else { NO_STAMP };
        let now = Micros((at * 1e6) as u64 + noise.int(0, sensor.late_us) as u64);
        if let Err(error) = coprocessor.imu(ImuSample { time, ..sample }, now, &mut sent) {
            errors.push(error);
        }
        if let Some(window) = coprocessor.window() {
            coprocessor.deliver(window.end, Estimate::NONE).expect("the window that is due");
        }
        let _ = coprocessor.poll(now, &mut sent);
    }
    let Yaw(yaw) = sent.seen.last().expect("a step").vehicle.live.yaw;
    let degrees = (yaw as f64 / f64::from(AngularRate::PER_RAD_PER_SEC) / 100.0).to_degrees();
    (degrees / turned, sent.seen, errors, coprocessor.monitor_counters().clock_off)
}

fn check(sensor: Sensor) {
    let (ratio, seen, errors, clock_off) = drive(sensor);
    assert!((ratio - 1.0).abs() < 1e-3, "{sensor:?}: {ratio:.5} of the turn");
    assert_eq!((&errors[..], clock_off), (&[][..], 0), "{sensor:?}");
    // From the end of static initialisation on there is a step every 10 ms of the sensor's clock, all corrected.
    let good = seen.iter().filter(|step| step.vehicle.live.status == Status::Ready).count() as f64;
    let steps = (BEGINS_S + LASTS_S + 2.0) * 100.0 * sensor.clock;
    assert!((seen.len() as f64 - steps).abs() < 20.0, "{sensor:?}: {} steps of {steps}", seen.len());
    let mut others: Vec<_> =
        seen.iter().map(|step| (step.vehicle.live.status, step.vehicle.live.faults)).collect();
    others.dedup();
    assert!(good > steps - 380.0, "{sensor:?}: {good} of {steps}, {others:?}");
}

#[test]
fn a_turn_is_right_to_a_thousandth_at_any_rate() {
    for hz in [50, 62, 83, 95, 99, 100, 101, 104, 105, 120, 125, 200, 250, 400, 500, 1000] {
        let hz = f64::from(hz);
        check(Sensor { hz, ..EXACT });
        check(Sensor { hz, jitter: 0.2, late_us: 500, ..EXACT });
        check(Sensor { hz, clock: 1.02, ..EXACT });
        check(Sensor { hz, clock: 0.97, ..EXACT });
    }
}

#[test]
fn without_stamps_the_arrival_counts() {
    for hz in [50.0, 95.0, 100.0, 104.0, 200.0, 400.0] {
        check(Sensor { hz, stamped: false, late_us: 1_000, ..EXACT });
    }
}

#[test]
fn a_rate_that_is_not_used_is_named_and_never_good() {
    for (hz, period_us) in [(10.0, 100_000), (40.0, 25_000), (1_250.0, 800), (2_000.0, 500)] {
        let (_, seen, errors, _) = drive(Sensor { hz, ..EXACT });
        assert_eq!(errors.last(), Some(&InputError::Imu(AlignError::Rate { period_us })));
        let last = seen.last().expect("message sets of a silent sensor").vehicle.live;
        assert_eq!((last.status, last.faults), (Status::Silent, Faults::GAP.with(Faults::IMPLAUSIBLE)));
        assert!(seen.iter().all(|step| step.vehicle.live.quality != Quality::Good));
    }
}

#[test]
fn clocks_that_contradict_each_other_are_not_good() {
    let (_, seen, _, clock_off) = drive(Sensor { clock: 1.06, ..EXACT });
    let is_off = |step: &Observation| step.vehicle.live.faults.contains(Faults::IMPLAUSIBLE);
    let first = seen.iter().position(is_off).expect("it is reported");
    assert!((900..1_100).contains(&first), "after ten seconds: {first}");
    for step in &seen[first..] {
        assert_eq!((step.vehicle.live.quality, is_off(step)), (Quality::Degraded, true), "while it lasts");
    }
    assert_eq!(clock_off, 1);
}
