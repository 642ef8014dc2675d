//! The board learns the sensor's bias by temperature at standstills that the wheels prove, and its mounting: up at
//! standstills, forward while the vehicle drives.
//!
//! Without wheels a long straight can look like a standstill; then only static calibrations add to the curve. What three
//! seconds at rest have shown is stored after the first time, the second, the fourth and so on, some ten times in a
//! start, and the forward direction each time its sigma has become a third less, some six times in all.

use crate::bias::{CurveFilter, Rest, StaticConfig, StaticInit};
use crate::mounting::{Forward, ForwardEstimator};
use crate::sample::{ImuSample, Standstill, WheelSample};
use crate::store::Learned;
use crate::units::CentiCelsius;

/// A forward direction with this sigma is known, rad: 10 degrees. A wrong mounting by that much costs nothing.
const KNOWN: f32 = 0.175;
/// The sensor was moved where the directions of two starts are this far apart, rad (25 degrees), and two sigmas more.
const MOVED: f32 = 0.436;
/// A direction replaces one with a sigma that is larger by more than this factor.
const BETTER: f32 = 0.7;

/// Learns from the rests and the drive of this start.
#[derive(Debug)]
pub struct Learner {
    rest: Option<StaticInit>,
    /// It exists from the first rest on.
    filter: Option<CurveFilter>,
    rests: u32,
    /// This standstill's specific force has been taken.
    has_stood: bool,
    forward: ForwardEstimator,
    /// The sensor is mounted otherwise than in earlier drives: nothing is learnt.
    is_moved: bool,
    /// What is learnt differs from what is stored.
    pub is_changed: bool,
}

impl Learner {
    /// Starts with nothing shown.
    #[must_use]
    pub const fn new() -> Self {
        let forward = ForwardEstimator::START;
        Self {
            rest: None,
            filter: None,
            rests: 0,
            has_stood: false,
            forward,
            is_moved: false,
            is_changed: false,
        }
    }

    /// Takes a sample (`None` while the sensor is silent), the wheels, and the limits of a rest. Returns whether this has
    /// shown that the sensor was moved since earlier drives.
    pub fn observe(
        &mut self,
        sample: Option<&ImuSample>,
        wheels: &WheelSample,
        limits: &StaticConfig,
        learned: &mut Learned,
    ) -> bool {
        let was_moved = self.is_moved;
        if let Some(rest) = &learned.specific_force
            && self.forward.add(sample, wheels, rest)
            && let Some(forward) = self.forward.forward()
        {
            self.learn_forward(forward, learned);
        }
        let still = wheels.standstill == Standstill::Still;
        if let Some(sample) = sample.filter(|sample| still && sample.validity.is_good()) {
            let rest = self.rest.get_or_insert_with(|| StaticInit::new(*limits));
            if let Some(Ok(rest)) = rest.add(sample) {
                self.learn_rest(&rest, sample.temperature, learned);
            }
        } else {
            self.rest = None;
            self.has_stood &= still;
        }
        self.is_moved && !was_moved
    }

    /// Takes three seconds at rest of a static calibration, which holds for a sensor that was moved, too.
    pub fn calibrated(&mut self, rest: &Rest, temperature: Option<CentiCelsius>, learned: &mut Learned) {
        (learned.specific_force, learned.forward) = (None, None);
        (self.forward, self.has_stood, self.is_moved) = (ForwardEstimator::START, false, false);
        self.learn_rest(rest, temperature, learned);
        self.is_changed = true;
    }

    fn learn_rest(&mut self, rest: &Rest, temperature: Option<CentiCelsius>, learned: &mut Learned) {
        self.is_moved |= learned.is_moved(&rest.specific_force);
        if self.is_moved {
            return;
        }
        if !core::mem::replace(&mut self.has_stood, true) {
            learned.stood(rest.specific_force);
        }
        if let Some(temperature) = temperature {
            let filter = self.filter.get_or_insert_with(|| CurveFilter::new(&learned.bias_curve));
            filter.add(temperature, rest.angular_rate);
            learned.bias_curve = filter.curve();
        }
        self.rests = self.rests.saturating_add(1);
        self.is_changed |= self.rests.is_power_of_two();
    }

    /// Holds the direction of this start against the one that is known, and keeps the better one.
    fn learn_forward(&mut self, forward: Forward, learned: &mut Learned) {
        let known = learned.forward;
        let moved = |known: Forward| {
            let [angle, sigma] = known.angle_to(&forward);
            forward.sigma < KNOWN && angle > MOVED + 2.0 * sigma
        };
        self.is_moved |= known.is_some_and(moved);
        let is_better = forward.sigma < known.map_or(KNOWN, |known| BETTER * known.sigma);
        if is_better && !self.is_moved {
            learned.forward = Some(forward);
            self.is_changed = true;
        }
    }
}

impl Default for Learner {
    fn default() -> Self {
        Self::new()
    }
}
