//! Static initialisation, and what is known once it has succeeded.

use super::{Pipeline, PipelineConfig, YawRate};
use crate::bias::{QuietDetector, Rest, StaticError, ZeroPoint, ZeroRate};
use crate::health::{Faults, Status, count};
use crate::mounting::Rotation;
use crate::sample::{Frame, ImuSample, Standstill};
use crate::seal::seal;
use crate::units::{AngularRate, Yaw};

/// What is known once static initialisation has succeeded.
#[derive(Debug, Clone)]
pub(super) struct Known {
    /// Beyond the configured mounting.
    pub(super) levelling: Rotation,
    pub(super) zero: ZeroPoint,
    /// Of mounting, levelling and zero point, which stay as they are: a bit that flips in them shows.
    seal: u32,
    pub(super) quiet: QuietDetector,
    pub(super) zero_rate: Option<ZeroRate>,
}

impl Pipeline {
    /// Levels a sample, and says what the gyro reads at rest; `None` before that is known, and when
    /// its memory has changed.
    pub(super) fn turned(&mut self, sample: &mut ImuSample) -> Option<ZeroPoint> {
        let known = self.known.as_ref()?;
        let mounting = seal(&self.config.mounting);
        if known.seal != seal(&(mounting, known.levelling, known.zero)) {
            self.forget();
            return None;
        }
        *sample = known.levelling.sample(sample);
        Some(known.zero)
    }

    /// What was known is not what it was: static initialisation begins anew.
    #[cold]
    fn forget(&mut self) {
        self.known = None;
        self.prompt_yaw = self.navigation_yaw;
        self.break_window();
        self.damaged();
    }

    /// Begins to learn the bias anew where it is not what it was.
    pub(super) fn check_bias(&mut self) {
        if self.zero_rate().is_some_and(|zero_rate| !zero_rate.is_whole()) {
            self.damaged();
            if let Some(known) = &mut self.known {
                known.zero_rate = self.config.zero_rate.map(ZeroRate::new);
            }
        }
    }

    /// Tells that memory has changed.
    #[cold]
    pub(super) fn damaged(&mut self) {
        self.estimate_faults = Faults::IMPLAUSIBLE;
        count(&mut self.counters.implausible, 1);
    }

    #[inline(never)]
    pub(super) fn initialise(&mut self, frame: &Frame) -> (YawRate, Option<StaticError>) {
        let judged = if self.standstill() == Standstill::Moving {
            self.static_init.refuse_wheels().map(Err)
        } else if frame.sample.clipped {
            // A clipped reading says nothing about the bias; the gap it leaves has restarted it.
            None
        } else {
            self.static_init.process(&frame.sample)
        };
        let refused = judged.and_then(|rest| rest.and_then(|rest| self.know(&rest)).err());
        count(&mut self.counters.moving, u32::from(refused.is_some()));
        let status = if frame.sample.clipped { Status::Clipped } else { Status::Init };
        (raw(frame, status, self.prompt_yaw), refused)
    }

    #[inline(never)]
    fn know(&mut self, rest: &Rest) -> Result<(), StaticError> {
        let PipelineConfig { levelling, static_init, earth_rate, zero_rate, quiet, .. } = self.config;
        let levelling = levelling.rotation(rest.specific_force).map_err(StaticError::Level)?;
        let zero = ZeroPoint::at_rest(levelling.rate(rest.angular_rate), earth_rate);
        self.known = Some(Known {
            levelling,
            zero,
            // Not of the mounting as it is by now.
            seal: seal(&(self.mounting_seal, levelling, zero)),
            quiet: QuietDetector::new(quiet, &static_init, rest),
            zero_rate: zero_rate.map(ZeroRate::new),
        });
        Ok(())
    }
}

/// The gyro as it is.
pub(super) fn raw(frame: &Frame, status: Status, yaw: Yaw) -> YawRate {
    let [_, _, rate] = frame.sample.angular_rate;
    YawRate { tick: frame.tick, rate, correction: AngularRate::ZERO, yaw, sigma: None, status }
}
