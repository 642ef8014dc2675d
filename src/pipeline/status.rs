//! The pipeline's part of the slow status message.

use super::Pipeline;
use super::level::Level;
use crate::bias::ZeroRate;
use crate::health::slow::{Evidence, Knowledge, SlowStatus, Verdict};
use crate::sample::Standstill;
use crate::standstill::StandstillSource;

impl Pipeline {
    /// The content of the slow status message now, with what the wheels show; `None` before their first report.
    pub fn status(&self, wheels: Option<Standstill>) -> SlowStatus {
        let (verdict, evidence) = self.standstill(wheels);
        let known = self.state.initialised.is_some();
        let bias = match (known, self.state.sensor_bias.is_known()) {
            _ if self.zero_rate().is_some_and(ZeroRate::is_doubted) => Knowledge::Refused,
            (true, _) if self.is_bias_coarse() || !self.is_bias_confirmed() => Knowledge::Coarse,
            (true, _) => Knowledge::Fine,
            (false, true) => Knowledge::Coarse,
            (false, false) => Knowledge::Unknown,
        };
        let gain = match self.gain_by_course() {
            _ if self.state.course.state().is_contradicted => Knowledge::Refused,
            _ if self.is_calibrated() => Knowledge::Fine,
            known => known.map_or(Knowledge::Unknown, |(knowledge, _)| knowledge),
        };
        let mounting = match (self.level_knowledge(), self.config.forward) {
            _ if self.state.moved => Knowledge::Refused,
            (level, forward) if level == forward => level,
            _ => Knowledge::Coarse,
        };
        let gaps = self.state.delayed_yaw.gaps();
        let doubt = gaps.map(|_| self.yaw_doubt());
        SlowStatus { verdict, evidence, bias, gain, mounting, doubts: None, gaps, doubt }
    }

    /// How well standstills and turns have shown the vertical; a calibration has measured it well.
    fn level_knowledge(&self) -> Knowledge {
        let level = self.state.initialised.as_ref().map(|known| &known.level);
        match level.map(Level::vertical) {
            _ if !self.config.levelling => Knowledge::Fine,
            Some(Some(now)) => now.knowledge(),
            _ => self.config.vertical.knowledge(),
        }
    }

    pub(super) fn is_calibrated(&self) -> bool {
        !self.config.gyro_map.is_identity()
    }

    /// The expected error of the angle turned in the last minute, 0.01 deg, rounded up.
    fn yaw_doubt(&self) -> u32 {
        let lag = self.config.compensate.lag.samples() as u32;
        let missing = self.state.delayed_yaw.missing(self.state.tick.wrapping_sub(lag));
        // Beyond the code's range the cast saturates.
        libm::ceilf(self.state.uncertainty.minute(missing).to_degrees() * 100.0) as u32
    }

    fn standstill(&self, wheels: Option<Standstill>) -> (Verdict, Evidence) {
        let standing = self.state.standing;
        match standing.source {
            _ if standing.is_contradicted => (Verdict::Unknown, Evidence::Wheels),
            StandstillSource::Wheels => (Verdict::Standing, Evidence::Wheels),
            StandstillSource::Inertial if standing.is_likely() => (Verdict::Standing, Evidence::Inertial),
            _ if wheels == Some(Standstill::Moving) => (Verdict::Moving, Evidence::Wheels),
            _ => (Verdict::Unknown, Evidence::None),
        }
    }
}
