//! Defines which outputs of a window are used, the samples between windows, and the lag of the rate.

use crate::model::window::WINDOW;
use crate::sample::RATE_HZ;
use core::ops::Range;

/// An estimate is used this many samples after its window's newest one, however long the network took, so that the
/// board's frames do not depend on its speed. With a window every sample, the estimate has to be ready with the next
/// sample.
pub const DELAY: u32 = 2;

/// Cycles of the other tasks between two samples: health, compensation, frames.
const OUTPUT_CYCLES: u32 = 30_000;

/// Samples between two windows: 1 to [`WINDOW`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(try_from = "u8", into = "u8"))]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Stride(u8);

impl Stride {
    /// Half a window: every sample is covered by two windows.
    pub const HALF: Self = Self(WINDOW as u8 / 2);

    /// Creates a stride; `None` outside the range, where samples would be left without an estimate.
    pub const fn new(samples: u8) -> Option<Self> {
        if samples >= 1 && samples as usize <= WINDOW { Some(Self(samples)) } else { None }
    }

    /// Returns the number of samples.
    #[must_use]
    pub const fn samples(self) -> u32 {
        self.0 as u32
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
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(try_from = "u8", into = "u8"))]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Lag(u8);

impl Lag {
    /// The rate is sent at once.
    pub const NONE: Self = Self(0);
    /// The lag from which on no window changes a sample's estimate.
    pub const MAX: Self = Self((WINDOW + DELAY as usize - 1) as u8);

    /// Creates a lag; `None` beyond [`Lag::MAX`], where waiting longer gains nothing.
    pub const fn new(samples: u8) -> Option<Self> {
        if samples <= Self::MAX.0 { Some(Self(samples)) } else { None }
    }

    /// Returns the number of samples.
    #[must_use]
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

/// A number of samples outside its range.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[error("{} samples are not within {} to {}", .samples, .low, .high)]
pub struct OutOfRange {
    samples: u8,
    low: u8,
    high: u8,
}

/// The rule that chooses the estimate of a sample from the windows that cover it.
///
/// The newest output of a window depends only on the past and is the worst; those in the middle depend on both sides.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Mode {
    /// A window every sample, of which the newest output is used: the obvious online choice.
    Newest,
    /// A window every five samples, of which the five in the middle are used.
    Middle,
    /// The mean of all windows that cover a sample.
    Overlap {
        /// Samples between two windows.
        stride: Stride,
    },
}

impl Mode {
    /// Returns the number of samples between two windows.
    #[must_use]
    pub const fn stride(self) -> u32 {
        match self {
            Self::Newest => 1,
            Self::Middle => Stride::HALF.samples(),
            Self::Overlap { stride } => stride.samples(),
        }
    }

    /// Returns the number of samples from a window's newest one to the use of its estimate.
    #[must_use]
    pub const fn delay(self) -> u32 {
        if self.stride() < DELAY { self.stride() } else { DELAY }
    }

    /// Returns the cycles that a window may take, so that its estimate is ready in time and three tenths of the processor
    /// are left to the tasks of lower priority; `u32::MAX` where the clock is not known.
    #[must_use]
    pub const fn window_cycles(self, clock_hz: u32) -> u32 {
        if clock_hz == 0 {
            return u32::MAX;
        }
        let sample = (clock_hz / RATE_HZ).saturating_sub(OUTPUT_CYCLES);
        self.delay() * (sample / 10 * 7)
    }

    /// Returns the outputs of a window that are used, oldest first.
    #[must_use]
    #[doc(hidden)]
    pub const fn used(self) -> Range<usize> {
        match self {
            Self::Newest => WINDOW - 1..WINDOW,
            // One output for every sample, and as many unused ones after the newest as before the oldest, where the
            // number allows.
            Self::Middle => 3..8,
            Self::Overlap { .. } => 0..WINDOW,
        }
    }

    /// Returns the number of samples after which no window changes an estimate any more.
    #[must_use]
    #[doc(hidden)]
    pub const fn complete_after(self) -> usize {
        WINDOW - 1 - self.used().start + self.delay() as usize
    }
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
    fn every_sample_gets_an_estimate_and_none_is_read_too_late() {
        let overlap = (1..=10).filter_map(Stride::new).map(|stride| Mode::Overlap { stride });
        for mode in [Mode::Newest, Mode::Middle].into_iter().chain(overlap) {
            assert!(mode.used().len() >= mode.stride() as usize, "{mode:?}");
            assert!(mode.delay() >= 1 && mode.delay() <= mode.stride(), "{mode:?}");
            assert!(mode.complete_after() <= Lag::MAX.samples(), "{mode:?}");
        }
        assert_eq!(Mode::Newest.complete_after(), 1);
        assert_eq!(Mode::Middle.complete_after(), 8);
        assert_eq!(Mode::Overlap { stride: Stride::HALF }.complete_after(), 11);
    }
}
