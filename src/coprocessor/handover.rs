//! The handover holds GyroNet's window until the network takes it, and the deadline of the estimate.
//!
//! The pipeline uses an estimate a fixed number of samples after its window was due, so the deadline is that number
//! of sample periods by the outside clock. If samples arrive faster than 100 times a second, the sample that needs
//! the estimate waits until the deadline. After it the estimate is late, which the pipeline counts and reports.

use crate::pipeline::DueWindow;
use crate::sample::PERIOD_US;
use crate::units::Micros;

/// The window that is due, and the one whose estimate is being computed.
#[derive(Debug, Clone)]
pub(super) struct Handover {
    has_network: bool,
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

    /// Returns whether there is a network with good weights.
    pub const fn has_network(&self) -> bool {
        self.has_network
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

    /// Returns the window that is due, once.
    pub fn take(&mut self) -> Option<DueWindow> {
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

    /// Ends the use of the network.
    pub fn stop(&mut self) {
        *self = Self::new(false, self.delay);
    }
}
