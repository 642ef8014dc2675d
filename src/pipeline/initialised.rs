//! Static initialisation finds the bias and the tilt, or a course the bias of a vehicle that moves; this module holds both
//! once one has succeeded.

use super::level::Level;
use super::sensor_bias::ZeroPoint;
use super::{Pipeline, PipelineConfig, State};
use crate::bias::{Rest, StaticError, ZeroRate};
use crate::health::count;
use crate::mounting::{Rotation, Vertical, is_moved};
use crate::sample::{Frame, ImuSample};
use crate::standstill::Standing;
use crate::units::{AngularRate, SpecificForce};

/// Holds the results of static initialisation, and the filter that starts from them.
#[derive(Debug, Clone)]
pub(super) struct Initialised {
    pub(super) level: Level,
    pub(super) zero: ZeroPoint,
    pub(super) zero_rate: Option<ZeroRate>,
    /// The bias was found in motion, or courses have contradicted it, and it is not known well yet.
    pub(super) is_coarse: bool,
}

impl Pipeline {
    /// Adds a sample to static initialisation (`moves`: the wheels may turn); returns the reason of a failure.
    #[inline(never)]
    pub(super) fn initialise(
        &mut self,
        frame: &Frame,
        standing: Standing,
        moves: bool,
    ) -> Option<StaticError> {
        let judged = if moves {
            self.state.static_init.refuse_wheels().map(Err)
        } else if frame.sample.validity.is_good() {
            self.state.static_init.add(&frame.sample, standing.is_likely(), self.state.standstill.is_calm)
        } else {
            // The reading says nothing about the bias; the gap it leaves has restarted the initialisation.
            None
        };
        let refused = judged.and_then(|rest| rest.and_then(|rest| self.accept(&rest)).err());
        count(&mut self.state.counters.moving, u32::from(refused.is_some()));
        refused
    }

    /// Goes on with static initialisation until the bias that it has found is confirmed; `rates` are those less that bias.
    #[inline(never)]
    pub(super) fn claim_again(
        &mut self,
        sample: &ImuSample,
        rates: [AngularRate; 3],
        standing: Standing,
        moves: bool,
    ) {
        let State { initialised, static_init, standstill, .. } = &mut self.state;
        let Some(zero_rate) = initialised.as_mut().and_then(|known| known.zero_rate.as_mut()) else { return };
        if zero_rate.is_confirmed() {
            return;
        }
        if !sample.validity.is_good() || moves {
            return static_init.restart();
        }
        // Whoever boards a vehicle rocks it, and does not turn it.
        let [.., yaw] = rates;
        let specific_force = [SpecificForce(0), SpecificForce(0), SpecificForce::STANDARD_GRAVITY];
        let angular_rate = [AngularRate::ZERO, AngularRate::ZERO, yaw];
        let sample = ImuSample { angular_rate, specific_force, ..*sample };
        if let Some(Ok(rest)) = static_init.add(&sample, standing.is_likely(), standstill.is_calm) {
            let [.., mean] = rest.angular_rate;
            zero_rate.rest(mean.0 as f32 / AngularRate::PER_RAD_PER_SEC, rest.drift);
        }
    }

    #[inline(never)]
    fn accept(&mut self, rest: &Rest) -> Result<(), StaticError> {
        let PipelineConfig { mounting, vertical, levelling, earth_rate, zero_rate, .. } = self.config;
        if levelling {
            Rotation::levelling(rest.specific_force).map_err(StaticError::Level)?;
        }
        let before = self.config.rest_force.map(|force| mounting.force(force));
        let is_moved = before.is_some_and(|before| is_moved(&before, &rest.specific_force));
        if is_moved {
            self.mount_moved();
        }
        let known = if is_moved { Vertical::UNKNOWN } else { vertical.turned(&mounting) };
        let level = Level::new(rest.angular_rate, Some(&rest.specific_force), levelling.then_some(known));
        self.state.sensor_bias.refer();
        let [.., reading] = level.rates_at_rest().map(|rate| rate.0 as f32 / AngularRate::PER_RAD_PER_SEC);
        let sigma = self.state.sensor_bias.sigma();
        let zero_rate = zero_rate.map(|config| ZeroRate::claimed(config, reading, sigma, rest.drift));
        let zero = level.zero(earth_rate);
        self.state.initialised = Some(Initialised { level, zero, zero_rate, is_coarse: false });
        let gain = self.config.gain;
        if let Some(zero_rate) = self.zero_rate_mut() {
            zero_rate.filter().give_back(gain);
        }
        self.state.course.restart();
        Ok(())
    }
}
