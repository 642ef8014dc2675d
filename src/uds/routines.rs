//! Runs the routines (service 0x31): calibrations, the log, a self-test, and the activation of a
//! download.

use super::download::Download;
use super::response::{Nrc, Response, exactly, nrc, put, put_record};
use super::security::{self, Seed};
use super::services::Services;
use super::session::Session;
use crate::service::calibrate::{State, Task};
use crate::service::message::Refusal;
use crate::service::{Device, MappedSlots};
use automotive_diag::uds::RoutineControlType;
use embedded_storage::nor_flash::NorFlash;

const SELF_TEST: u16 = 0x0204;
/// Routine that erases what the board has learnt about its sensor.
const FORGET: u16 = 0x0205;
const LOG: u16 = 0x0203;
const STORE: u16 = 0x0202;
const USE_DOWNLOAD: u16 = 0xFF01;

const REQUEST_RESULT: RoutineControlType = RoutineControlType::RequestRoutineResult;

/// Returns a bit for each component that fails: 0 the processor's clock, 1 the CAN controller, 2 the inertial
/// sensor's set-up, 3 stored data, 4 the weights, 5 the flash controller, 6 the random number generator.
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
        let task = match id {
            0x0200 => Some(Task::Static),
            0x0201 => Some(Task::Mounting),
            STORE | LOG | SELF_TEST | FORGET => None,
            USE_DOWNLOAD if self.require_session(Session::Programming).is_ok() => None,
            _ => return Err(Nrc::RequestOutOfRange),
        };
        let control = RoutineControlType::from_repr(sub);
        // The other routines only read, or check a signature of their own.
        if matches!(id, STORE | FORGET) || task.is_some() && control != Some(REQUEST_RESULT) {
            self.security.check(device)?;
        }
        let control =
            control.filter(|control| task.is_some() || *control == RoutineControlType::StartRoutine);
        let control = control.ok_or(Nrc::SubFunctionNotSupported)?;
        match id {
            LOG => return put_record(out, &device.events(u32::from_be_bytes(exactly(option)?))),
            USE_DOWNLOAD => return self.use_download(option, device),
            _ => exactly(option).map(|[]: [u8; 0]| ())?,
        }
        match (task, control) {
            (Some(task), RoutineControlType::StartRoutine) => device.start_calibration(task),
            (Some(_), RoutineControlType::StopRoutine) => device.cancel_calibration(),
            (Some(task), REQUEST_RESULT) => {
                let state = match device.calibration_state() {
                    State::Running(of) if of == task => 1,
                    State::Found(of) if of == task => 2,
                    State::Failed(of, _) if of == task => 3,
                    _ => return Err(Nrc::RequestSequenceError),
                };
                put(out, &[state])?;
            }
            (None, _) if id == SELF_TEST => put(out, &[self_test(device, entropy().is_some())])?,
            (None, _) if id == STORE => device.store_result().map_err(nrc)?,
            (None, _) => device.forget_learned().map_err(nrc)?,
        }
        Ok(())
    }

    /// Checks the signature of a download, if the board has a key, and has it used from the next start on. Firmware was
    /// signed by the head of its update.
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
