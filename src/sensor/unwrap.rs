//! This clock continues a clock of 32 bits beyond its wrap, by summing the signed differences of its stamps.

/// Extends stamps of 32 bits (71 minutes of microseconds, 119 hours at 10 kHz) to ones that never wrap. A stamp that
/// goes back by less than half the range is a step back, not a wrap.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct StampClock {
    /// The last stamp and the time that it stands for.
    last: Option<(u32, u64)>,
}

impl StampClock {
    pub(super) const START: Self = Self { last: None };

    pub(super) fn unwrap(&mut self, stamp: u32) -> u64 {
        let time = match self.last {
            None => u64::from(stamp),
            Some((last, base)) => base.saturating_add_signed(i64::from(stamp.wrapping_sub(last) as i32)),
        };
        self.last = Some((stamp, time));
        time
    }
}
