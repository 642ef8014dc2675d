//! This clock extends a 32-bit time stamp beyond its wrap, by summing the signed differences of successive stamps.

/// The extension of 32-bit stamps (71 minutes of microseconds, 119 hours at 10 kHz) to 64 bits, which never wrap. A
/// stamp that is up to half the range smaller than the previous one is a step back, not a wrap.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct StampClock {
    /// Last stamp and its unwrapped time.
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
