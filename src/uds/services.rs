//! Dispatches the services (ISO 14229-1).
//!
//! A request is checked in this order, and the first check that fails gives the code: service, session, least length,
//! sub-function, access, length, values, conditions. Services translate requests to those of the device, so that the
//! same rules apply on all lines. One that writes data or silences the output needs a non-default session and a
//! standstill.

use super::data::{UPDATE, is_writable};
use super::exchange::Exchange;
use super::lock::Seed;
use super::response::{Nrc, exactly, nrc, put};
use super::session::{self, Session};
use super::troubles;
use super::update::Head;
use crate::service::MappedSlots;
use crate::service::message::Refusal;
use crate::store::firmware::{FirmwareError, MAX_IMAGE};
use automotive_diag::uds::UdsCommand;
use embedded_storage::nor_flash::NorFlash;

/// Bit of a sub-function that suppresses the positive response.
const SUPPRESS: u8 = 0x80;

pub const NEGATIVE: u8 = 0x7F;
/// Offset from the service identifier of a request to that of a positive response.
const POSITIVE: u8 = 0x40;

impl<R: NorFlash, W: MappedSlots, E: FnMut() -> Option<Seed>> Exchange<'_, R, W, E> {
    /// Writes the response to a request; leaves `out` empty if no response is wanted.
    pub fn answer(&mut self, request: &[u8]) {
        let Some((&service, rest)) = request.split_first() else { return };
        // Cannot fail: the response is empty.
        let _ = self.out.push(service.wrapping_add(POSITIVE));
        match self.serve(service, rest) {
            Ok(true) => {}
            // After "response pending", a response must follow.
            Ok(false) if self.is_pending => {}
            Ok(false) => self.out.clear(),
            Err(nrc) => {
                self.out.clear();
                let is_silent = self.services.is_functional
                    && matches!(
                        nrc,
                        Nrc::ServiceNotSupported
                            | Nrc::SubFunctionNotSupported
                            | Nrc::RequestOutOfRange
                            | Nrc::SubFunctionNotSupportedInActiveSession
                            | Nrc::ServiceNotSupportedInActiveSession
                    );
                if !is_silent || self.is_pending {
                    let _ = self.out.extend_from_slice(&[NEGATIVE, service, nrc as u8]);
                }
            }
        }
    }

    #[inline(never)]
    fn serve(&mut self, service: u8, rest: &[u8]) -> Result<bool, Nrc> {
        let command = UdsCommand::from_repr(service).ok_or(Nrc::ServiceNotSupported)?;
        let is_guest = self.services.is_guest;
        if command != UdsCommand::ReadDataByIdentifier && !is_guest {
            self.device.forget_refusal();
        }
        let (needed, has_sub_function) = session::rules(command);
        let is_owners = needed != Session::Default
            || matches!(
                command,
                UdsCommand::DiagnosticSessionControl
                    | UdsCommand::ECUReset
                    | UdsCommand::ClearDiagnosticInformation
            );
        if is_guest && is_owners {
            return Err(nrc(Refusal::OtherTester));
        }
        self.services.require_session(needed)?;
        if !has_sub_function {
            return self.serve_data(command, rest).map(|()| true);
        }
        let (&sub, rest) = rest.split_first().ok_or(Nrc::IncorrectMessageLengthOrInvalidFormat)?;
        let (sub, is_wanted) = (sub & !SUPPRESS, sub & SUPPRESS == 0);
        put(self.out, &[sub])?;
        match command {
            UdsCommand::DiagnosticSessionControl => self.session_control(sub, rest),
            UdsCommand::ECUReset => self.reset(sub, rest),
            UdsCommand::TesterPresent => Self::tester_present(sub, rest),
            UdsCommand::CommunicationControl => self.communication_control(sub, rest),
            UdsCommand::ControlDTCSetting => self.dtc_setting(sub),
            UdsCommand::ReadDTCInformation => troubles::read(&self.services.memory, sub, rest, self.out),
            UdsCommand::SecurityAccess => self.access(sub, rest),
            _ => self.routine(sub, rest),
        }?;
        Ok(is_wanted)
    }

    fn serve_data(&mut self, command: UdsCommand, rest: &[u8]) -> Result<(), Nrc> {
        match command {
            UdsCommand::ClearDiagnosticInformation => self.clear_troubles(rest),
            UdsCommand::ReadDataByIdentifier => {
                if rest.is_empty() || !rest.len().is_multiple_of(2) {
                    return Err(Nrc::IncorrectMessageLengthOrInvalidFormat);
                }
                for id in rest.chunks_exact(2) {
                    let before = self.out.len();
                    put(self.out, id)?;
                    match self.read(id.try_into().map_or(0, u16::from_be_bytes)) {
                        // An unknown identifier is left out, unless all are unknown.
                        Err(Nrc::RequestOutOfRange) => self.out.truncate(before),
                        read => read?,
                    }
                }
                if self.out.len() > 1 { Ok(()) } else { Err(Nrc::RequestOutOfRange) }
            }
            UdsCommand::WriteDataByIdentifier => {
                let id = rest.split_first_chunk().filter(|(_, bytes)| !bytes.is_empty());
                let ([high, low], bytes) = id.ok_or(Nrc::IncorrectMessageLengthOrInvalidFormat)?;
                let id = u16::from_be_bytes([*high, *low]);
                if !is_writable(id) {
                    return Err(Nrc::RequestOutOfRange);
                }
                let (content, counter) = self.signed(id, bytes)?;
                match id {
                    UPDATE => self.begin_update(content, counter)?,
                    0x0110 => {
                        self.services.update = None;
                        self.use_up(counter)?;
                        self.write_key(content)?;
                    }
                    _ => {
                        self.use_up(counter)?;
                        self.write(id, content)?;
                    }
                }
                put(self.out, &[*high, *low])
            }
            UdsCommand::RequestDownload => {
                self.services.download = None;
                self.services.download = Some(self.begin_download(rest)?);
                Ok(())
            }
            UdsCommand::TransferData => {
                let (&number, bytes) =
                    rest.split_first().ok_or(Nrc::IncorrectMessageLengthOrInvalidFormat)?;
                self.download_block(number, bytes)
            }
            UdsCommand::RequestTransferExit => {
                let [] = exactly(rest)?;
                self.finish_download()
            }
            _ => Err(Nrc::ServiceNotSupported),
        }
    }

    /// Checks the head of a firmware update, and keeps it for the download.
    #[inline(never)]
    fn begin_update(&mut self, head: &[u8], counter: Option<u32>) -> Result<(), Nrc> {
        (self.services.download, self.services.update) = (None, None);
        let head = head.try_into().ok().and_then(Head::parse);
        let head = head.ok_or_else(|| self.refuse(FirmwareError::NotAnUpdate))?;
        let slot = self.device.firmware_check(&head.label, head.downgrade).map_err(nrc)?;
        let length = slot.of(head.images).length;
        if length > MAX_IMAGE {
            return Err(self.refuse(FirmwareError::Length(length)));
        }
        self.services.update = Some((head, counter));
        Ok(())
    }
}
