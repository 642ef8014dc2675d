//! The server answers the requests of a tester (ISO 14229-1).
//!
//! It translates services to the requests that the device knows, so that what is refused on one line is refused on the
//! other. What may write or silence the output needs a session other than the default one, and a vehicle that is
//! proven to stand. Before such a request is executed, "response pending" goes out: an erase stalls the processor for
//! longer than a tester waits.

use super::data::{self, Sources};
use super::download::Download;
use super::dtc::{Memory, bit};
use super::isotp::{Bytes, Transport, TransportErrors};
use super::response::{Nrc, Response, exactly, nrc, put};
use crate::service::calibrate::{State, Task};
use crate::service::message::{AllCounters, Calibrate, Request};
use crate::service::{Device, MappedSlots};
use automotive_diag::uds::{DtcSubFunction, ResetType, RoutineControlType, UdsCommand};
use embedded_storage::nor_flash::NorFlash;

/// Longest silence of a tester in a session other than the default one, ms (S3).
const SESSION_MS: u32 = 5_000;
/// Longest time to a response, ms, and to one after "response pending", 10 ms (P2, P2*).
const P2_MS: u16 = 50;
const P2_STAR_10_MS: u16 = 500;
/// In a sub-function: no positive response is wanted.
const SUPPRESS: u8 = 0x80;

/// A diagnostic session.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
pub enum Session {
    /// Data and troubles can be read.
    Default = 1,
    /// Weights can be downloaded, too.
    Programming = 2,
    /// Settings can be written, and routines run.
    Extended = 3,
}

/// Answers one tester.
#[derive(Debug)]
pub struct Server {
    transport: Transport,
    services: Services,
    /// "Response pending" has been sent for the request.
    is_pending: bool,
}

impl Default for Server {
    fn default() -> Self {
        Self::new()
    }
}

impl Server {
    /// Begins in the default session.
    #[must_use]
    pub const fn new() -> Self {
        let services = Services {
            session: Session::Default,
            heard: 0,
            is_functional: false,
            memory: Memory::new(),
            is_restored: false,
            is_silenced: false,
            is_restarting: false,
            download: None,
        };
        Self { transport: Transport::new(), services, is_pending: false }
    }

    /// Takes the data of a frame to this server's own identifier.
    pub fn receive(&mut self, data: &[u8], now: u32) {
        self.services.hear(now);
        self.transport.receive(data, now);
    }

    /// Counts a frame of a tester that has to wait: another one is being served.
    pub fn refuse(&mut self) {
        self.transport.refuse();
    }

    /// Takes the data of a frame to all servers: one frame is the whole request. While another one is being answered
    /// it only keeps the session.
    pub fn receive_functional(&mut self, data: &[u8], now: u32) {
        self.services.hear(now);
        if self.transport.is_idle() && data.first().is_some_and(|head| *head < 0x10) {
            self.transport.receive(data, now);
            self.services.is_functional = self.transport.request().is_some();
        } else if data.get(1) != Some(&(UdsCommand::TesterPresent as u8)) {
            self.refuse();
        }
    }

    /// Returns the next frame that is due, for the bus.
    pub fn next_frame(&mut self, now: u32) -> Option<Bytes> {
        self.transport.next_frame(now)
    }

    /// Returns whether nothing is being received, answered or sent.
    #[must_use]
    pub fn is_idle(&self) -> bool {
        self.transport.is_idle()
    }

    /// Returns whether a tester has stopped the messages of the board.
    #[must_use]
    pub fn is_silenced(&self) -> bool {
        self.services.is_silenced
    }

    /// Returns whether a tester has asked for a restart and has its response.
    #[must_use]
    pub fn restart_is_due(&self) -> bool {
        self.services.is_restarting && self.is_idle()
    }

    /// Notes present faults, ends what has timed out, and answers a request.
    pub fn turn<R: NorFlash, W: MappedSlots>(
        &mut self,
        device: &mut Device<R, W>,
        counters: &AllCounters,
        now: u32,
    ) {
        self.transport.expire(now);
        let services = &mut self.services;
        services.remember(device);
        services.expire(now);
        if let Some(request) = self.transport.request()
            && !self.is_pending
            && services.takes_long(request)
        {
            let service = request.first().copied().unwrap_or(0);
            self.is_pending = true;
            let pending = Nrc::RequestCorrectlyReceivedResponsePending as u8;
            self.transport.interim(&[NEGATIVE, service, pending]);
            return;
        }
        let (is_pending, errors) = (self.is_pending, self.transport.errors());
        let answered = self.transport.answer(|request, out| {
            services.answer(request, device, counters, errors, is_pending, out);
        });
        if answered {
            self.is_pending = false;
            services.is_functional = false;
            services.heard = now;
        }
    }
}

/// First byte of a negative response.
const NEGATIVE: u8 = 0x7F;
/// Added to a service's number in a positive response.
const POSITIVE: u8 = 0x40;

/// The state between requests.
#[derive(Debug)]
struct Services {
    session: Session,
    /// The time of the tester's last frame, ms.
    heard: u32,
    /// The request came for all servers.
    is_functional: bool,
    memory: Memory,
    /// The memory has taken over what was stored before the start.
    is_restored: bool,
    /// The messages of the board are stopped.
    is_silenced: bool,
    /// A tester has asked for a restart.
    is_restarting: bool,
    download: Option<Download>,
}

impl Services {
    /// Ends a session in which the tester has been silent for too long.
    fn expire(&mut self, now: u32) {
        if self.session != Session::Default && now.wrapping_sub(self.heard) > SESSION_MS {
            self.enter(Session::Default);
        }
    }

    fn hear(&mut self, now: u32) {
        self.expire(now);
        self.heard = now;
    }

    /// Notes present faults, and stores those that are new.
    fn remember<R: NorFlash, W: MappedSlots>(&mut self, device: &mut Device<R, W>) {
        if !core::mem::replace(&mut self.is_restored, true) {
            self.memory.restore(device.troubles());
        }
        self.memory.observe(&device.conditions());
        if self.memory.is_changed {
            let in_workshop = self.session != Session::Default;
            self.memory.is_changed = !device.store_troubles(&self.memory.confirmed(), in_workshop);
        }
    }

    fn enter(&mut self, session: Session) {
        self.session = session;
        self.download = None;
        if session == Session::Default {
            self.memory.is_enabled = true;
            self.is_silenced = false;
        }
    }

    /// Returns whether a request may erase the flash.
    fn takes_long(&self, request: &[u8]) -> bool {
        self.session != Session::Default
            && matches!(request, [0x2E | 0x34, ..] | [0x31, 1, 0x02, 0x02] | [0x31, 1, 0xFF, 0x01])
    }

    fn answer<R: NorFlash, W: MappedSlots>(
        &mut self,
        request: &[u8],
        device: &mut Device<R, W>,
        counters: &AllCounters,
        errors: TransportErrors,
        is_pending: bool,
        out: &mut Response,
    ) {
        let Some((&service, rest)) = request.split_first() else { return };
        // Room for a byte.
        let _ = out.push(service.wrapping_add(POSITIVE));
        match self.serve(service, rest, device, counters, errors, out) {
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
        counters: &AllCounters,
        errors: TransportErrors,
        out: &mut Response,
    ) -> Result<bool, Nrc> {
        let command = UdsCommand::from_repr(service).ok_or(Nrc::ServiceNotSupported)?;
        match command {
            UdsCommand::DiagnosticSessionControl => {
                let [sub] = exactly(rest)?;
                let session = match sub & !SUPPRESS {
                    1 => Session::Default,
                    2 => Session::Programming,
                    3 => Session::Extended,
                    _ => return Err(Nrc::SubFunctionNotSupported),
                };
                self.enter(session);
                let [[a, b], [c, d]] = [P2_MS.to_be_bytes(), P2_STAR_10_MS.to_be_bytes()];
                put(out, &[session as u8, a, b, c, d])?;
                Ok(sub & SUPPRESS == 0)
            }
            UdsCommand::ECUReset => {
                let [sub] = exactly(rest)?;
                let reset = ResetType::from_repr(sub & !SUPPRESS);
                if !matches!(reset, Some(ResetType::HardReset | ResetType::SoftReset)) {
                    return Err(Nrc::SubFunctionNotSupported);
                }
                device.act(&Request::Restart).map_err(nrc)?;
                self.is_restarting = true;
                put(out, &[sub & !SUPPRESS])?;
                Ok(sub & SUPPRESS == 0)
            }
            UdsCommand::TesterPresent => {
                let [sub] = exactly(rest)?;
                if sub & !SUPPRESS != 0 {
                    return Err(Nrc::SubFunctionNotSupported);
                }
                put(out, &[0])?;
                Ok(sub & SUPPRESS == 0)
            }
            UdsCommand::CommunicationControl => {
                self.needs(Session::Extended)?;
                let [sub, what] = exactly(rest)?;
                let is_silenced = match sub & !SUPPRESS {
                    0 => false,
                    1 => true,
                    _ => return Err(Nrc::SubFunctionNotSupported),
                };
                // Normal messages, or they and those of a network management that this board has not got.
                if !matches!(what, 1 | 3) {
                    return Err(Nrc::RequestOutOfRange);
                }
                if is_silenced && !device.may_interrupt() {
                    return Err(Nrc::ConditionsNotCorrect);
                }
                self.is_silenced = is_silenced;
                put(out, &[sub & !SUPPRESS])?;
                Ok(sub & SUPPRESS == 0)
            }
            UdsCommand::ControlDTCSetting => {
                self.needs(Session::Extended)?;
                let sub = *rest.first().ok_or(Nrc::IncorrectMessageLengthOrInvalidFormat)?;
                self.memory.is_enabled = match sub & !SUPPRESS {
                    1 => true,
                    2 => false,
                    _ => return Err(Nrc::SubFunctionNotSupported),
                };
                put(out, &[sub & !SUPPRESS])?;
                Ok(sub & SUPPRESS == 0)
            }
            UdsCommand::ClearDiagnosticInformation => {
                let [a, b, c] = exactly(rest)?;
                let is_known = self.memory.clear(u32::from_be_bytes([0, a, b, c]));
                if is_known { Ok(true) } else { Err(Nrc::RequestOutOfRange) }
            }
            UdsCommand::ReadDTCInformation => self.read_troubles(rest, out).map(|()| true),
            UdsCommand::ReadDataByIdentifier => {
                if rest.is_empty() || !rest.len().is_multiple_of(2) {
                    return Err(Nrc::IncorrectMessageLengthOrInvalidFormat);
                }
                let session = self.session as u8;
                let sources = Sources { device: &*device, counters, session, errors };
                for id in rest.chunks_exact(2) {
                    put(out, id)?;
                    let id = id.try_into().map_or(0, u16::from_be_bytes);
                    data::read(id, &sources, out)?;
                }
                Ok(true)
            }
            UdsCommand::WriteDataByIdentifier => {
                self.needs(Session::Extended)?;
                let [high, low, bytes @ ..] = rest else {
                    return Err(Nrc::IncorrectMessageLengthOrInvalidFormat);
                };
                let request = data::write(u16::from_be_bytes([*high, *low]), bytes)?;
                device.act(&request).map_err(nrc)?;
                put(out, &[*high, *low])?;
                Ok(true)
            }
            UdsCommand::RoutineControl => self.routine(rest, device, out),
            UdsCommand::RequestDownload => {
                self.needs(Session::Programming)?;
                self.download = None;
                self.download = Some(Download::begin(rest, device, out)?);
                Ok(true)
            }
            UdsCommand::TransferData => {
                self.needs(Session::Programming)?;
                let download = self.download.as_mut().ok_or(Nrc::RequestSequenceError)?;
                download.block(rest, device, out)?;
                Ok(true)
            }
            UdsCommand::RequestTransferExit => {
                self.needs(Session::Programming)?;
                if !rest.is_empty() {
                    return Err(Nrc::IncorrectMessageLengthOrInvalidFormat);
                }
                let download = self.download.as_mut().ok_or(Nrc::RequestSequenceError)?;
                download.finish(device)?;
                self.download = None;
                Ok(true)
            }
            _ => Err(Nrc::ServiceNotSupported),
        }
    }

    /// Refuses a service that this session does not have.
    fn needs(&self, session: Session) -> Result<(), Nrc> {
        let has =
            self.session == session || (self.session, session) == (Session::Programming, Session::Extended);
        if has { Ok(()) } else { Err(Nrc::ServiceNotSupportedInActiveSession) }
    }

    fn read_troubles(&self, rest: &[u8], out: &mut Response) -> Result<(), Nrc> {
        let length = Nrc::IncorrectMessageLengthOrInvalidFormat;
        let (&sub, rest) = rest.split_first().ok_or(length)?;
        let code = |code: u32| {
            let [_, a, b, c] = code.to_be_bytes();
            [a, b, c]
        };
        put(out, &[sub])?;
        match DtcSubFunction::from_repr(sub) {
            Some(DtcSubFunction::ReportNumberOfDtcByStatusMask) => {
                let [mask] = exactly(rest)?;
                let matching = self.memory.entries().filter(|(_, entry)| entry.status & mask != 0).count();
                // The codes are those of SAE J2012-DA, with a failure type.
                put(out, &[bit::AVAILABLE, 0, 0, matching as u8])
            }
            Some(sub @ (DtcSubFunction::ReportDtcByStatusMask | DtcSubFunction::ReportSupportedDtc)) => {
                let mask = match sub {
                    DtcSubFunction::ReportDtcByStatusMask => exactly(rest).map(|[mask]| Some(mask))?,
                    _ => exactly(rest).map(|[]: [u8; 0]| None)?,
                };
                put(out, &[bit::AVAILABLE])?;
                let chosen = |status: u8| mask.is_none_or(|mask| status & mask != 0);
                for (trouble, entry) in self.memory.entries().filter(|(_, entry)| chosen(entry.status)) {
                    put(out, &code(trouble.code))?;
                    put(out, &[entry.status])?;
                }
                Ok(())
            }
            Some(DtcSubFunction::ReportDtcSnapshotRecordByDtcNumber) => {
                let [a, b, c, record] = exactly(rest)?;
                let wanted = u32::from_be_bytes([0, a, b, c]);
                let known = self.memory.entries().find(|(trouble, _)| trouble.code == wanted);
                let (_, entry) =
                    known.filter(|_| matches!(record, 1 | 0xFF)).ok_or(Nrc::RequestOutOfRange)?;
                put(out, &[a, b, c, entry.status])?;
                if entry.status & bit::CONFIRMED == 0 {
                    return Ok(());
                }
                // One record of two data identifiers.
                put(out, &[1, 2, 0x01, 0x04, entry.snapshot.status, entry.snapshot.faults, 0x01, 0x08])?;
                put(out, &entry.snapshot.tick.to_be_bytes())
            }
            Some(DtcSubFunction::ReportDtcExtendedDataRecordByDtcNumber) => {
                let [a, b, c, record] = exactly(rest)?;
                let wanted = u32::from_be_bytes([0, a, b, c]);
                let known = self.memory.entries().find(|(trouble, _)| trouble.code == wanted);
                let (_, entry) =
                    known.filter(|_| matches!(record, 1 | 0xFF)).ok_or(Nrc::RequestOutOfRange)?;
                put(out, &[a, b, c, entry.status, 1, entry.occurrences])
            }
            _ => Err(Nrc::SubFunctionNotSupported),
        }
    }

    /// Runs a routine; its number and, for a calibration, its state are the response.
    fn routine<R: NorFlash, W: MappedSlots>(
        &mut self,
        rest: &[u8],
        device: &mut Device<R, W>,
        out: &mut Response,
    ) -> Result<bool, Nrc> {
        self.needs(Session::Extended)?;
        let [sub, high, low] = exactly(rest)?;
        let id = u16::from_be_bytes([high, low]);
        let control = RoutineControlType::from_repr(sub & !SUPPRESS).ok_or(Nrc::SubFunctionNotSupported)?;
        let task = match id {
            0x0200 => Some(Task::Static),
            0x0201 => Some(Task::Mounting),
            _ => None,
        };
        put(out, &[sub & !SUPPRESS, high, low])?;
        match (id, task, control) {
            (_, Some(task), RoutineControlType::StartRoutine) => {
                device.act(&Request::Calibrate(Calibrate::Start(task))).map_err(nrc)?;
            }
            (_, Some(_), RoutineControlType::StopRoutine) => {
                device.act(&Request::Calibrate(Calibrate::Cancel)).map_err(nrc)?;
            }
            (_, Some(task), RoutineControlType::RequestRoutineResult) => {
                let state = match device.calibration_state() {
                    State::Running(of) if of == task => 1,
                    State::Found(of) if of == task => 2,
                    State::Failed(of, _) if of == task => 3,
                    _ => return Err(Nrc::RequestSequenceError),
                };
                put(out, &[state])?;
            }
            (0x0202, None, RoutineControlType::StartRoutine) => {
                device.act(&Request::Calibrate(Calibrate::Store)).map_err(nrc)?;
            }
            (0xFF01, None, RoutineControlType::StartRoutine) => {
                self.needs(Session::Programming)?;
                device.act(&Request::WeightsActivate).map_err(nrc)?;
            }
            (0x0202 | 0xFF01, None, _) => return Err(Nrc::SubFunctionNotSupported),
            _ => return Err(Nrc::RequestOutOfRange),
        }
        Ok(sub & SUPPRESS == 0)
    }
}
