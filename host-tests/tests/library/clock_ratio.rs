//! A sensor's clock is held against the board's: an oscillator that is off turns by the right angle,
//! through jitter, stalls, jumps, restarts and silence.

use gyronet::align::clock_ratio::{ClockRatio, LIMIT_PPM, RatioEstimator};
use gyronet::sample::PERIOD_US;
use gyronet::units::{Angle, AngularRate, Micros, Yaw};
use gyronet_host_tests::noise::{Noise, cases};
use gyronet_host_tests::synthetic::rate;
use proptest::prelude::*;

/// The bar: 0.02 % of the angle, 0.018 deg in a quarter of a turn.
const BAR: f64 = 2e-4;
/// The points of a slope are all there.
const SETTLED_S: f64 = 40.0;
/// A sample takes at least so long to arrive.
const LINE_US: f64 = 1_700.0;

/// A sensor whose periods of 10 ms last longer by `off`, and a line that is late by up to `jitter_us`, seldom by ten times
/// as much.
struct Sensor {
    off: f64,
    jitter_us: f64,
    noise: Noise,
    /// True time, s; the sensor's, us.
    now: f64,
    stamp: u64,
    /// A sample arrives when the one before has.
    arrival: f64,
}

impl Sensor {
    fn new(off: f64, jitter_us: f64, seed: u64) -> Self {
        Self { off, jitter_us, noise: Noise::new(seed), now: 3.0, stamp: 77_000_000, arrival: 0.0 }
    }

    /// The next sample: its stamp and its arrival.
    fn sample(&mut self) -> (Micros, Micros) {
        self.now += (1.0 + self.off) * PERIOD_US as f64 * 1e-6;
        self.stamp += PERIOD_US;
        let seldom = if self.noise.int(0, 300) == 0 { 10.0 } else { 1.0 };
        let arrival = self.now * 1e6 + LINE_US + seldom * self.noise.int(0, self.jitter_us as i64) as f64;
        self.arrival = self.arrival.max(arrival);
        (Micros(self.stamp), Micros(self.arrival as u64))
    }

    /// Samples of so many seconds of true time.
    fn run(&mut self, seconds: f64, estimator: &mut RatioEstimator) {
        let end = self.now + seconds;
        while self.now < end {
            let (stamp, arrival) = self.sample();
            estimator.observe(stamp, arrival);
        }
    }

    /// Runs for so many seconds, in each of which the ratio is right.
    fn is_followed(&mut self, seconds: u32, estimator: &mut RatioEstimator, bar: f64) {
        for second in 0..seconds {
            self.run(1.0, estimator);
            let error = error(estimator, self.off);
            assert!(error < bar, "second {second}: {error}");
        }
    }
}

fn number(ratio: ClockRatio) -> f64 {
    f64::from(ratio.0) / f64::from(ClockRatio::ONE.0)
}

fn error(estimator: &RatioEstimator, off: f64) -> f64 {
    (number(estimator.ratio) / (1.0 + off) - 1.0).abs()
}

#[test]
fn an_oscillator_that_is_off_turns_by_the_right_angle() {
    println!("off, ppm; jitter, ms; error of the angle of five minutes, ppm; largest of a ratio, ppm");
    for off in [-0.035, -0.01, 0.001, 0.01, 0.02, 0.035] {
        for jitter_us in [0.0, 1_000.0, 5_000.0] {
            for seed in 1..=20 {
                let (mut sensor, mut estimator) = (Sensor::new(off, jitter_us, seed), RatioEstimator::START);
                sensor.run(9.5, &mut estimator);
                assert_eq!(estimator.ratio, ClockRatio::ONE, "for ten seconds");
                sensor.run(10.0, &mut estimator);
                // 3 ms of 8 s, once it is known at all.
                let early = error(&estimator, off);
                assert!(off < 0.01 || early < 4e-4, "{off} {jitter_us} {seed}: {early}");
                sensor.run(SETTLED_S - 19.5, &mut estimator);
                let (begin, turning) = (sensor.now, rate(0.5));
                let (mut yaw, mut worst) = (Yaw::default(), 0.0f64);
                while sensor.now < begin + 300.0 {
                    yaw.0 += estimator.ratio.turned(turning);
                    worst = worst.max(error(&estimator, off));
                    let (stamp, arrival) = sensor.sample();
                    estimator.observe(stamp, arrival);
                }
                let wrong = (yaw.rad() / ((sensor.now - begin) * turning.rad_per_sec()) - 1.0).abs();
                if seed == 1 {
                    let [off, wrong, worst] = [off, wrong, worst].map(|share| share * 1e6);
                    println!("{off:.0} {:.0} {wrong:.1} {worst:.1}", jitter_us / 1e3);
                }
                assert!(wrong <= BAR && worst <= BAR, "{off} {jitter_us} {seed}: {wrong} {worst}");
                assert!(!estimator.fault);
            }
        }
    }
}

#[test]
fn two_crystals_change_no_bit() {
    for off in [-60e-6, 0.0, 60e-6] {
        for jitter_us in [0.0, 1_000.0] {
            let (mut sensor, mut estimator) = (Sensor::new(off, jitter_us, 5), RatioEstimator::START);
            for _ in 0..600 {
                sensor.run(1.0, &mut estimator);
                assert_eq!(estimator.ratio, ClockRatio::ONE, "{off} {jitter_us}");
            }
        }
    }
    for code in [i32::MIN, -1, 0, 1, 12_345, i32::MAX] {
        assert_eq!(ClockRatio::ONE.turned(AngularRate(code)), i64::from(code));
    }
}

#[test]
fn a_ratio_multiplies_to_the_nearest_code() {
    let one_percent = ClockRatio((1.01 * f64::from(ClockRatio::ONE.0)) as u32);
    for (code, turned) in [(100, 101), (-100, -101), (60, 61), (40, 40), (1_000_000, 1_010_000)] {
        assert_eq!(one_percent.turned(AngularRate(code)), turned, "{code}");
    }
    assert_eq!(ClockRatio(u32::MAX).turned(AngularRate(i32::MIN)), -8_589_934_590);
}

/// The increments of a fibre-optic gyro whose clock is off are multiplied so, to within a code.
#[test]
fn a_ratio_multiplies_an_angle_of_any_size() {
    for share in [0.96, 0.999, 1.0, 1.001, 1.04] {
        let ratio = ClockRatio((share * f64::from(ClockRatio::ONE.0)) as u32);
        for code in [0, 1, -1, 65_535, -65_537, 123_456_789_012, -123_456_789_012, 1 << 45, -(1 << 45)] {
            let exact = i128::from(code) * i128::from(ratio.0);
            let off = i128::from(ratio.angle(Angle(code)).0) * i128::from(ClockRatio::ONE.0) - exact;
            assert!(off.abs() <= i128::from(ClockRatio::ONE.0), "{code} by {share}: off by {off}");
        }
    }
}

/// 6.67 %: time stamps that were taken for microseconds and are none.
#[test]
fn a_clock_beyond_the_limit_is_a_fault_and_changes_nothing() {
    for off in [-0.0625, -0.041, 0.041, 1.0 / 15.0] {
        let (mut sensor, mut estimator) = (Sensor::new(off, 1_000.0, 2), RatioEstimator::START);
        sensor.run(SETTLED_S, &mut estimator);
        assert!(estimator.fault, "{off}");
        assert_eq!(estimator.ratio, ClockRatio::ONE);
        // It is over with its cause.
        sensor.off = 0.01;
        sensor.run(2.0 * SETTLED_S, &mut estimator);
        assert!(!estimator.fault, "{off}");
        assert!(error(&estimator, 0.01) < BAR, "{off}");
    }
}

/// A counter of 16 bits that has turned once more than was seen; an offset that is new after a stall of
/// the line.
#[test]
fn a_step_of_either_clock_is_no_drift() {
    for step in [7_000, 20_000, 69_905, 900_000_u64] {
        for seed in 1..=10 {
            let (mut sensor, mut estimator) = (Sensor::new(-0.01, 1_000.0, seed), RatioEstimator::START);
            sensor.run(SETTLED_S + seed as f64, &mut estimator);
            sensor.stamp += step;
            sensor.is_followed(100, &mut estimator, 2.5e-4);
            sensor.now += step as f64 * 1e-6;
            sensor.is_followed(100, &mut estimator, 2.5e-4);
            assert!(!estimator.fault);
        }
    }
}

#[test]
fn a_restart_a_silence_and_a_stall_keep_the_ratio() {
    let (mut sensor, mut estimator) = (Sensor::new(0.012, 1_000.0, 4), RatioEstimator::START);
    sensor.run(SETTLED_S, &mut estimator);
    for stamp in [0, 500_000_000] {
        sensor.stamp = stamp;
        sensor.now += 3.0;
        sensor.is_followed(60, &mut estimator, BAR);
        // The sensor's clock goes on in the silence.
        sensor.now += 10.0 * 1.012;
        sensor.stamp += 10_000_000;
        sensor.is_followed(60, &mut estimator, BAR);
    }
    // The board is busy for 1.5 s; the samples have waited in the part, or in the line, and come at once.
    for _ in 0..20 {
        sensor.arrival = (sensor.now + 1.5) * 1e6;
        sensor.is_followed(10, &mut estimator, BAR);
    }
    assert!(!estimator.fault);
}

#[test]
fn an_oscillator_that_warms_up_is_followed() {
    let (mut sensor, mut estimator) = (Sensor::new(0.01, 1_000.0, 6), RatioEstimator::START);
    sensor.run(SETTLED_S, &mut estimator);
    for second in 0..600 {
        // 0.2 % in ten minutes.
        sensor.off = 0.01 + 0.002 * f64::from(second) / 600.0;
        sensor.run(1.0, &mut estimator);
        assert!(error(&estimator, sensor.off) < BAR, "{second}");
    }
}

proptest! {
    #![proptest_config(cases(256))]

    /// Any times at all: no panic, and no ratio beyond the limit.
    #[test]
    fn any_times_are_survived(
        steps in prop::collection::vec((0..3_000_000u64, 0..3_000_000u64, any::<u8>()), 1..300),
        begin in (any::<u64>(), any::<u64>()),
    ) {
        let mut estimator = RatioEstimator::START;
        let (mut sensor, mut board) = begin;
        for (stamp, arrival, kind) in steps {
            (sensor, board) = match kind {
                0 => (stamp, board.wrapping_add(arrival)),
                1 => (sensor.wrapping_sub(stamp), board.wrapping_sub(arrival)),
                2..100 => (sensor.wrapping_add(10_000), board.wrapping_add(arrival / 300)),
                _ => (sensor.wrapping_add(stamp), board.wrapping_add(arrival)),
            };
            estimator.observe(Micros(sensor), Micros(board));
            prop_assert!(estimator.ratio.departure_ppm() <= LIMIT_PPM);
        }
    }
}
