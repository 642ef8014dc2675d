//! Runs the routines (service 0x31): a self-test, to forget what was learnt, and the activation of a download.

use super::exchange::{Download, Exchange};
use super::lock::Seed;
use super::response::{Nrc, exactly, nrc, put};
use super::session::Session;
use crate::service::MappedSlots;
use crate::service::message::Refusal;
use automotive_diag::uds::RoutineControlType;
use embedded_storage::nor_flash::NorFlash;

const SELF_TEST: u16 = 0x0204;
/// Routine that erases what the board has learnt about its sensor.
const FORGET: u16 = 0x0205;
const USE_DOWNLOAD: u16 = 0xFF01;

impl<R: NorFlash, W: MappedSlots, E: FnMut() -> Option<Seed>> Exchange<'_, R, W, E> {
    /// Bits of failures: clock, CAN, sensor's set-up, stored data, weights, flash controller, random numbers.
    fn self_test(&mut self) -> u8 {
        let now = self.device.conditions();
        let failures = [
            now.clock_fault,
            now.can_fault,
            now.sensor_refused,
            self.device.stored_damaged(),
            now.no_weights,
            !self.device.info().writable,
            (self.entropy)().is_none(),
        ];
        failures.into_iter().rev().fold(0, |bits, fails| bits << 1 | u8::from(fails))
    }

    /// Runs a routine. The response holds the identifier of the routine, then its result, if it has one.
    pub(super) fn routine(&mut self, sub: u8, rest: &[u8]) -> Result<(), Nrc> {
        let (id, option) = rest.split_first_chunk().ok_or(Nrc::IncorrectMessageLengthOrInvalidFormat)?;
        put(self.out, id)?;
        let id = u16::from_be_bytes(*id);
        let is_known = match id {
            SELF_TEST | FORGET => true,
            USE_DOWNLOAD => self.services.require_session(Session::Programming).is_ok(),
            _ => false,
        };
        if !is_known {
            return Err(Nrc::RequestOutOfRange);
        }
        // The other routines only read, or check a signature of their own.
        if id == FORGET {
            self.require_access()?;
        }
        if RoutineControlType::from_repr(sub) != Some(RoutineControlType::StartRoutine) {
            return Err(Nrc::SubFunctionNotSupported);
        }
        if id == USE_DOWNLOAD {
            return self.use_download(option);
        }
        let [] = exactly(option)?;
        if id == SELF_TEST {
            let failures = self.self_test();
            return put(self.out, &[failures]);
        }
        self.device.forget_learned().map_err(nrc)
    }

    /// Checks a download's signature (firmware has one in its head) and uses it from the next start on.
    fn use_download(&mut self, trailer: &[u8]) -> Result<(), Nrc> {
        let checked = self.services.download.as_ref().and_then(Download::checked);
        if let Some((_, true)) = checked {
            let [] = exactly(trailer)?;
            let (_, counter) = self.services.update.ok_or(Nrc::RequestSequenceError)?;
            // A refused request uses up no signature.
            self.require_standstill()?;
            self.use_up(counter)?;
            self.services.update = None;
            return self.device.firmware_activate().map_err(nrc);
        }
        if self.device.access().is_some_and(|access| access.key.is_none()) {
            let [] = exactly(trailer)?;
        } else {
            let Ok(trailer) = trailer.try_into() else {
                return Err(self.refuse(Refusal::Unsigned));
            };
            let (digest, _) = checked.ok_or(Nrc::RequestSequenceError)?;
            let counter = self.check(USE_DOWNLOAD, &digest, trailer)?;
            self.use_up(counter)?;
        }
        self.device.weights_activate().map_err(nrc)
    }
}
