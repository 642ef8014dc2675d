//! The vertical in the sensor's axes, by gravity at standstills and by the axis of turns.
//!
//! At rest the specific force points up, but a street slopes. In a turn the angular rate points up, and the slope adds
//! only its change. So each is off by a street's slope, and their mean is the vertical on a level street.
//!
//! A single tilt may be the street's or the sensor's: mounted as configured, or tilted by an unknown angle. Slopes are
//! normal with the same sigma in both, so the ratio of their probabilities has a closed form. The first explanation
//! has the better odds at first: only a tilt steeper than streets, or one that turns confirm, is taken off.
//!
//! The vertical of earlier drives is a claim, which a standstill drops that differs by more than a street can slope.
//! Until a turn or another standstill decides, the angle between them is part of the variance. So is the scatter of
//! the standstills where it exceeds that of streets. A standstill and the turns after it may all be on one ramp: until
//! a second one has shown the tilt, its square times that probability ([`RAMP`]) is part of the variance.

use super::{Rotation, metre_per_sec2};
use crate::health::slow::Knowledge;
use crate::sample::RATE_HZ;
use crate::sqrt::sqrt;
use crate::units::{AngularRate, SpecificForce};
use crate::vector::{dot, norm};

/// Sigma of a street's slope, rad: 3.5 deg, that of the standstills of the five training drives.
const SLOPE: f32 = 0.061;
/// Sigma of the tilt of a sensor that is not mounted as configured, rad: 8 deg.
const TILT: f32 = 0.14;
/// Logarithm of the odds of the configured mounting, 2.3 to 1: more costs tilts of 7 deg 5 %, less believes slopes.
const CONFIGURED: f32 = 0.84;
/// Logarithm of the odds at which a tilt is no longer taken off.
const AGAIN: f32 = 1.0;
/// Least sigma of a turn's axis, rad: 2.5 deg. The body leans outwards, and a ramp is as steep all the way up.
const LEAN: f32 = 0.0436;
/// Probability that a standstill and all turns after it are on one ramp, as steep as the tilt that they show.
const RAMP: f32 = 0.1;
/// Sigmas of slope and known vertical, together, beyond which no street explains a standstill.
const GATE: f32 = 4.0;
/// Information of a vertical that is known to 1 deg, rad^-2: that of a dozen standstills. Older ones fade beyond it.
const MOST: f32 = 3_283.0;
/// Least rate of a turn, rad/s, as the mean of a second, and its least angle, rad.
const TURNING: f32 = 0.05;
const LEAST_TURN: f32 = 0.5;
/// Samples after which a standstill counts, 3 s, and those of them after which the force is averaged: passive wheel sensors
/// show zero while the vehicle still brakes, and then it rocks.
const REST: u32 = 3 * RATE_HZ;
const SETTLED: u32 = REST / 2;
/// Samples after which the next standstill is on another street: 10 s.
const APART: u32 = 10 * RATE_HZ;
/// Sigma of a vertical that is known well, deg.
const FINE_DEG: f32 = 3.0;

/// The mean of directions that pointed up, each weighted with the inverse of its variance.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Vertical {
    sum: [f32; 3],
    information: f32,
}

impl Vertical {
    pub const UNKNOWN: Self = Self { sum: [0.0; 3], information: 0.0 };

    /// Adds a direction, a unit vector, with its variance in rad^2.
    fn with(&self, direction: &[f32; 3], variance: f32) -> Self {
        let weight = 1.0 / variance;
        let information = self.information + weight;
        let fade = if information > MOST { MOST / information } else { 1.0 };
        let sum = core::array::from_fn(|axis| fade * (self.sum[axis] + weight * direction[axis]));
        Self { sum, information: fade * information }
    }

    /// Returns the weighted sum of the deviations from `z`, and the variance of the tilt that explains them.
    fn deviation(&self) -> ([f32; 3], f32) {
        let [x, y, z] = self.sum;
        let sum = [x, y, z - self.information];
        let mean_square = dot(&sum, &sum) / (self.information * self.information).max(1.0);
        (sum, mean_square.max(TILT * TILT))
    }

    /// Returns the direction that points up if the sensor is tilted.
    pub fn up(&self) -> [f32; 3] {
        let (sum, tilt) = self.deviation();
        let [x, y, z] = sum.map(|axis| axis / (self.information + 1.0 / tilt));
        let up = [x, y, 1.0 + z];
        let length = norm(&up).max(f32::MIN_POSITIVE);
        up.map(|axis| axis / length)
    }

    /// Returns its sigma in each axis, rad: by the slope of streets, or the scatter of the directions if larger.
    pub fn sigma(&self) -> f32 {
        let (_, tilt) = self.deviation();
        // Each direction has two axes, and a weight of at most that of a standstill but for turns.
        let scatter = 2.0 * (self.information - norm(&self.sum));
        let expected = (2.0 * self.information * SLOPE * SLOPE).max(2.0);
        sqrt((scatter / expected).max(1.0) / (self.information + 1.0 / tilt))
    }

    /// Returns whether it differs notably from an earlier one: it is twice as certain, or 1 degree off.
    pub fn differs(&self, before: &Self) -> bool {
        self.information > 2.0 * before.information || dot(&self.up(), &before.up()) < 0.999_85
    }

    /// Returns the logarithm of the odds that the sensor is mounted as configured.
    fn odds(&self) -> f32 {
        let (sum, tilt) = self.deviation();
        let information = self.information;
        CONFIGURED + libm::logf(1.0 + information * tilt) - 0.5 * dot(&sum, &sum) / (information + 1.0 / tilt)
    }

    pub fn turned(&self, rotation: &Rotation) -> Self {
        Self { sum: rotation.vector(&self.sum), ..*self }
    }

    pub fn knowledge(&self) -> Knowledge {
        match self.information {
            0.0 => Knowledge::Unknown,
            _ if self.sigma().to_degrees() <= FINE_DEG => Knowledge::Fine,
            _ => Knowledge::Coarse,
        }
    }

    /// Returns roll and pitch of the mounting that turns this direction up, and their sigma, deg.
    pub fn tilt_deg(&self) -> [f32; 3] {
        let [x, y, z] = self.up();
        let pitch = libm::atan2f(-x, sqrt(y * y + z * z));
        [libm::atan2f(y, z), pitch, self.sigma()].map(f32::to_degrees)
    }

    pub fn is_plausible(&self) -> bool {
        (0.0..=1.01 * MOST).contains(&self.information)
            && dot(&self.sum, &self.sum) <= 1.01 * self.information * self.information
    }
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Judgement {
    /// The direction that points up; `None` where the sensor is mounted as configured.
    pub up: Option<[f32; 3]>,
    /// Variance of the direction of the axis in use, rad^2; 0 where nothing speaks against the configuration.
    pub variance: f32,
}

#[derive(Debug, Clone)]
pub struct VerticalEstimator {
    known: Vertical,
    is_tilted: bool,
    /// Square of the angle by which a standstill has dropped a vertical, rad^2; 0 once another or a turn decides.
    disputed: f32,
    /// No second standstill has shown the tilt.
    pub is_one_place: bool,
    /// Sums of the current standstill, its samples, and the samples since the one before.
    force: [i64; 3],
    stood: u32,
    away: u32,
    /// Sums of the current second, codes, and its samples.
    rate: [i64; 3],
    samples: u32,
    turn: [f32; 3],
}

impl VerticalEstimator {
    pub const fn new(known: Vertical) -> Self {
        Self {
            known,
            is_tilted: false,
            disputed: 0.0,
            is_one_place: known.information == 0.0,
            force: [0; 3],
            stood: 0,
            away: APART,
            rate: [0; 3],
            samples: 0,
            turn: [0.0; 3],
        }
    }

    /// Adds the mean specific force of a standstill that goes on.
    pub fn rest(&mut self, force: &[SpecificForce; 3]) {
        let force = metre_per_sec2(force);
        let length = norm(&force);
        if length > 1.0 {
            let up = force.map(|axis| axis / length);
            let before = self.known.up();
            let off: [f32; 3] = core::array::from_fn(|axis| up[axis] - before[axis]);
            let (square, sigma) = (dot(&off, &off), self.known.sigma());
            let is_moved =
                self.known.information > 0.0 && square > GATE * GATE * (SLOPE * SLOPE + sigma * sigma);
            self.disputed = if is_moved { square } else { 0.0 };
            self.is_one_place = is_moved || self.known.information == 0.0;
            self.known = if is_moved { Vertical::UNKNOWN } else { self.known }.with(&up, SLOPE * SLOPE);
        }
        (self.stood, self.away) = (REST, 0);
    }

    /// Adds a good sample: force, rate less the bias, whether it stands. Returns true when a second is over.
    pub fn add(&mut self, force: &[SpecificForce; 3], rate: &[AngularRate; 3], stands: bool) -> bool {
        if stands {
            self.stood = self.stood.saturating_add(1);
            if self.stood > SETTLED {
                self.force.iter_mut().zip(force).for_each(|(sum, axis)| *sum += i64::from(axis.0));
            }
            if self.stood == REST {
                if self.away >= APART {
                    let samples = i64::from(REST - SETTLED);
                    self.rest(&self.force.map(|sum| SpecificForce((sum / samples) as i32)));
                }
                self.away = 0;
            }
        } else {
            (self.stood, self.force) = (0, [0; 3]);
            self.away = self.away.saturating_add(1);
        }
        self.rate.iter_mut().zip(rate).for_each(|(sum, axis)| *sum += i64::from(axis.0));
        self.samples += 1;
        if self.samples < RATE_HZ {
            return false;
        }
        self.end_second();
        true
    }

    pub fn restart(&mut self) {
        (self.rate, self.samples, self.turn) = ([0; 3], 0, [0.0; 3]);
    }

    fn end_second(&mut self) {
        self.samples = 0;
        let per_code = 1.0 / (RATE_HZ as f32 * AngularRate::PER_RAD_PER_SEC);
        let angle = core::mem::take(&mut self.rate).map(|sum| sum as f32 * per_code);
        let up = self.known.up();
        let (yaw, before) = (dot(&angle, &up), dot(&self.turn, &up));
        let turns = libm::fabsf(yaw) > TURNING;
        if !turns || yaw * before < 0.0 {
            let now = self.now();
            self.disputed = if now == self.known { self.disputed } else { 0.0 };
            self.known = now;
            self.turn = [0.0; 3];
        }
        if turns {
            self.turn.iter_mut().zip(angle).for_each(|(sum, axis)| *sum += axis);
        }
    }

    pub fn now(&self) -> Vertical {
        let yaw = dot(&self.turn, &self.known.up());
        if libm::fabsf(yaw) < LEAST_TURN {
            return self.known;
        }
        let length = norm(&self.turn);
        let direction = self.turn.map(|axis| axis / libm::copysignf(length, yaw));
        self.known.with(&direction, (2.0 * SLOPE * SLOPE / (yaw * yaw)).max(LEAN * LEAN))
    }

    /// Returns the standstills and turns that are complete.
    pub fn known(&self) -> &Vertical {
        &self.known
    }

    pub fn judge(&mut self) -> Judgement {
        let now = self.now();
        let odds = now.odds();
        self.is_tilted = odds < if self.is_tilted { AGAIN } else { 0.0 };
        let up = now.up();
        let disputed = if now == self.known { self.disputed } else { 0.0 };
        let [x, y, _] = up;
        let square = x * x + y * y;
        if self.is_tilted {
            let is_ramp = self.is_one_place && square < GATE * GATE * SLOPE * SLOPE;
            let ramp = if is_ramp { RAMP * square } else { 0.0 };
            return Judgement { up: Some(up), variance: now.sigma() * now.sigma() + ramp + disputed };
        }
        Judgement { up: None, variance: square / (1.0 + libm::expf(odds)) + disputed }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const NONE: [f32; 2] = [0.0; 2];

    /// Readings of a sensor whose up is tilted by these angles about y and x, small: at rest, and turning.
    fn readings([x, y]: [f32; 2], yaw: f32) -> ([SpecificForce; 3], [AngularRate; 3]) {
        let up = [libm::sinf(x.to_radians()), libm::sinf(y.to_radians()), 1.0];
        let length = norm(&up);
        let up = up.map(|axis| axis / length);
        (
            up.map(|axis| SpecificForce::from_metre_per_sec2(9.81 * axis).unwrap()),
            up.map(|axis| AngularRate::from_rad_per_sec(yaw * axis).unwrap()),
        )
    }

    fn run(estimator: &mut VerticalEstimator, seconds: u32, tilt: [f32; 2], yaw: f32, stands: bool) {
        let (force, rate) = readings(tilt, yaw);
        (0..100 * seconds).for_each(|_| _ = estimator.add(&force, &rate, stands));
    }

    /// Stands on streets with these slopes, half a minute apart.
    fn stood(slopes: &[[f32; 2]]) -> VerticalEstimator {
        let mut estimator = VerticalEstimator::new(Vertical::UNKNOWN);
        for slope in slopes {
            run(&mut estimator, 20, *slope, 0.0, true);
            run(&mut estimator, 30, NONE, 0.0, false);
        }
        estimator
    }

    fn roll(estimator: &mut VerticalEstimator) -> Option<f32> {
        estimator.judge().up.map(|[_, y, _]| y.asin().to_degrees())
    }

    #[test]
    fn a_street_is_told_from_a_mounting_by_its_slope_and_by_turns() {
        assert_eq!(roll(&mut stood(&[[0.0, 7.0]])), None, "it may be a street");
        assert!(roll(&mut stood(&[[0.0, 12.0]])).is_some_and(|roll| roll > 10.0), "no street is as steep");
        for (turned, seconds) in [(0.4, 20), (-0.4, 20)] {
            // The turn confirms the tilt, before it ends.
            let mut estimator = stood(&[[0.0, 7.0]]);
            run(&mut estimator, seconds, [0.0, 7.0], turned, false);
            let found = roll(&mut estimator).expect("a tilt");
            assert!((found - 7.0).abs() < 0.5, "{found}");
            // Or shows that it was the street's.
            let mut estimator = stood(&[[0.0, 7.0]]);
            run(&mut estimator, seconds, NONE, turned, false);
            assert_eq!(roll(&mut estimator), None);
        }
        // A bend of 0.3 rad shows nothing.
        let mut estimator = stood(&[[0.0, 7.0]]);
        run(&mut estimator, 3, [0.0, 7.0], 0.1, false);
        run(&mut estimator, 3, NONE, 0.0, false);
        assert_eq!(roll(&mut estimator), None);
    }

    #[test]
    fn slopes_average_out_and_the_sigma_says_how_well() {
        let slopes = [[3.0, 10.0], [-3.0, 4.0], [0.0, 7.0], [2.0, 5.0], [-2.0, 9.0]];
        let mut estimator = stood(&slopes);
        let found = roll(&mut estimator).expect("five stops agree");
        assert!((found - 7.0).abs() < 0.4, "{found}");
        let known = *estimator.known();
        let [roll, pitch, sigma] = known.tilt_deg();
        assert!((roll - 7.0).abs() < 0.4 && pitch.abs() < 0.2, "{roll} {pitch}");
        assert!((1.4..1.6).contains(&sigma), "3.5 deg over the root of five: {sigma}");
        assert_eq!(known.knowledge(), Knowledge::Fine);
        assert_eq!(stood(&slopes[..1]).known().knowledge(), Knowledge::Coarse);
        assert_eq!(Vertical::UNKNOWN.knowledge(), Knowledge::Unknown);
        // Many more do not make it certain, so that another mounting is found again.
        let mut estimator = stood(&[[0.0, 7.0]; 100]);
        let before = estimator.known().sigma();
        assert!((0.9..1.1).contains(&before.to_degrees()) && estimator.known().is_plausible(), "{before}");
        for _ in 0..40 {
            run(&mut estimator, 20, [0.0, -7.0], 0.0, true);
            run(&mut estimator, 20, NONE, 0.0, false);
        }
        assert!(estimator.known().up()[1].asin().to_degrees() < -5.0);
    }

    #[test]
    fn a_vehicle_that_brakes_while_its_wheels_show_zero_is_not_tilted() {
        let mut estimator = VerticalEstimator::new(Vertical::UNKNOWN);
        run(&mut estimator, 1, [8.0, 0.0], 0.0, true);
        run(&mut estimator, 3, NONE, 0.0, true);
        let [x, y, _] = estimator.known().up();
        assert!(estimator.known().information > 0.0 && x.abs().max(y.abs()) < 1e-4, "{x} {y}");
    }

    #[test]
    fn one_stop_counts_once_and_a_gap_ends_a_turn() {
        let mut estimator = stood(&[[0.0, 7.0]]);
        let before = *estimator.known();
        // It creeps on in a queue.
        run(&mut estimator, 4, [0.0, 7.0], 0.0, true);
        let queued = *estimator.known();
        for _ in 0..5 {
            run(&mut estimator, 5, NONE, 0.0, false);
            run(&mut estimator, 10, [0.0, 7.0], 0.0, true);
        }
        assert!(queued != before && *estimator.known() == queued);
        for _ in 0..5 {
            run(&mut estimator, 2, [0.0, 7.0], 0.2, false);
            estimator.restart();
        }
        run(&mut estimator, 2, NONE, 0.0, false);
        assert_eq!(*estimator.known(), queued);
    }

    #[test]
    fn what_was_known_has_the_same_vertical_in_other_axes() {
        let known = *stood(&[[5.0, -9.0], [4.0, -8.0]]).known();
        let mounting = Rotation::from_mounting(90.0, 0.0, 30.0).unwrap();
        let there = known.turned(&mounting.inverse()).turned(&mounting);
        assert!(known.up().iter().zip(there.up()).all(|(a, b)| (a - b).abs() < 1e-5));
        assert!(!there.differs(&known) && known.differs(&Vertical::UNKNOWN));
    }

    #[test]
    fn a_rest_that_no_street_explains_drops_what_was_known_until_a_turn_decides() {
        let drive = |moved: [f32; 2], turns: [f32; 2]| {
            let mut estimator = VerticalEstimator::new(*stood(&[NONE; 4]).known());
            let before = estimator.known().sigma();
            run(&mut estimator, 4, moved, 0.0, true);
            let at_rest = estimator.judge();
            run(&mut estimator, 4, turns, 0.4, false);
            (before, at_rest, estimator.judge())
        };
        let (before, at_rest, turned) = drive([0.0, 20.0], [0.0, 20.0]);
        let up = at_rest.up.expect("no street is as steep")[1].asin().to_degrees();
        assert!(
            up > 15.0 && at_rest.variance > 0.1,
            "{up} {at_rest:?}: it may be a ramp, and the sensor where it was"
        );
        assert!(turned.variance < 1.1 * SLOPE * SLOPE, "the turn decides: {turned:?}");
        // A street is one more.
        let (_, street, _) = drive([0.0, 8.0], NONE);
        assert!(street.up.is_none() && street.variance < before * before, "{street:?}");
    }

    #[test]
    fn a_tilt_that_one_place_has_shown_may_be_its_ramp() {
        let mut estimator = stood(&[[0.0, 12.0]]);
        run(&mut estimator, 4, [0.0, 12.0], 0.4, false);
        let ramp = estimator.judge();
        run(&mut estimator, 30, NONE, 0.0, false);
        run(&mut estimator, 4, [0.0, 12.0], 0.0, true);
        let known = estimator.judge();
        assert!(ramp.up.is_some() && ramp.variance > known.variance + 0.09 * 0.043, "{ramp:?} {known:?}");
    }

    #[test]
    fn directions_that_scatter_are_known_worse() {
        let calm = stood(&[[0.0, 3.0], [0.0, -3.0], [3.0, 0.0], [-3.0, 0.0]]).known().sigma();
        let scattered = stood(&[[0.0, 11.0], [0.0, -11.0], [11.0, 0.0], [-11.0, 0.0]]).known().sigma();
        assert!(scattered > 1.8 * calm, "{scattered} {calm}");
    }
}
