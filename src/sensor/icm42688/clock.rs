//! Converts the ICM-42688-P's 16-bit time stamps to microseconds that never wrap.
//!
//! Without a clock on CLKIN the sensor counts in units of 32/30 us, although TMST_RES is 1 us (DS-000347, 12.7): the
//! 10 ms between two samples at 100 Hz are 9,375 counts. The counts are summed unscaled, and the sum is scaled by
//! 16/15. A time is thus within half a microsecond of the exact one, however long the sensor has run, and a
//! difference of two times within one microsecond.
//!
//! The counter wraps every 65,536 counts, 69.9 ms: a time is correct only if successive samples are less
//! than that apart. A longer gap is detected by the arrival times ([`crate::align`]).

use crate::units::Micros;

/// Microseconds in `COUNTS` counts of 32/30 us.
const MICROS: u64 = 16;
/// Counts in `MICROS` microseconds.
const COUNTS: u64 = 15;

/// The sum of the sensor's counts.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Clock {
    last: Option<u16>,
    counts: u64,
}

impl Clock {
    /// Adds a packet's time stamp, in counts modulo 2^16, and returns its time.
    pub(super) fn unwrap(&mut self, stamp: u16) -> Micros {
        let since = stamp.wrapping_sub(self.last.unwrap_or(0));
        self.counts += u64::from(since);
        self.last = Some(stamp);
        // Rounded to the nearest microsecond; the product overflows after 2^60 counts, 39,000 years.
        Micros((self.counts * MICROS + COUNTS / 2) / COUNTS)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::vec::Vec;

    /// Passes these counter values to the clock, and returns the times.
    fn times(counts: impl IntoIterator<Item = u64>) -> Vec<u64> {
        let mut clock = Clock::default();
        counts.into_iter().map(|counts| clock.unwrap(counts as u16).0).collect()
    }

    fn periods(times: &[u64]) -> Vec<u64> {
        times.windows(2).map(|pair| pair[1] - pair[0]).collect()
    }

    #[test]
    fn ten_milliseconds_read_as_ten_milliseconds() {
        // The counter wraps within eight samples.
        let times = times((0..20).map(|n| 500 + n * 9_375));
        assert_eq!(times[0], 533);
        assert_eq!(periods(&times), [10_000; 19]);
    }

    #[test]
    fn one_millisecond_reads_as_one_millisecond() {
        // The sensor counts 937 or 938 units, because 1 ms is 937.5.
        let times = times((0..1_000).map(|n| n * 9_375 / 10));
        assert!(times.iter().enumerate().all(|(n, time)| time.abs_diff(n as u64 * 1_000) <= 1));
    }

    #[test]
    fn three_missing_samples_leave_a_gap_of_forty_milliseconds() {
        let times = times([0, 1, 5, 6].map(|n| 60_000 + n * 9_375));
        assert_eq!(periods(&times), [10_000, 40_000, 10_000]);
    }

    #[test]
    fn an_hour_is_an_hour() {
        const HOUR: u64 = 360_000;
        // The counter begins between two microseconds, so that every time is rounded.
        let times = times((0..=HOUR).map(|n| 7 + n * 9_375));
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
