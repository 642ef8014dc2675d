//! A request that is answered, and what is kept from one request to the next: the session, its download and its access.

use super::dtc::Memory;
use super::isotp::TransportErrors;
use super::lock::Lock;
use super::response::{Nrc, Response, nrc};
use super::session::Session;
use super::signature::Digest;
use super::update::Head;
use crate::service::message::{AllCounters, Refusal};
use crate::service::{Device, MappedSlots};
use crate::store::firmware::Label;
use embedded_storage::nor_flash::NorFlash;

/// Session timeout: longest silence of a tester in a non-default session, ms (S3).
const SESSION_MS: u32 = 5_000;
/// Time after a stall of the board in which the faults that it causes end, ms.
const SETTLE_MS: u32 = 1_000;

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
    pub(super) lock: Lock,
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
            lock: Lock::new(),
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
        self.lock.end();
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

#[derive(Debug)]
pub(super) struct Download {
    /// Label, length and hash of the image, if this is firmware.
    pub image: Option<(Label, Digest)>,
    /// Number of the next block; it starts at 1 and wraps from 255 to 0.
    pub next: u8,
    pub digest: Option<Digest>,
}

impl Download {
    /// Returns the digest of the file, once the file has been checked, and whether it is firmware.
    pub fn checked(&self) -> Option<(Digest, bool)> {
        Some((self.digest?, self.image.is_some()))
    }
}

impl<R: NorFlash, W: MappedSlots, E> Exchange<'_, R, W, E> {
    /// Keeps the reason why a request is refused, and returns the code of the response.
    pub(super) fn refuse(&mut self, refusal: impl Into<Refusal>) -> Nrc {
        nrc(self.device.refuse_request(refusal.into()))
    }
}
