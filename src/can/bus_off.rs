//! A controller that has gone off the bus returns at growing intervals, so that a broken node does not always disturb it,
//! and sends no CAN FD frames if they end there: the other nodes know only classic frames, or another bit rate.

/// First interval from bus-off to a return, us. It doubles every time, until the controller stays for [`LAST_US`].
pub const FIRST_US: u64 = 10_000;
/// The longest interval, us.
pub const LAST_US: u64 = 1_280_000;

/// Follows a controller off the bus and back. Times are in us.
#[derive(Debug, Clone, Copy)]
pub struct BusOff {
    is_off: bool,
    /// Since when it is on the bus, or off it.
    changed: u64,
    interval: u64,
    /// Until then CAN FD frames are withheld after a return, which shows whether classic ones are taken.
    fd_from: u64,
    has_taken: bool,
    refuses_fd: bool,
}

impl BusOff {
    /// Creates the state of a controller that joins the bus.
    pub const fn new(now: u64) -> Self {
        Self {
            is_off: false,
            changed: now,
            interval: FIRST_US,
            fd_from: 0,
            has_taken: false,
            refuses_fd: false,
        }
    }

    /// Takes whether the controller is off the bus, and whether a node has acknowledged a frame since the last call.
    pub fn follow(&mut self, is_off: bool, has_sent: bool, now: u64) {
        if is_off != self.is_off {
            let has_sent_fd = self.takes_fd(now);
            self.refuses_fd |= is_off && self.has_taken && has_sent_fd && self.interval == LAST_US;
            (self.is_off, self.changed, self.has_taken) = (is_off, now, false);
            self.fd_from = now + self.interval / 2;
        }
        self.has_taken |= has_sent && !self.takes_fd(now);
        if !is_off && now - self.changed > LAST_US {
            self.interval = FIRST_US;
        }
    }

    /// Returns whether the controller is off the bus.
    pub const fn is_off(&self) -> bool {
        self.is_off
    }

    /// Returns whether the controller may return now, which the caller then has it do.
    pub fn returns(&mut self, now: u64) -> bool {
        let is_due = self.is_off && now - self.changed >= self.interval;
        if is_due {
            self.interval = (2 * self.interval).min(LAST_US);
        }
        is_due
    }

    /// Returns whether a CAN FD frame may be sent now.
    pub const fn takes_fd(&self, now: u64) -> bool {
        !self.refuses_fd && now >= self.fd_from
    }

    /// Returns whether CAN FD frames ended off the bus at every return, where classic ones were taken: none is sent any more.
    pub const fn refuses_fd(&self) -> bool {
        self.refuses_fd
    }
}
