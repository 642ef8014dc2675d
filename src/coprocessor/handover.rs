//! GyroNet's window waits here on its way to the network and back; a late estimate is not used.
//!
//! From when a window is due, its estimate has as many sample periods by the outside clock as the pipeline uses it
//! later. Until then the sample that wants the estimate stays where it waits, should samples come faster
//! than 100 times a second; after that the estimate is late, which the pipeline counts and reports.

use crate::pipeline::DueWindow;
use crate::sample::PERIOD_US;
use crate::units::Micros;

/// The window that is due, and the one whose estimate is under way.
#[derive(Debug, Clone)]
pub(super) struct Handover {
    has_network: bool,
    /// Samples from a window's newest one to the one that its estimate is used with.
    delay: u32,
    due: Option<DueWindow>,
    /// The newest window's tick, and until when its estimate is in time.
    out: Option<(u32, u64)>,
}

impl Handover {
    /// Begins before the first window; without a network none is ever due.
    pub const fn new(has_network: bool, delay: u32) -> Self {
        Self { has_network, delay, due: None, out: None }
    }

    /// Returns whether there is a network with good weights.
    pub const fn has_network(&self) -> bool {
        self.has_network
    }

    /// Takes a window that is due; true where it replaces one that nobody has taken: that one is late.
    pub fn offer(&mut self, window: DueWindow, now: Micros) -> bool {
        if !self.has_network {
            return false;
        }
        self.out = Some((window.end, now.0.saturating_add(u64::from(self.delay) * PERIOD_US)));
        self.due.replace(window).is_some()
    }

    /// Returns the window that is due, once.
    pub fn take(&mut self) -> Option<DueWindow> {
        self.due.take()
    }

    /// Notes that the estimate of a window has come; false where there is no network whose estimates count.
    pub fn close(&mut self, end: u32) -> bool {
        self.out.take_if(|(out, _)| *out == end);
        self.has_network
    }

    /// Returns whether the sample after `tick` needs the estimate, which is not late yet.
    pub fn must_wait(&self, tick: u32, now: Micros) -> bool {
        self.out.is_some_and(|(end, until)| tick.wrapping_sub(end) + 1 >= self.delay && now.0 < until)
    }

    /// Ends the use of the network.
    pub fn stop(&mut self) {
        *self = Self::new(false, self.delay);
    }
}
