//! Runs the routines (service 0x31): a self-test, to forget what was learnt, and the activation of a download.

use super::download::Download;
use super::response::{Nrc, Response, exactly, nrc, put};
use super::security::{self, Seed};
use super::services::Services;
use super::session::Session;
use crate::service::message::Refusal;
use crate::service::{Device, MappedSlots};
use automotive_diag::uds::RoutineControlType;
use embedded_storage::nor_flash::NorFlash;

const SELF_TEST: u16 = 0x0204;
/// Routine that erases what the board has learnt about its sensor.
const FORGET: u16 = 0x0205;
const USE_DOWNLOAD: u16 = 0xFF01;

/// Bits of failures: clock, CAN, sensor's set-up, stored data, weights, flash controller, random numbers.
fn self_test<R: NorFlash, W: MappedSlots>(device: &Device<R, W>, has_random: bool) -> u8 {
    let now = device.conditions();
    let failures = [
        now.clock_fault,
        now.can_fault,
        now.sensor_refused,
        device.stored_damaged(),
        now.no_weights,
        !device.info().writable,
        !has_random,
    ];
    failures.into_iter().rev().fold(0, |bits, fails| bits << 1 | u8::from(fails))
}

impl Services {
    /// Runs a routine. The response holds the identifier of the routine, then its result, if it has one.
    pub(super) fn routine<R: NorFlash, W: MappedSlots>(
        &mut self,
        sub: u8,
        rest: &[u8],
        device: &mut Device<R, W>,
        entropy: impl FnOnce() -> Option<Seed>,
        out: &mut Response,
    ) -> Result<(), Nrc> {
        let (id, option) = rest.split_first_chunk().ok_or(Nrc::IncorrectMessageLengthOrInvalidFormat)?;
        put(out, id)?;
        let id = u16::from_be_bytes(*id);
        let is_known = match id {
            SELF_TEST | FORGET => true,
            USE_DOWNLOAD => self.require_session(Session::Programming).is_ok(),
            _ => false,
        };
        if !is_known {
            return Err(Nrc::RequestOutOfRange);
        }
        // The other routines only read, or check a signature of their own.
        if id == FORGET {
            self.security.check(device)?;
        }
        if RoutineControlType::from_repr(sub) != Some(RoutineControlType::StartRoutine) {
            return Err(Nrc::SubFunctionNotSupported);
        }
        if id == USE_DOWNLOAD {
            return self.use_download(option, device);
        }
        let [] = exactly(option)?;
        if id == SELF_TEST {
            return put(out, &[self_test(device, entropy().is_some())]);
        }
        device.forget_learned().map_err(nrc)
    }

    /// Checks a download's signature (firmware has one in its head) and uses it from the next start on.
    fn use_download<R: NorFlash, W: MappedSlots>(
        &mut self,
        trailer: &[u8],
        device: &mut Device<R, W>,
    ) -> Result<(), Nrc> {
        let checked = self.download.as_ref().and_then(Download::checked);
        if let Some((_, true)) = checked {
            let [] = exactly(trailer)?;
            let (_, counter) = self.update.ok_or(Nrc::RequestSequenceError)?;
            // A refused request uses up no signature.
            if !device.may_interrupt() {
                return Err(nrc(device.refuse_request(Refusal::Moving)));
            }
            security::use_up(counter, device)?;
            self.update = None;
            return device.firmware_activate().map_err(nrc);
        }
        if device.access().is_some_and(|access| access.key.is_none()) {
            let [] = exactly(trailer)?;
        } else {
            let Ok(trailer) = trailer.try_into() else {
                return Err(nrc(device.refuse_request(Refusal::Unsigned)));
            };
            let (digest, _) = checked.ok_or(Nrc::RequestSequenceError)?;
            let counter = security::check(USE_DOWNLOAD, digest, trailer, device)?;
            security::use_up(counter, device)?;
        }
        device.weights_activate().map_err(nrc)
    }
}
