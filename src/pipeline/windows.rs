//! Tracks GyroNet's windows: the samples of the next one, the one handed out, and whether the newest
//! estimate is in use.

use crate::health::Faults;
use crate::model::Estimate;
use crate::model::window::{Features, WINDOW, Window};

/// Holds a window that is due for the network.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct DueWindow {
    /// Tick of the newest sample.
    pub end: u32,
    /// Features of the samples, oldest first.
    pub features: [Features; WINDOW],
}

/// Holds the samples of the next window and the state of the last one.
#[derive(Debug, Clone)]
pub(super) struct Windows {
    window: Window,
    /// Samples since the last window.
    since: u32,
    /// Tick of the window that has been handed out, and its estimate once delivered.
    out: Option<(u32, Option<Estimate>)>,
    accepted: bool,
    faults: Faults,
}

impl Windows {
    /// The state without a sample and without a window handed out.
    pub const START: Self =
        Self { window: Window::EMPTY, since: 0, out: None, accepted: false, faults: Faults::NONE };

    /// Adds a good sample.
    pub fn add(&mut self, features: Features) {
        self.window.add(features);
        self.since += 1;
    }

    /// Drops the samples, the window handed out and its estimate.
    pub fn break_off(&mut self) {
        *self = Self::START;
    }

    /// Returns the window that ends with this tick, if it is full, at least `stride` samples after the last one, and no
    /// other is handed out.
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

    /// Returns the estimate that is due at this tick: `Some(None)` if it did not arrive in time, `None` if none is
    /// due.
    pub fn take_estimate(&mut self, tick: u32, delay: u32) -> Option<Option<Estimate>> {
        let (_, estimate) = self.out.take_if(|(end, _)| tick.wrapping_sub(*end) >= delay)?;
        Some(estimate)
    }

    /// Notes that the newest estimate is in use.
    pub fn accept(&mut self) {
        (self.accepted, self.faults) = (true, Faults::NONE);
    }

    /// Notes that the newest estimate was rejected or late.
    pub fn reject(&mut self, fault: Faults) {
        (self.accepted, self.faults) = (false, fault);
    }

    /// Returns whether an estimate is in use.
    pub fn is_accepted(&self) -> bool {
        self.accepted
    }

    /// Returns the fault of the newest estimate.
    pub fn faults(&self) -> Faults {
        self.faults
    }
}
