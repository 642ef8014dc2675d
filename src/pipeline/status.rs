//! The pipeline's part of the slow status message.

use super::Pipeline;
use crate::bias::{StandstillSource, ZeroRate};
use crate::health::slow::{Evidence, Knowledge, SlowStatus, Verdict};
use crate::mounting::GyroMap;
use crate::sample::Standstill;

impl Pipeline {
    /// The content of the slow status message now, with what the wheels show; `None` before their first report.
    #[must_use]
    pub fn status(&self, wheels: Option<Standstill>) -> SlowStatus {
        let (verdict, evidence) = self.standstill(wheels);
        let known = self.state.initialised.is_some();
        let bias = match (known, self.state.sensor_bias.is_known()) {
            (true, _) => Knowledge::Fine,
            (false, true) => Knowledge::Coarse,
            (false, false) => Knowledge::Unknown,
        };
        let is_mapped = self.config.gyro_map != GyroMap::IDENTITY;
        let gain = if is_mapped { Knowledge::Fine } else { Knowledge::Unknown };
        let mounting = if self.state.moved { Knowledge::Refused } else { self.config.forward };
        let gaps = known.then_some(self.state.yaw_gaps);
        SlowStatus { verdict, evidence, bias, gain, mounting, gaps }
    }

    fn standstill(&self, wheels: Option<Standstill>) -> (Verdict, Evidence) {
        let contradicted = self.zero_rate().is_some_and(ZeroRate::contradicted);
        match wheels {
            Some(Standstill::Still) if contradicted => (Verdict::Unknown, Evidence::Wheels),
            Some(Standstill::Still) => (Verdict::Standing, Evidence::Wheels),
            Some(Standstill::Moving) => (Verdict::Moving, Evidence::Wheels),
            // Where wheel speeds are available, they decide.
            Some(Standstill::Unknown) => (Verdict::Unknown, Evidence::None),
            None => match self.zero_rate().map(ZeroRate::evidence) {
                Some(StandstillSource::Inertial) => (Verdict::Standing, Evidence::Inertial),
                _ => (Verdict::Unknown, Evidence::None),
            },
        }
    }
}
