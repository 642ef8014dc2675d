//! The learner estimates the sensor's bias over temperature at standstills that the wheels prove (without wheels a
//! long straight can look like one), and its mounting: up at standstills and in turns
//! ([`crate::mounting::VerticalEstimator`]), forward while the vehicle drives. The gain comes from the pipeline.
//!
//! Learnt values are stored after the first, second, fourth, ... three seconds at rest, about ten times per start, and
//! when the sigma of the forward direction has decreased by 30 %, about six times in total.

use crate::bias::{Rest, StaticConfig, StaticInit};
use crate::heading::Gain;
use crate::mounting::{Forward, ForwardEstimator, Vertical};
use crate::sample::{ImuSample, WheelSample};
use crate::standstill::Standing;
use crate::store::Learned;
use crate::units::CentiCelsius;

/// Largest sigma of a forward direction that is used, rad: 10 degrees. A mounting error of this size has no effect.
const KNOWN: f32 = 0.175;
/// Angle, besides two sigmas, between two starts' forward directions of a sensor that has moved, rad: 25 degrees.
const MOVED: f32 = 0.436;
/// Largest ratio of sigmas at which a new forward direction replaces the known one.
const BETTER: f32 = 0.7;

/// The learner of one start; it learns from periods at rest and from driving.
#[derive(Debug)]
pub struct Learner {
    rest: Option<StaticInit>,
    rests: u32,
    /// True if a bias with its temperature was learnt since the start.
    has_bias: bool,
    has_stood: bool,
    forward: ForwardEstimator,
    vertical: Option<Vertical>,
    /// True if the mounting has changed since earlier drives; nothing is learnt then.
    is_moved: bool,
    /// True if there is something new to store.
    pub is_changed: bool,
    /// False once the gain was forgotten, which the pipeline still has: it is learnt from the next start on.
    pub keeps_gain: bool,
}

impl Learner {
    /// A learner without observations.
    pub const START: Self = Self {
        rest: None,
        rests: 0,
        has_bias: false,
        has_stood: false,
        forward: ForwardEstimator::START,
        vertical: None,
        is_moved: false,
        is_changed: false,
        keeps_gain: true,
    };

    /// Processes a sample or silence, wheels and standstill; `limits` are those of rest. Returns `true` for a move.
    pub fn observe(
        &mut self,
        sample: Option<&ImuSample>,
        wheels: &WheelSample,
        standing: &Standing,
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
        let still = standing.is_by_wheels();
        if let Some(sample) = sample.filter(|sample| still && sample.validity.is_good()) {
            let rest = self.rest.get_or_insert_with(|| StaticInit::new(*limits));
            // What is kept over starts can wait for a rest that does not rock.
            if let Some(Ok(rest)) = rest.add(sample, false, false) {
                self.learn_rest(&rest, sample.temperature, learned);
            }
        } else {
            self.rest = None;
            self.has_stood &= still;
        }
        if self.is_moved && (learned.vertical != Vertical::UNKNOWN || learned.gain.is_some()) {
            // They are not those of this mounting any more.
            (learned.vertical, learned.gain, self.is_changed) = (Vertical::UNKNOWN, None, true);
        }
        self.is_moved && !was_moved
    }

    /// Learns what standstills and turns have shown of the vertical, and stores it when it differs notably.
    pub fn learn_vertical(&mut self, vertical: Vertical, learned: &mut Learned) {
        if self.is_moved {
            return;
        }
        let before = self.vertical.get_or_insert(learned.vertical);
        if vertical.differs(before) {
            *before = vertical;
            self.is_changed = true;
        }
        learned.vertical = vertical;
    }

    /// Learns the gain that courses have shown. It is stored when it differs notably.
    pub fn learn_gain(&mut self, gain: &Gain, learned: &mut Learned) {
        if self.keeps_gain && !self.is_moved && gain.replaces(learned.gain.as_ref()) {
            (learned.gain, self.is_changed) = (Some(*gain), true);
        }
    }

    fn learn_rest(&mut self, rest: &Rest, temperature: Option<CentiCelsius>, learned: &mut Learned) {
        self.is_moved |= learned.is_moved(&rest.specific_force);
        if self.is_moved {
            return;
        }
        if !core::mem::replace(&mut self.has_stood, true) {
            learned.add_standstill(rest.specific_force);
        }
        if let Some(temperature) = temperature {
            let is_first = !core::mem::replace(&mut self.has_bias, true);
            learned.thermal_bias.add(is_first, temperature, rest.angular_rate);
        }
        self.rests = self.rests.saturating_add(1);
        self.is_changed |= self.rests.is_power_of_two();
    }

    /// Compares the forward direction of this start with the known one, and keeps the better one.
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
