//! Dispatches the services (ISO 14229-1) and holds the state between requests.
//!
//! A request is checked in this order, and the first check that fails gives the code: service, session, least length,
//! sub-function, access, length, values, conditions. Services translate requests to those of the device, so that the
//! same rules apply on all lines. One that writes data or silences the output needs a non-default session and a
//! standstill.

use super::download::Download;
use super::dtc::Memory;
use super::isotp::TransportErrors;
use super::response::{Nrc, Response, exactly, nrc, put};
use super::security::{Security, Seed};
use super::session::{self, Session};
use super::signature::Digest;
use super::update::Head;
use super::{data, troubles};
use crate::service::message::{AllCounters, Refusal};
use crate::service::{Device, MappedSlots};
use crate::store::firmware::{FirmwareError, MAX_IMAGE};
use automotive_diag::uds::UdsCommand;
use embedded_storage::nor_flash::NorFlash;

/// Session timeout: longest silence of a tester in a non-default session, ms (S3).
const SESSION_MS: u32 = 5_000;
/// Time after a stall of the board in which the faults that it causes end, ms.
const SETTLE_MS: u32 = 1_000;
/// Data identifier of the firmware: its state, and the head of an update.
pub(super) const UPDATE: u16 = 0x011A;
/// Bit of a sub-function that suppresses the positive response.
const SUPPRESS: u8 = 0x80;

pub const NEGATIVE: u8 = 0x7F;
/// Offset from the service identifier of a request to that of a positive response.
const POSITIVE: u8 = 0x40;

#[derive(Debug)]
pub(super) struct Services {
    session: Session,
    /// Time of the tester's last frame, or of the last response, ms.
    pub last_activity: u32,
    pub is_functional: bool,
    /// True if the session is another tester's: this one is served as in the default session, and cannot end it.
    pub is_guest: bool,
    pub(super) memory: Memory,
    is_restored: bool,
    /// Time until which faults may come from the board's own stall, ms.
    settles_at: Option<u32>,
    pub is_silenced: bool,
    pub is_restarting: bool,
    pub(super) download: Option<Download>,
    /// Head of a firmware update, and the counter of its signature.
    pub(super) update: Option<(Head, Option<u32>)>,
    pub(super) security: Security,
}

/// A request that is answered: what the services work on.
pub(super) struct Exchange<'a, R: NorFlash, W, E> {
    pub services: &'a mut Services,
    pub device: &'a mut Device<R, W>,
    pub out: &'a mut Response,
    pub counters: &'a AllCounters,
    pub errors: TransportErrors,
    pub is_pending: bool,
    pub now: u32,
    /// Source of an unpredictable challenge; it returns `None` if there are no random numbers.
    pub entropy: E,
}

impl Services {
    pub const fn new() -> Self {
        Self {
            session: Session::Default,
            last_activity: 0,
            is_functional: false,
            is_guest: false,
            memory: Memory::START,
            is_restored: false,
            settles_at: None,
            is_silenced: false,
            is_restarting: false,
            download: None,
            update: None,
            security: Security::new(),
        }
    }

    /// Ends the session if the tester has been silent for longer than [`SESSION_MS`].
    pub fn expire(&mut self, now: u32) {
        if self.session != Session::Default && now.wrapping_sub(self.last_activity) > SESSION_MS {
            self.enter(Session::Default);
        }
    }

    pub fn frame_received(&mut self, now: u32) {
        self.expire(now);
        if !self.is_guest {
            self.last_activity = now;
        }
    }

    pub fn has_session(&self) -> bool {
        self.session != Session::Default
    }

    /// Returns the session of the tester that is being served.
    pub fn session(&self) -> Session {
        if self.is_guest { Session::Default } else { self.session }
    }

    /// Records that the board has stalled until now, for a request: the tester could not be heard meanwhile.
    pub fn stalled(&mut self, now: u32) {
        self.last_activity = now;
        self.settles_at = Some(now.wrapping_add(SETTLE_MS));
    }

    /// Records faults, and stores new ones, erasing if `may_erase`. Ends the silence once the vehicle may move.
    #[inline(never)]
    pub fn update_troubles<R: NorFlash, W: MappedSlots>(
        &mut self,
        device: &mut Device<R, W>,
        now: u32,
        may_erase: bool,
    ) {
        if !core::mem::replace(&mut self.is_restored, true) {
            self.memory.restore(device.troubles());
        }
        self.is_silenced &= device.may_interrupt();
        device.store_learned_if_due();
        self.settles_at = self.settles_at.filter(|until| (now.wrapping_sub(*until) as i32) < 0);
        self.memory.observe_changes(&device.conditions(), self.settles_at.is_some() || may_erase);
        if self.memory.is_changed {
            self.memory.is_changed = !device.store_troubles(&self.memory.confirmed(), may_erase);
        }
    }

    pub(super) fn enter(&mut self, session: Session) {
        self.session = session;
        (self.download, self.update) = (None, None);
        self.security.end();
        if session == Session::Default {
            self.memory.is_enabled = true;
            self.is_silenced = false;
        }
    }

    /// Returns whether a request erases flash, checks a file or stores troubles, but not for "tester present".
    pub fn takes_long<R: NorFlash, W: MappedSlots>(&self, request: &[u8], device: &Device<R, W>) -> bool {
        let erases = || {
            let is_heard = !self.is_functional && !matches!(request, [0x3E, ..]);
            self.memory.is_changed && is_heard && device.troubles_want_erase()
        };
        self.session() != Session::Default
            && (matches!(
                request,
                [0x2E | 0x34 | 0x37, ..]
                    | [0x27, 2 | 0x82, ..]
                    | [0x31, 1, 0x02, 0x02 | 0x05]
                    | [0x31, 1, 0xFF, 0x01, ..]
            ) || erases())
    }

    pub(super) fn require_session(&self, session: Session) -> Result<(), Nrc> {
        let own = self.session();
        let has = session == Session::Default
            || own == session
            || (own, session) == (Session::Programming, Session::Extended);
        if has { Ok(()) } else { Err(Nrc::ServiceNotSupportedInActiveSession) }
    }
}

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

    /// Keeps the reason why a request is refused, and returns the code of the response.
    pub(super) fn refuse(&mut self, refusal: impl Into<Refusal>) -> Nrc {
        nrc(self.device.refuse_request(refusal.into()))
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
                if !data::is_writable(id) {
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
        let Digest { length, .. } = slot.of(head.images);
        if length > MAX_IMAGE {
            return Err(self.refuse(FirmwareError::Length(length)));
        }
        self.services.update = Some((head, counter));
        Ok(())
    }
}
