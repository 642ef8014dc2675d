//! What a board needs of the device to start its coprocessor and its CAN controller.

use super::{Device, MappedSlots};
use crate::can::wheel::WheelReceiver;
use crate::coprocessor::{Clock, Config, Observation, StorageFaults};
use embedded_can::Id;
use embedded_storage::nor_flash::NorFlash;

impl<R: NorFlash, W: MappedSlots> Device<R, W> {
    /// Returns the configuration by stored data and weights; `is_exact`: the clock can measure the sensor's.
    #[inline]
    pub fn coprocessor(&self, is_exact: bool) -> Config {
        let weights = self.info.weights_crc.unwrap_or(0);
        let of_other_weights = self.calibration.unit.is_some_and(|unit| unit.weights != weights);
        Config {
            wheels: WheelReceiver::new(self.wheels).ok(),
            has_gyronet: self.info.weights_crc.is_some(),
            clock: Clock::Outside,
            clock_is_exact: is_exact,
            storage: StorageFaults {
                damaged: self.stored_damaged() || of_other_weights,
                configuration_lost: self.configuration_lost(),
            },
            ..self.configuration.coprocessor(&self.calibration, &self.learned, weights)
        }
    }

    /// Returns the identifiers that CAN receives, each with the mask of its bits that count.
    pub fn received(&self) -> impl Iterator<Item = (Id, u32)> {
        let exactly = |id| (id, u32::MAX);
        let wheels = self.wheels.frames.iter().flatten().map(move |frame| exactly(frame.id));
        // A stored configuration has been checked.
        let ids = self.configuration.diagnosis.ids().ok().into_iter();
        let requests = ids.flat_map(move |[request, functional, _]| [request, functional].map(exactly));
        requests.chain(wheels).chain(self.configuration.heading.filters())
    }

    /// Takes what the coprocessor has observed: all that [`Device::observe`] and what follows it take.
    pub fn observed(&mut self, seen: &Observation) {
        seen.vertical.into_iter().for_each(|vertical| self.learn_vertical(vertical));
        let (live, tick) = (&seen.vehicle.live, seen.vehicle.tick);
        let Observation { sample, wheels, standing, .. } = seen;
        self.observe(sample.as_ref(), tick, (live.status, live.faults), wheels, standing);
        self.rated(live.quality, standing);
    }
}
