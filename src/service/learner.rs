//! The board learns the sensor's bias by temperature at standstills that the wheels prove.
//!
//! Without wheels a long straight can look like a standstill; then only static calibrations add to the curve. What three
//! seconds at rest have shown is stored after the first time, the second, the fourth and so on, so that the flash is
//! written some ten times in a start.

use crate::bias::{CurveFilter, Rest, StaticConfig, StaticInit};
use crate::sample::{ImuSample, Standstill};
use crate::store::Learned;
use crate::units::CentiCelsius;

/// Learns from the rests of this start.
#[derive(Debug)]
pub struct Learner {
    rest: Option<StaticInit>,
    /// It exists from the first rest on.
    filter: Option<CurveFilter>,
    rests: u32,
    /// What is learnt differs from what is stored.
    pub is_changed: bool,
}

impl Learner {
    /// Starts with nothing shown.
    #[must_use]
    pub const fn new() -> Self {
        Self { rest: None, filter: None, rests: 0, is_changed: false }
    }

    /// Takes a sample (`None` while the sensor is silent), what the wheels show, and the limits of a rest.
    pub fn observe(
        &mut self,
        sample: Option<&ImuSample>,
        wheels: Standstill,
        limits: &StaticConfig,
        learned: &mut Learned,
    ) {
        let at_rest = sample.filter(|sample| sample.validity.is_good() && wheels == Standstill::Still);
        let Some((sample, temperature)) = at_rest.and_then(|sample| Some((sample, sample.temperature?)))
        else {
            self.rest = None;
            return;
        };
        let rest = self.rest.get_or_insert_with(|| StaticInit::new(*limits));
        if let Some(Ok(rest)) = rest.add(sample) {
            self.learn(&rest, temperature, learned);
        }
    }

    /// Takes three seconds at rest; those of a sensor that was moved are not used.
    pub fn learn(&mut self, rest: &Rest, temperature: CentiCelsius, learned: &mut Learned) {
        if !learned.accept(rest.specific_force) {
            return;
        }
        let filter = self.filter.get_or_insert_with(|| CurveFilter::new(&learned.bias_curve));
        filter.add(temperature, rest.angular_rate);
        learned.bias_curve = filter.curve();
        self.rests = self.rests.saturating_add(1);
        self.is_changed |= self.rests.is_power_of_two();
    }
}

impl Default for Learner {
    fn default() -> Self {
        Self::new()
    }
}
