//! Reads the stored records at the start, and stores them on request.

use super::{Device, Firmware, INTERRUPTS, MappedSlots, SupportedHardware};
use crate::can::wheel::WheelSettings;
use crate::service::message::{FlashState, Identity, Origin, Refusal};
use crate::store::{
    Accepted, Access, Calibration, Configuration, FieldError, FlashFault, Learned, Record, Store, StoreError,
    Troubles, UnitMap,
};
use embedded_storage::nor_flash::NorFlash;

impl<R: NorFlash, W: MappedSlots> Device<R, W> {
    /// Reads the stored records; damaged ones are reported and not used. After a fault that the check of the flash
    /// `controller` has found, nothing is written.
    pub fn begin(
        &mut self,
        records: Option<R>,
        slots: Option<W>,
        controller: Result<(), FlashFault>,
        identity: Identity,
    ) {
        self.info.identity = identity;
        self.info.writable = controller.is_ok() && records.is_some();
        // After a fault, records are read only here, and nothing is kept for writing.
        self.slots = slots.filter(|_| controller.is_ok());
        self.info.firmware = self.slots.as_mut().map_or(Firmware::ALONE, Firmware::of);
        if let Err(fault) = controller {
            self.refuse(StoreError::Flash(fault));
        }
        if let Some(records) = records {
            match Store::open(records, 0) {
                Ok(store) => self.load(store),
                Err(error) => (self.info.flash, self.access) = (FlashState::Failed(error), None),
            }
        }
    }

    fn records_damaged(&self) -> bool {
        matches!(self.info.flash, FlashState::Damaged | FlashState::Failed(_))
    }

    /// Returns whether any stored data are damaged or refused: [`crate::health::Faults::STORED`].
    pub fn stored_damaged(&self) -> bool {
        self.refused || self.records_damaged()
    }

    /// Returns whether a stored configuration could not be used; the sensor's axes are then unknown.
    pub fn configuration_lost(&self) -> bool {
        match self.info.configuration {
            Origin::BuiltIn => self.records_damaged(),
            Origin::Stored => false,
            Origin::Refused(_) => true,
        }
    }

    fn load(&mut self, mut store: Store<R>) {
        let found = store.get::<Configuration>();
        let supported = |found: Configuration| self.check_supported(&found).map(|()| found);
        let found = found.and_then(|found| found.map(supported).transpose());
        let (configuration, origin) = self.take(found);
        (self.configuration, self.info.configuration) =
            (configuration.unwrap_or(Configuration::DEFAULT), origin);
        self.next_configuration = self.configuration;
        let (wheels, origin) = self.take(store.get());
        (self.wheels, self.info.wheels) = (wheels.unwrap_or(WheelSettings::TOYOTA), origin);
        self.next_wheels = self.wheels;
        if let Err(error) = self.configuration.check_wheels(&self.wheels) {
            let (_, origin) = self.take::<()>(Err(error.into()));
            (self.wheels, self.info.wheels) = (WheelSettings::NONE, origin);
        }
        if self.has_failed() {
            let (_, origin) = self.take::<()>(Err(StoreError::Resets));
            (self.configuration, self.info.configuration) = (self.configuration.bus_alone(), origin);
            self.wheels = WheelSettings::NONE;
        }
        let (calibration, origin) = self.take(store.get());
        (self.calibration, self.info.calibration) = (calibration.unwrap_or(Calibration::NONE), origin);
        let (learned, _) = self.take(store.get());
        self.learned = learned.unwrap_or(Learned::NOTHING);
        let (accepted, _) = self.take(store.get());
        self.accepted = accepted.unwrap_or(Accepted::NONE);
        match store.get() {
            Ok(troubles) => self.troubles = troubles.unwrap_or(Troubles::NONE),
            Err(error) => self.info.stored_fault = Some(error),
        }
        self.access = match self.take(store.get()) {
            (_, Origin::Refused(_)) => None,
            (access, _) => Some(access.unwrap_or(Access::OPEN)),
        };
        self.info.flash = if store.damaged() { FlashState::Damaged } else { FlashState::Ready };
        if self.info.writable
            && let Err(error) = store.make_room()
        {
            self.refuse(error);
        }
        self.store = self.info.writable.then_some(store);
    }

    /// Returns the record that was read, if valid, and its origin.
    fn take<T>(&mut self, found: Result<Option<T>, StoreError>) -> (Option<T>, Origin) {
        match found {
            Ok(Some(record)) => (Some(record), Origin::Stored),
            Ok(None) => (None, Origin::BuiltIn),
            Err(error) => {
                self.refuse(error);
                (None, Origin::Refused(error))
            }
        }
    }

    fn check_supported(&self, configuration: &Configuration) -> Result<(), StoreError> {
        let SupportedHardware { imus, fogs, gnss, fd, .. } = self.supported;
        if !imus.contains(&configuration.imu) || configuration.fog.is_some_and(|fog| !fogs.contains(&fog)) {
            return Err(StoreError::Field(FieldError::PartNotInImage));
        }
        if configuration.heading.line.is_some() && !gnss {
            return Err(StoreError::Field(FieldError::NoLine));
        }
        if configuration.can.yaw.is_some_and(|yaw| yaw.fd.is_some()) && !fd {
            return Err(StoreError::Field(FieldError::NoFd));
        }
        Ok(())
    }

    pub(super) fn store(&mut self) -> Result<&mut Store<R>, StoreError> {
        self.store.as_mut().ok_or(StoreError::NoFlash)
    }

    /// Stores a configuration, which the next start uses.
    #[inline(never)]
    pub fn set_configuration(&mut self, configuration: &Configuration) -> Result<(), Refusal> {
        self.request(INTERRUPTS, |device| {
            // Check the values first, so that a bad value is reported even if nothing can be stored.
            configuration.check().map_err(StoreError::from)?;
            device.check_supported(configuration)?;
            configuration.check_wheels(&device.next_wheels).map_err(StoreError::from)?;
            let available = configuration.compensate.stride.window_cycles(device.supported.clock_hz);
            let cycles = device.next_window;
            if cycles > available {
                return Err(StoreError::Field(FieldError::Window { cycles, available }).into());
            }
            device.store()?.set(configuration)?;
            device.next_configuration = *configuration;
            Ok(())
        })
    }

    /// Stores the settings of the wheel frames, which the next start uses.
    #[inline(never)]
    pub fn set_wheels(&mut self, wheels: &WheelSettings) -> Result<(), Refusal> {
        self.request(INTERRUPTS, |device| {
            wheels.check().map_err(StoreError::from)?;
            device.next_configuration.check_wheels(wheels).map_err(StoreError::from)?;
            device.store()?.set(wheels)?;
            device.next_wheels = *wheels;
            Ok(())
        })
    }

    /// Stores gain and misalignment of this unit's gyro, or removes them; used from the next start on.
    #[inline(never)]
    pub fn set_unit(&mut self, unit: Option<UnitMap>) -> Result<(), Refusal> {
        self.request(INTERRUPTS, |device| {
            let runs = device.info.weights_crc.unwrap_or(0);
            if let Some(UnitMap { weights: found, .. }) = unit
                && found != runs
            {
                return Err(Refusal::OtherWeights { found, runs });
            }
            let calibration = Calibration { unit };
            calibration.check().map_err(StoreError::from)?;
            device.store()?.set(&calibration)?;
            device.calibration = calibration;
            device.info.calibration = Origin::Stored;
            Ok(())
        })
    }

    pub(super) fn store_learned(&mut self, learned: Learned) -> Result<(), Refusal> {
        self.store()?.set(&learned)?;
        self.learned = learned;
        self.learner.is_changed = false;
        Ok(())
    }

    pub(crate) fn store_access(&mut self, access: Access) -> Result<(), Refusal> {
        self.store()?.set(&access)?;
        self.access = Some(access);
        Ok(())
    }

    pub(crate) fn troubles(&self) -> &Troubles {
        &self.troubles
    }

    /// Stores what was learnt about the sensor, if it has changed, no erase is needed and the vehicle stands.
    #[inline(never)]
    pub(crate) fn store_learned_if_due(&mut self) {
        let has_room = self.store.as_ref().is_some_and(Store::has_room);
        if self.learner.is_changed && has_room && self.may_interrupt {
            // If the flash refuses the record, do not try again each time.
            self.learner.is_changed = false;
            if let Err(Refusal::Store(error)) = self.store_learned(self.learned) {
                self.info.stored_fault = Some(error);
            }
        }
    }

    /// Returns whether troubles cannot be stored without an erase, and the vehicle stands.
    pub(crate) fn troubles_want_erase(&self) -> bool {
        self.may_interrupt && self.store.as_ref().is_some_and(|store| !store.has_room())
    }

    /// Stores the troubles; an erase waits for `may_erase` and standstill. Returns `false` to be called again.
    #[inline(never)]
    pub(crate) fn store_troubles(&mut self, troubles: &Troubles, may_erase: bool) -> bool {
        let may_erase = may_erase && self.may_interrupt;
        let Some(store) = self.store.as_mut() else { return true };
        if !store.has_room() && !may_erase {
            return false;
        }
        // If the flash refuses the record, do not try again each time.
        if let Err(error) = store.set(troubles) {
            self.info.stored_fault = Some(error);
        }
        true
    }
}
