//! These are the services (ISO 14229-1) and the state between two requests.
//!
//! They translate requests to those that the device knows, so that all lines refuse the same. A request that writes or
//! silences the output needs a session other than the default one, and a vehicle that is proven to stand.

use super::data::{self, Sources};
use super::download::Download;
use super::dtc::Memory;
use super::isotp::TransportErrors;
use super::response::{Nrc, Response, exactly, put};
use super::security::{self, Security, Seed};
use super::session::{self, Session};
use super::troubles;
use crate::service::message::AllCounters;
use crate::service::{Device, MappedSlots};
use automotive_diag::uds::UdsCommand;
use embedded_storage::nor_flash::NorFlash;

/// Longest silence of a tester in a session other than the default one, ms (S3).
const SESSION_MS: u32 = 5_000;
/// This bit of a sub-function suppresses the positive response.
const SUPPRESS: u8 = 0x80;

/// First byte of a negative response.
pub const NEGATIVE: u8 = 0x7F;
/// Added to a service's number in a positive response.
const POSITIVE: u8 = 0x40;

/// The state between requests.
#[derive(Debug)]
pub(super) struct Services {
    session: Session,
    /// The time of the tester's last frame, ms.
    pub heard: u32,
    /// The request came for all servers.
    pub is_functional: bool,
    pub(super) memory: Memory,
    /// The memory has taken over what was stored before the start.
    is_restored: bool,
    /// The messages of the board are stopped.
    pub is_silenced: bool,
    /// A tester has asked for a restart.
    pub is_restarting: bool,
    pub(super) download: Option<Download>,
    pub(super) security: Security,
}

/// Holds what answers need beside the device.
pub(super) struct Surroundings<'a, E> {
    pub counters: &'a AllCounters,
    pub errors: TransportErrors,
    /// "Response pending" has been sent.
    pub is_pending: bool,
    /// The time, ms.
    pub now: u32,
    /// Gives a challenge that nobody can know before; `None` where there are no random numbers.
    pub entropy: E,
}

impl Services {
    /// Begins in the default session.
    pub const fn new() -> Self {
        Self {
            session: Session::Default,
            heard: 0,
            is_functional: false,
            memory: Memory::new(),
            is_restored: false,
            is_silenced: false,
            is_restarting: false,
            download: None,
            security: Security::new(),
        }
    }

    /// Ends a session in which the tester has been silent for too long.
    pub fn expire(&mut self, now: u32) {
        if self.session != Session::Default && now.wrapping_sub(self.heard) > SESSION_MS {
            self.enter(Session::Default);
        }
    }

    /// Notes that the tester is there.
    pub fn hear(&mut self, now: u32) {
        self.expire(now);
        self.heard = now;
    }

    /// Notes present faults, and stores those that are new.
    #[inline(never)]
    pub fn remember<R: NorFlash, W: MappedSlots>(&mut self, device: &mut Device<R, W>) {
        if !core::mem::replace(&mut self.is_restored, true) {
            self.memory.restore(device.troubles());
        }
        device.store_what_was_learnt();
        self.memory.observe(&device.conditions());
        if self.memory.is_changed {
            let in_workshop = self.session != Session::Default;
            self.memory.is_changed = !device.store_troubles(&self.memory.confirmed(), in_workshop);
        }
    }

    pub(super) fn enter(&mut self, session: Session) {
        self.session = session;
        self.download = None;
        self.security.end();
        if session == Session::Default {
            self.memory.is_enabled = true;
            self.is_silenced = false;
        }
    }

    /// Returns whether a request may erase the flash, or checks a whole file.
    pub fn takes_long(&self, request: &[u8]) -> bool {
        self.session != Session::Default
            && matches!(
                request,
                [0x2E | 0x34 | 0x37, ..]
                    | [0x27, 2 | 0x82, ..]
                    | [0x31, 1, 0x02, 0x02 | 0x05]
                    | [0x31, 1, 0xFF, 0x01, ..]
            )
            || matches!(request, [0x36, ..]) && self.download.as_ref().is_some_and(Download::erases_next)
    }

    /// Writes the response to a request; nothing where none is wanted.
    pub fn answer<R: NorFlash, W: MappedSlots>(
        &mut self,
        request: &[u8],
        device: &mut Device<R, W>,
        surroundings: Surroundings<'_, impl FnOnce() -> Option<Seed>>,
        out: &mut Response,
    ) {
        let Some((&service, rest)) = request.split_first() else { return };
        let is_pending = surroundings.is_pending;
        // Room for a byte.
        let _ = out.push(service.wrapping_add(POSITIVE));
        match self.serve(service, rest, device, surroundings, out) {
            Ok(true) => {}
            // A tester that has read "response pending" waits for the response.
            Ok(false) if is_pending => {}
            Ok(false) => out.clear(),
            Err(nrc) => {
                out.clear();
                let is_silent = self.is_functional
                    && matches!(
                        nrc,
                        Nrc::ServiceNotSupported
                            | Nrc::SubFunctionNotSupported
                            | Nrc::RequestOutOfRange
                            | Nrc::SubFunctionNotSupportedInActiveSession
                            | Nrc::ServiceNotSupportedInActiveSession
                    );
                if !is_silent || is_pending {
                    let _ = out.extend_from_slice(&[NEGATIVE, service, nrc as u8]);
                }
            }
        }
    }

    /// Executes a service. Returns whether a positive response is wanted.
    #[inline(never)]
    fn serve<R: NorFlash, W: MappedSlots>(
        &mut self,
        service: u8,
        rest: &[u8],
        device: &mut Device<R, W>,
        surroundings: Surroundings<'_, impl FnOnce() -> Option<Seed>>,
        out: &mut Response,
    ) -> Result<bool, Nrc> {
        let command = UdsCommand::from_repr(service).ok_or(Nrc::ServiceNotSupported)?;
        if command != UdsCommand::ReadDataByIdentifier {
            device.forget_refusal();
        }
        self.needs(session::needed(command, rest))?;
        if !session::has_sub_function(command) {
            return self.serve_data(command, rest, device, surroundings, out).map(|()| true);
        }
        let (&sub, rest) = rest.split_first().ok_or(Nrc::IncorrectMessageLengthOrInvalidFormat)?;
        let (sub, is_wanted) = (sub & !SUPPRESS, sub & SUPPRESS == 0);
        put(out, &[sub])?;
        let Surroundings { now, entropy, .. } = surroundings;
        match command {
            UdsCommand::DiagnosticSessionControl => self.session_control(sub, rest, out),
            UdsCommand::ECUReset => self.reset(sub, rest, device),
            UdsCommand::TesterPresent => Self::tester_present(sub, rest),
            UdsCommand::CommunicationControl => self.communication_control(sub, rest, device),
            UdsCommand::ControlDTCSetting => self.dtc_setting(sub, device),
            UdsCommand::ReadDTCInformation => troubles::read(&self.memory, sub, rest, out),
            UdsCommand::SecurityAccess => self.security.access(sub, rest, device, (now, entropy), out),
            _ => self.routine(sub, rest, device, entropy, out),
        }?;
        Ok(is_wanted)
    }

    /// Executes a service without sub-functions.
    fn serve_data<R: NorFlash, W: MappedSlots, E>(
        &mut self,
        command: UdsCommand,
        rest: &[u8],
        device: &mut Device<R, W>,
        surroundings: Surroundings<'_, E>,
        out: &mut Response,
    ) -> Result<(), Nrc> {
        match command {
            UdsCommand::ClearDiagnosticInformation => self.clear_troubles(rest, device),
            UdsCommand::ReadDataByIdentifier => {
                if rest.is_empty() || !rest.len().is_multiple_of(2) {
                    return Err(Nrc::IncorrectMessageLengthOrInvalidFormat);
                }
                let Surroundings { counters, errors, .. } = surroundings;
                let session = self.session as u8;
                let security = &self.security;
                let sources = Sources { device: &*device, counters, session, security, errors };
                for id in rest.chunks_exact(2) {
                    put(out, id)?;
                    let id = id.try_into().map_or(0, u16::from_be_bytes);
                    data::read(id, &sources, out)?;
                }
                Ok(())
            }
            UdsCommand::WriteDataByIdentifier => {
                let [high, low, bytes @ ..] = rest else {
                    return Err(Nrc::IncorrectMessageLengthOrInvalidFormat);
                };
                let id = u16::from_be_bytes([*high, *low]);
                let content = security::signed(id, bytes, device)?;
                match id {
                    0x0110 => self.security.write_key(content, device)?,
                    _ => data::write(id, content, device)?,
                }
                put(out, &[*high, *low])
            }
            UdsCommand::RequestDownload => {
                self.download = None;
                self.download = Some(Download::begin(rest, device, out)?);
                Ok(())
            }
            UdsCommand::TransferData => self.under_way()?.block(rest, device, out),
            UdsCommand::RequestTransferExit => {
                let [] = exactly(rest)?;
                self.under_way()?.finish(device, out)
            }
            _ => Err(Nrc::ServiceNotSupported),
        }
    }

    /// Returns the download that has begun.
    fn under_way(&mut self) -> Result<&mut Download, Nrc> {
        self.download.as_mut().ok_or(Nrc::RequestSequenceError)
    }

    /// Refuses what this session does not have.
    pub(super) fn needs(&self, session: Session) -> Result<(), Nrc> {
        let has = session == Session::Default
            || self.session == session
            || (self.session, session) == (Session::Programming, Session::Extended);
        if has { Ok(()) } else { Err(Nrc::ServiceNotSupportedInActiveSession) }
    }
}
