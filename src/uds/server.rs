//! The server passes requests from the transport to the services, and responses back.
//!
//! Before a request that may erase flash it sends "response pending", because an erase stalls the processor for longer
//! than a tester waits. Troubles that must be stored with an erase wait for such a request. The faults that the erase
//! causes on the board itself are no troubles.

use super::exchange::{Exchange, Services};
use super::isotp::{Bytes, Transport};
use super::lock::Seed;
use super::response::Nrc;
use super::services::NEGATIVE;
use crate::service::message::AllCounters;
use crate::service::{Device, MappedSlots};
use automotive_diag::uds::UdsCommand;
use embedded_storage::nor_flash::NorFlash;

/// The diagnostic server for one tester at a time.
#[derive(Debug)]
pub struct Server {
    transport: Transport,
    services: Services,
    /// True if "response pending" has been sent for the request.
    is_pending: bool,
    /// True if the last request may have stalled the board: time has passed since the last poll.
    has_stalled: bool,
}

impl Default for Server {
    fn default() -> Self {
        Self::new()
    }
}

impl Server {
    /// Creates a server in the default session.
    pub const fn new() -> Self {
        let services = Services::new();
        Self { transport: Transport::IDLE, services, is_pending: false, has_stalled: false }
    }

    /// Processes the data of a frame received on this server's own identifier.
    pub fn receive(&mut self, data: &[u8], now: u32) {
        self.services.frame_received(now);
        self.transport.receive(data, now);
    }

    /// Returns whether a tester has a session other than the default one.
    pub fn has_session(&self) -> bool {
        self.services.has_session()
    }

    /// Sets whether the next frames are another tester's than the session's, which may only read and not end it.
    pub fn set_guest(&mut self, is_guest: bool) {
        self.services.is_guest = is_guest;
    }

    /// Counts a frame of a tester that is refused because another tester is being served. If the session is its own, it
    /// lasts.
    pub fn refuse(&mut self, is_owner: bool, now: u32) {
        if is_owner && self.has_session() {
            self.services.last_activity = now;
        }
        self.transport.refuse();
    }

    /// Takes a request to all servers, one frame. While another is being answered, it only keeps the session.
    pub fn receive_functional(&mut self, data: &[u8], now: u32) {
        self.services.frame_received(now);
        if self.transport.is_idle() && data.first().is_some_and(|head| *head < 0x10) {
            self.transport.receive(data, now);
            self.services.is_functional = self.transport.request().is_some();
        } else if data.get(1) != Some(&(UdsCommand::TesterPresent as u8)) {
            self.transport.refuse();
        }
    }

    /// Notes that all frames have left by `now`, ms: the tester's separation time begins.
    pub fn frames_left(&mut self, now: u32) {
        self.transport.frames_left(now);
    }

    /// Returns the next frame to send, if one is due. Call [`Self::frames_left`] once it has left.
    pub fn next_frame(&mut self, now: u32) -> Option<Bytes> {
        self.transport.next_frame(now)
    }

    /// Returns whether nothing is being received, answered or sent.
    pub fn is_idle(&self) -> bool {
        self.transport.is_idle()
    }

    /// Returns whether a tester has stopped the messages of the board.
    pub fn is_silenced(&self) -> bool {
        self.services.is_silenced
    }

    /// Returns whether a tester has requested a restart and its response has been sent.
    pub fn restart_is_due(&self) -> bool {
        self.services.is_restarting && self.is_idle()
    }

    /// Does the periodic work: faults, timeouts, a complete request; `entropy` is a random challenge, if any.
    pub fn poll<R: NorFlash, W: MappedSlots>(
        &mut self,
        device: &mut Device<R, W>,
        counters: impl FnOnce() -> AllCounters,
        now: u32,
        entropy: impl FnMut() -> Option<Seed>,
    ) {
        self.transport.expire(now);
        let services = &mut self.services;
        if core::mem::take(&mut self.has_stalled) {
            services.stalled(now);
        }
        services.update_troubles(device, now, self.is_pending);
        services.expire(now);
        if let Some(request) = self.transport.request()
            && !self.is_pending
            && services.takes_long(request, device)
        {
            let service = request.first().copied().unwrap_or(0);
            self.is_pending = true;
            let pending = Nrc::RequestCorrectlyReceivedResponsePending as u8;
            self.transport.interim(&[NEGATIVE, service, pending]);
            return;
        }
        let (is_pending, errors) = (self.is_pending, self.transport.errors);
        let answered = self.transport.answer(|request, out| {
            let counters = &counters();
            Exchange { services, device, out, counters, errors, is_pending, now, entropy }.answer(request);
        });
        if answered {
            self.has_stalled = core::mem::take(&mut self.is_pending);
            services.is_functional = false;
            services.frame_received(now);
        }
    }
}
