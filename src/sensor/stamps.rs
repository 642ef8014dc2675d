//! Converts the time stamps of a sensor's FIFO to microseconds that never wrap.
//!
//! The sum of the counts is scaled, so a time is within half a microsecond, however long the sensor has run. Samples
//! must be less than the counter's range apart; a longer gap is detected by the arrival times ([`crate::align`]).

use crate::units::Micros;
use core::num::NonZeroU64;

#[derive(Debug, Clone, Copy)]
pub(super) struct Stamps {
    mask: u32,
    /// So many microseconds in so many counts.
    micros: u64,
    per: NonZeroU64,
    last: u32,
    counts: u64,
}

impl Stamps {
    /// Begins at 0 of a counter with this largest value and `micros` microseconds in `per` counts.
    pub(super) const fn new(mask: u32, micros: u64, per: NonZeroU64) -> Self {
        Self { mask, micros, per, last: 0, counts: 0 }
    }

    pub(super) fn unwrap(&mut self, stamp: u32) -> Micros {
        self.counts += u64::from(stamp.wrapping_sub(self.last) & self.mask);
        self.last = stamp;
        // Rounded to the nearest microsecond; a product of 50,000 a count overflows after 292 years of 25 us counts.
        Micros((self.counts * self.micros + self.per.get() / 2) / self.per)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::vec::Vec;

    /// Of an ICM-42688-P.
    const COUNTER: Stamps = Stamps::new(0xFFFF, 16, NonZeroU64::new(15).unwrap());

    fn times(counts: impl IntoIterator<Item = u64>) -> Vec<u64> {
        let mut stamps = COUNTER;
        counts.into_iter().map(|counts| stamps.unwrap(counts as u16 as u32).0).collect()
    }

    fn periods(times: &[u64]) -> Vec<u64> {
        times.windows(2).map(|pair| pair[1] - pair[0]).collect()
    }

    #[test]
    fn an_hour_is_an_hour() {
        const HOUR: u64 = 360_000;
        // The counter begins between two microseconds, so that every time is rounded, and wraps within eight samples.
        let times = times((0..=HOUR).map(|n| 500 + n * 9_375));
        assert_eq!(times[0], 533);
        assert_eq!(times[HOUR as usize] - times[0], 3_600_000_000);
        assert!(periods(&times).iter().all(|period| *period == 10_000));
    }

    #[test]
    fn an_hour_of_odd_periods_is_within_a_microsecond() {
        // An oscillator 0.1 % slow: 9,365.625 counts in 10 ms of true time, rounded down.
        let counts = |n: u64| n * 9_365_625 / 1_000;
        let times = times((0..360_000).map(counts));
        for (n, time) in times.iter().enumerate() {
            let exact = counts(n as u64) as f64 * 32.0 / 30.0;
            assert!((*time as f64 - exact).abs() <= 0.5, "sample {n}: {time} us, {exact} by the counts");
        }
    }
}
