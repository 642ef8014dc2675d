//! The vehicle's forward direction shows in the specific force when the wheels change their speed.
//!
//! A second's mean force is gravity, plus the change of speed along the forward axis, plus speed times yaw rate along
//! the left one. Gravity hardly changes in a second, so differences of neighbouring seconds depend on the two axes
//! alone, and least squares finds them. Slopes, bumps and slip give the sigma.

use super::{Rotation, metre_per_sec2};
use crate::sample::{ImuSample, RATE_HZ, WheelSample};
use crate::sqrt::sqrt;
use crate::units::{AngularRate, SpecificForce, WheelSpeed};
use crate::vector::{dot, norm};

/// Slower vehicles are ignored, m/s: they may be reversing, which most wheel sensors do not show.
const SLOWEST: f32 = 3.0;
/// The weight of older seconds decays by this factor each second: a memory of about ten minutes.
const MEMORY: f32 = 1.0 - 1.0 / 600.0;
/// The spread of the estimates of five recorded drives (trials 02, 03, 04, 06 and 07) over the sigma that independent
/// errors would have: roads are uneven for longer than a second.
const SPREAD: f32 = 1.5;
/// The direction is not determined from fewer seconds.
const FEWEST: f32 = 20.0;
/// Plausible ratios of both accelerations: others come from slip or from another sensor.
const PLAUSIBLE: [f32; 2] = [0.5, 2.0];

#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Forward {
    pub direction: [f32; 3],
    /// Sigma of its angle about the vertical, rad.
    pub sigma: f32,
}

impl Forward {
    /// Returns the angle from a mounting's x axis to the left, rad, by the force at `rest`, in the sensor's axes.
    pub fn yaw(&self, mounting: &Rotation, rest: [SpecificForce; 3]) -> f32 {
        let level = Rotation::levelling(mounting.force(rest)).map_or(Rotation::IDENTITY, |(level, _)| level);
        // A unit vector is within the range of the code.
        let code = self.direction.map(|axis| SpecificForce::from_metre_per_sec2(axis).unwrap_or_default());
        let [x, y, _] = mounting.then(&level).force(code);
        libm::atan2f(y.0 as f32, x.0 as f32)
    }

    /// Returns the angle to another direction, rad, and its sigma.
    pub fn angle_to(&self, other: &Self) -> [f32; 2] {
        let sine = cross(&self.direction, &other.direction);
        let angle = libm::atan2f(norm(&sine), dot(&self.direction, &other.direction));
        [angle, sqrt(self.sigma * self.sigma + other.sigma * other.sigma)]
    }

    pub fn is_plausible(&self) -> bool {
        libm::fabsf(dot(&self.direction, &self.direction) - 1.0) < 0.01 && self.sigma >= 0.0
    }
}

#[derive(Debug, Clone)]
pub struct ForwardEstimator {
    second: Second,
    /// Force and motion of the second before.
    before: Option<([f32; 3], [f32; 2])>,
    /// Sums over the differences: force turned by motion, squares of both, and their number.
    turned: [f32; 3],
    force: f32,
    motion: f32,
    count: f32,
}

#[derive(Debug, Clone, Copy)]
struct Second {
    samples: u32,
    begin: f32,
    force: [f32; 3],
    /// Speed times angular rate about each axis, m/s^2.
    turning: [f32; 3],
}

impl Second {
    const EMPTY: Self = Self { samples: 0, begin: 0.0, force: [0.0; 3], turning: [0.0; 3] };
}

impl ForwardEstimator {
    pub const START: Self =
        Self { second: Second::EMPTY, before: None, turned: [0.0; 3], force: 0.0, motion: 0.0, count: 0.0 };

    /// Adds a sample in the sensor's axes, the wheels, and the force at rest; returns true for a new estimate.
    pub fn add(
        &mut self,
        sample: Option<&ImuSample>,
        wheels: &WheelSample,
        rest: &[SpecificForce; 3],
    ) -> bool {
        let sample = sample.filter(|sample| sample.validity.is_good());
        let Some((sample, speed)) = sample.zip(mean_speed(wheels).filter(|speed| *speed > SLOWEST)) else {
            (self.second, self.before) = (Second::EMPTY, None);
            return false;
        };
        let is_full = self.second.samples == RATE_HZ;
        let has_learnt = is_full && self.end_second(speed, rest);
        if is_full || self.second.samples == 0 {
            self.second = Second { begin: speed, ..Second::EMPTY };
        }
        self.second.samples += 1;
        let rate = sample.angular_rate.map(|axis| axis.0 as f32 / AngularRate::PER_RAD_PER_SEC);
        for (sum, force) in self.second.force.iter_mut().zip(metre_per_sec2(&sample.specific_force)) {
            *sum += force;
        }
        for (sum, rate) in self.second.turning.iter_mut().zip(rate) {
            *sum += speed * rate;
        }
        has_learnt
    }

    fn end_second(&mut self, end: f32, rest: &[SpecificForce; 3]) -> bool {
        let Second { begin, force, turning, .. } = self.second;
        let rest = metre_per_sec2(rest);
        let up = scaled(&rest, 1.0 / norm(&rest).max(1.0));
        let mean = |sums: &[f32; 3]| scaled(sums, 1.0 / RATE_HZ as f32);
        let (force, motion) = (mean(&force), [end - begin, dot(&mean(&turning), &up)]);
        let Some((force_before, [ahead, left])) = self.before.replace((force, motion)) else { return false };
        let [ahead, left] = [motion[0] - ahead, motion[1] - left];
        let change = core::array::from_fn(|axis| force[axis] - force_before[axis]);
        let vertical = dot(&change, &up);
        let change = core::array::from_fn(|axis| change[axis] - vertical * up[axis]);
        // For a forward axis f the change is ahead f + left (up x f); its transpose gives ahead d - left (up x d).
        let across = cross(&up, &change);
        for (axis, sum) in self.turned.iter_mut().enumerate() {
            *sum = *sum * MEMORY + ahead * change[axis] - left * across[axis];
        }
        self.force = self.force * MEMORY + dot(&change, &change);
        self.motion = self.motion * MEMORY + ahead * ahead + left * left;
        self.count = self.count * MEMORY + 1.0;
        true
    }

    /// Returns the direction; `None` before enough of a drive, and where sensor and wheels do not match.
    pub fn forward(&self) -> Option<Forward> {
        let length = norm(&self.turned);
        let gain = length / self.motion;
        // A gain that is not a number is refused, too.
        if self.count < FEWEST || !(PLAUSIBLE[0]..=PLAUSIBLE[1]).contains(&gain) {
            return None;
        }
        let left = (self.force - length * gain).max(0.0) / (2.0 * self.count - 2.0);
        let sigma = SPREAD * sqrt(left / self.motion) / gain;
        Some(Forward { direction: scaled(&self.turned, 1.0 / length), sigma })
    }
}

fn mean_speed(wheels: &WheelSample) -> Option<f32> {
    let known = || wheels.speeds.iter().flatten();
    let sum: f32 = known().map(|speed| speed.0 as f32).sum();
    let codes = known().count() << WheelSpeed::FRACTION_BITS;
    (codes > 0).then(|| sum / codes as f32)
}

fn scaled(vector: &[f32; 3], by: f32) -> [f32; 3] {
    vector.map(|axis| axis * by)
}

fn cross(a: &[f32; 3], b: &[f32; 3]) -> [f32; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sample::{Standstill, Validity};
    use crate::units::Micros;

    const REST: [f32; 3] = [0.0, 0.0, 9.81];

    fn code(force: [f32; 3]) -> [SpecificForce; 3] {
        force.map(|axis| SpecificForce::from_metre_per_sec2(axis).unwrap())
    }

    /// Drives for `seconds` with sinusoidal speed and yaw rate. The sensor is turned by `yaw`, rad, to the left of
    /// the vehicle's axes, or lies on its side. `bump` is added to its second axis.
    fn drive(
        estimator: &mut ForwardEstimator,
        seconds: u32,
        (yaw, is_on_its_side): (f32, bool),
        bump: impl Fn(f32) -> f32,
    ) {
        let (sin, cos) = (libm::sinf(yaw), libm::cosf(yaw));
        let turn = |[x, y, z]: [f32; 3]| {
            let [x, y, z] = [cos * x + sin * y, cos * y - sin * x, z];
            if is_on_its_side { [x, z, -y] } else { [x, y, z] }
        };
        for tick in 0..seconds * RATE_HZ {
            let time = tick as f32 / RATE_HZ as f32;
            let (speed, rate) = (15.0 + 5.0 * libm::sinf(0.2 * time), 0.2 * libm::sinf(0.13 * time));
            let acceleration = libm::cosf(0.2 * time);
            let [x, y, z] = turn([acceleration, speed * rate, REST[2]]);
            let sample = ImuSample {
                time: Micros(u64::from(tick) * 10_000),
                angular_rate: turn([0.0, 0.0, rate]).map(|axis| AngularRate::from_rad_per_sec(axis).unwrap()),
                specific_force: code([x, y + bump(time), z]),
                temperature: None,
                validity: Validity::Good,
            };
            let speeds = [Some(WheelSpeed((speed * 65_536.0) as i32)); 4];
            let wheels = WheelSample { speeds, ..WheelSample::without_speeds(Standstill::Moving) };
            estimator.add(Some(&sample), &wheels, &code(turn(REST)));
        }
    }

    fn is_close(found: [f32; 3], expected: [f32; 3]) -> bool {
        found.iter().zip(expected).all(|(found, expected)| (found - expected).abs() < 2e-3)
    }

    #[test]
    fn the_direction_of_a_drive_without_noise_is_exact() {
        for yaw in [0.0, 0.1, 1.5, 3.1, -2.0f32] {
            let mut estimator = ForwardEstimator::START;
            drive(&mut estimator, 20, (yaw, false), |_| 0.0);
            assert_eq!(estimator.forward(), None, "too short");
            estimator = ForwardEstimator::START;
            drive(&mut estimator, 60, (yaw, false), |_| 0.0);
            let found = estimator.forward().unwrap();
            assert!(is_close(found.direction, [yaw.cos(), -yaw.sin(), 0.0]), "{yaw}: {found:?}");
            assert!(found.sigma < 2e-3, "{yaw}: {found:?}");
            let angle = found.yaw(&Rotation::IDENTITY, code(REST));
            assert!((angle + yaw).abs() < 2e-3, "{yaw}: {angle}");
            // The correct mounting leaves no angle.
            let mounting = Rotation::from_mounting(0.0, 0.0, yaw.to_degrees()).unwrap();
            assert!(found.yaw(&mounting, code(REST)).abs() < 2e-3, "{yaw}");
        }
    }

    #[test]
    fn a_sensor_on_its_side_shows_it_too() {
        let mut estimator = ForwardEstimator::START;
        drive(&mut estimator, 80, (0.5, true), |_| 0.0);
        let found = estimator.forward().unwrap();
        assert!(is_close(found.direction, [libm::cosf(0.5), 0.0, libm::sinf(0.5)]), "{found:?}");
        assert!((found.yaw(&Rotation::IDENTITY, code([0.0, 9.81, 0.0])) + 0.5).abs() < 2e-3);
    }

    #[test]
    fn the_sigma_covers_an_uneven_road() {
        let mut estimator = ForwardEstimator::START;
        drive(&mut estimator, 200, (0.0, false), |time| 0.7 * libm::sinf(1.7 * time));
        let Forward { direction: [x, y, _], sigma } = estimator.forward().unwrap();
        assert!((0.05..0.3).contains(&sigma) && libm::atan2f(y, x).abs() < 3.0 * sigma, "{sigma} {y}");
    }

    #[test]
    fn wheels_without_speed_slow_ones_and_silence_show_nothing() {
        let mut estimator = ForwardEstimator::START;
        let wheels = WheelSample::without_speeds(Standstill::Moving);
        let sample = ImuSample {
            time: Micros(0),
            specific_force: code(REST),
            angular_rate: [AngularRate::ZERO; 3],
            temperature: None,
            validity: Validity::Good,
        };
        for _ in 0..10_000 {
            assert!(!estimator.add(Some(&sample), &wheels, &code(REST)));
            assert!(!estimator.add(None, &wheels, &code(REST)));
        }
        assert_eq!(estimator.forward(), None);
    }

    #[test]
    fn accelerations_that_do_not_belong_together_show_nothing() {
        // Slip or a sensor in a hand: the force changes by far more than the wheels say.
        let mut estimator = ForwardEstimator::START;
        drive(&mut estimator, 100, (0.0, false), |time| 60.0 * libm::sinf(0.13 * time));
        assert_eq!(estimator.forward(), None);
    }
}
