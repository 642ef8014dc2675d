//! Tracks GyroNet's windows: the samples of the next one, the one handed out, and whether the newest
//! estimate is in use.
//!
//! An estimate is used a fixed number of samples after its window was due, so its deadline is that number of sample
//! periods by the outside clock. If samples arrive faster than 100 times a second, the sample that needs the estimate
//! waits until the deadline. After it the estimate is late, which the pipeline counts and reports.

use crate::health::Faults;
use crate::model::Estimate;
use crate::model::window::{Features, WINDOW, Window};
use crate::sample::PERIOD_US;
use crate::units::Micros;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct DueWindow {
    pub end: u32,
    pub features: [Features; WINDOW],
}

#[derive(Debug, Clone)]
pub(super) struct Windows {
    window: Window,
    since: u32,
    /// Tick of the window that has been handed out, and its estimate once delivered.
    out: Option<(u32, Option<Estimate>)>,
    /// True if the newest estimate is in use; otherwise `faults` says that it was rejected or late.
    pub accepted: bool,
    pub faults: Faults,
}

impl Windows {
    pub const START: Self =
        Self { window: Window::EMPTY, since: 0, out: None, accepted: false, faults: Faults::NONE };

    pub fn add(&mut self, features: Features) {
        self.window.add(features);
        self.since += 1;
    }

    pub fn break_off(&mut self) {
        *self = Self::START;
    }

    /// Returns the window that ends with this tick, if full, `stride` after the last one, and none is out.
    #[inline(never)]
    pub fn due(&mut self, tick: u32, stride: u32) -> Option<DueWindow> {
        if self.since < stride || self.out.is_some() {
            return None;
        }
        let features = self.window.snapshot()?;
        self.since = 0;
        self.out = Some((tick, None));
        Some(DueWindow { end: tick, features })
    }

    /// Accepts the estimate of the window handed out; returns false if `end` names no window that waits for one.
    pub fn deliver(&mut self, end: u32, estimate: Estimate) -> bool {
        match &mut self.out {
            Some((due, slot @ None)) if *due == end => {
                *slot = Some(estimate);
                true
            }
            _ => false,
        }
    }

    /// Returns the estimate due at this tick: `Some(None)` if it is late, `None` if none is due.
    pub fn take_estimate(&mut self, tick: u32, delay: u32) -> Option<Option<Estimate>> {
        let (_, estimate) = self.out.take_if(|(end, _)| tick.wrapping_sub(*end) >= delay)?;
        Some(estimate)
    }
}

/// A window on its way to the network: the one that is due, and the one whose estimate is being computed.
#[derive(Debug, Clone)]
pub(crate) struct Handover {
    pub has_network: bool,
    /// Samples from a window's newest one to the sample that uses its estimate.
    delay: u32,
    due: Option<DueWindow>,
    /// Tick of the newest window, and the deadline of its estimate, microseconds.
    out: Option<(u32, u64)>,
}

impl Handover {
    /// Creates a handover before the first window; without a network no window is ever due.
    pub const fn new(has_network: bool, delay: u32) -> Self {
        Self { has_network, delay, due: None, out: None }
    }

    /// Stores a window that is due. Returns true if it replaces a window that was not taken, which is then late.
    pub fn offer(&mut self, window: &DueWindow, now: Micros) -> bool {
        if !self.has_network {
            return false;
        }
        self.out = Some((window.end, now.0.saturating_add(u64::from(self.delay) * PERIOD_US)));
        // Without a copy of the old window on the stack.
        let replaces = self.due.is_some();
        self.due = Some(*window);
        replaces
    }

    pub fn take(&mut self) -> Option<DueWindow> {
        // Nearly every call finds none, and copies none.
        self.due.as_ref()?;
        self.due.take()
    }

    /// Notes that the estimate of a window has arrived. Returns false if no network is in use.
    pub fn close(&mut self, end: u32) -> bool {
        self.out.take_if(|(out, _)| *out == end);
        self.has_network
    }

    /// Returns whether the sample after `tick` must wait for an estimate that is not late yet.
    pub fn must_wait(&self, tick: u32, now: Micros) -> bool {
        self.out.is_some_and(|(end, until)| tick.wrapping_sub(end) + 1 >= self.delay && now.0 < until)
    }

    pub fn stop(&mut self) {
        *self = Self::new(false, self.delay);
    }
}
