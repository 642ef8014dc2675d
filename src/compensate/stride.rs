//! Defines the samples between windows, and the lag of the rate.

use crate::model::window::WINDOW;
use crate::sample::RATE_HZ;

/// An estimate is used this many samples after its window's newest one, so that frames do not depend on the
/// processor's speed. With a window every sample, it has to be ready with the next one.
pub const DELAY: u32 = 2;

/// Cycles of the other tasks between two samples: health, compensation, frames.
const OUTPUT_CYCLES: u32 = 30_000;

/// Samples between two windows: 1 to [`WINDOW`]. A sample's estimate is the mean of those of all windows that cover it: the
/// newest output of a window depends only on the past and is the worst; those in the middle depend on both sides.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(try_from = "u8", into = "u8")]
pub struct Stride(u8);

impl Stride {
    /// Half a window: every sample is covered by two windows.
    pub const HALF: Self = Self(WINDOW as u8 / 2);

    /// Creates a stride; `None` outside the range, where samples would be left without an estimate.
    pub const fn new(samples: u8) -> Option<Self> {
        if samples >= 1 && samples as usize <= WINDOW { Some(Self(samples)) } else { None }
    }

    pub const fn samples(self) -> u32 {
        self.0 as u32
    }

    /// Returns the number of samples from a window's newest one to the use of its estimate.
    pub const fn delay(self) -> u32 {
        if self.samples() < DELAY { self.samples() } else { DELAY }
    }

    /// Returns the cycles that a window may take: in time, with three tenths of the processor left to other tasks.
    pub const fn window_cycles(self, clock_hz: u32) -> u32 {
        if clock_hz == 0 {
            return u32::MAX;
        }
        let sample = (clock_hz / RATE_HZ).saturating_sub(OUTPUT_CYCLES);
        self.delay() * (sample / 10 * 7)
    }

    /// Returns the number of samples after which no window changes an estimate any more.
    #[doc(hidden)]
    pub const fn complete_after(self) -> usize {
        WINDOW - 1 + self.delay() as usize
    }
}

impl TryFrom<u8> for Stride {
    type Error = OutOfRange;

    fn try_from(samples: u8) -> Result<Self, OutOfRange> {
        Self::new(samples).ok_or(OutOfRange { samples, low: 1, high: WINDOW as u8 })
    }
}

impl From<Stride> for u8 {
    fn from(Stride(samples): Stride) -> Self {
        samples
    }
}

/// Samples from one sample to the frame with its rate: 0 to [`Lag::MAX`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, serde::Serialize, serde::Deserialize)]
#[serde(try_from = "u8", into = "u8")]
pub struct Lag(u8);

impl Lag {
    pub const NONE: Self = Self(0);
    /// The lag from which on no window changes a sample's estimate.
    pub const MAX: Self = Self((WINDOW + DELAY as usize - 1) as u8);

    /// Creates a lag; `None` beyond [`Lag::MAX`], where waiting longer gains nothing.
    pub const fn new(samples: u8) -> Option<Self> {
        if samples <= Self::MAX.0 { Some(Self(samples)) } else { None }
    }

    pub const fn samples(self) -> usize {
        self.0 as usize
    }
}

impl TryFrom<u8> for Lag {
    type Error = OutOfRange;

    fn try_from(samples: u8) -> Result<Self, OutOfRange> {
        Self::new(samples).ok_or(OutOfRange { samples, low: 0, high: Self::MAX.0 })
    }
}

impl From<Lag> for u8 {
    fn from(Lag(samples): Lag) -> Self {
        samples
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("{} samples are not within {} to {}", .samples, .low, .high)]
pub struct OutOfRange {
    samples: u8,
    low: u8,
    high: u8,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_what_makes_sense_can_be_said() {
        assert_eq!((Stride::new(0), Stride::new(11)), (None, None));
        assert_eq!(Stride::new(5), Some(Stride::HALF));
        assert_eq!((Lag::new(11), Lag::new(12)), (Some(Lag::MAX), None));
    }

    #[test]
    fn no_estimate_is_read_too_late() {
        for stride in (1..=10).filter_map(Stride::new) {
            assert!(stride.delay() >= 1 && stride.delay() <= stride.samples(), "{stride:?}");
            assert!(stride.complete_after() <= Lag::MAX.samples(), "{stride:?}");
        }
        assert_eq!(Stride::HALF.complete_after(), 11);
    }
}
