//! Static initialisation finds the bias and the tilt, or a course the bias of a vehicle that moves; this module holds both
//! once one has succeeded.

use super::sensor_bias::ZeroPoint;
use super::{Pipeline, PipelineConfig};
use crate::bias::{Rest, StaticError, ZeroRate};
use crate::health::count;
use crate::mounting::{Rotation, is_moved};
use crate::sample::Frame;
use crate::standstill::Standing;

/// Holds the results of static initialisation, and the filter that starts from them.
#[derive(Debug, Clone)]
pub(super) struct Initialised {
    /// The rotation beyond the configured mounting.
    pub(super) levelling: Rotation,
    pub(super) zero: ZeroPoint,
    pub(super) zero_rate: Option<ZeroRate>,
    /// The bias was found in motion, and is not known well yet.
    pub(super) is_coarse: bool,
}

impl Pipeline {
    /// Adds a sample to static initialisation, of a vehicle whose wheels may turn (`moves`). Returns the reason if this
    /// sample makes it fail.
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
            self.state.static_init.add(&frame.sample, standing.is_by_wheels())
        } else {
            // The reading says nothing about the bias; the gap it leaves has restarted the initialisation.
            None
        };
        let refused = judged.and_then(|rest| rest.and_then(|rest| self.accept(&rest)).err());
        count(&mut self.state.counters.moving, u32::from(refused.is_some()));
        refused
    }

    #[inline(never)]
    fn accept(&mut self, rest: &Rest) -> Result<(), StaticError> {
        let PipelineConfig { levelling, earth_rate, zero_rate, .. } = self.config;
        let levelling = levelling.rotation(rest.specific_force).map_err(StaticError::Level)?;
        let before = self.config.rest_force.map(|force| self.config.mounting.force(force));
        if before.is_some_and(|before| is_moved(&before, &rest.specific_force)) {
            self.mount_moved();
        }
        self.state.sensor_bias.refer();
        self.state.initialised = Some(Initialised {
            levelling,
            zero: ZeroPoint::at_rest(levelling.rate(rest.angular_rate), earth_rate),
            zero_rate: zero_rate.map(ZeroRate::new),
            is_coarse: false,
        });
        self.state.course.restart();
        Ok(())
    }
}
