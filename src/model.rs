//! The networks of the paper: their topology and weight files, on top of the arithmetic of
//! [`crate::nn`].

#[doc(hidden)]
pub mod background;
#[doc(hidden)]
pub mod blob;
pub(crate) mod file;
#[doc(hidden)]
pub mod fognet;
#[doc(hidden)]
pub mod fognet_blob;
#[doc(hidden)]
pub mod fognet_f32;
#[doc(hidden)]
pub mod gyronet;
#[doc(hidden)]
pub mod gyronet_f32;
mod input;
pub(crate) mod ring;
#[doc(hidden)]
pub mod seconds;
pub mod weights;
#[doc(hidden)]
pub mod window;

pub use blob::{Blob, BlobError};
pub use fognet::FogNet;
pub use fognet_blob::FogBlob;
pub use gyronet::{GyroNet, GyroNetState};
pub use window::{FEATURES, Features, WINDOW};

use crate::nn::linear::Linear;
use crate::units::AngularRate;

/// Holds estimates of the yaw gyro's error, one for each sample of a window, oldest first.
pub type Corrections = [AngularRate; WINDOW];

/// The smallest [`Estimate::scale`]: 2^-20 rad/s (0.2 deg/h), far below what a window can resolve.
pub const SCALE_MIN: AngularRate = AngularRate(1 << 7);
/// The largest [`Estimate::scale`]: 1 rad/s, which means that the estimate is useless.
pub const SCALE_MAX: AngularRate = AngularRate(1 << AngularRate::FRACTION_BITS);

/// Turns a window into corrections; the integer network and the f32 reference implement it.
pub trait WindowNetwork {
    /// Runs the network over one window.
    fn estimate(&mut self, window: &[Features; WINDOW]) -> Estimate;
}

impl<N: WindowNetwork + ?Sized> WindowNetwork for &mut N {
    fn estimate(&mut self, window: &[Features; WINDOW]) -> Estimate {
        (**self).estimate(window)
    }
}

/// Holds the result of a window: the gyro's error in each sample, and the expected error of the estimate.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Estimate {
    /// The corrections.
    pub corrections: Corrections,
    /// The expected absolute error of the mean of the window's corrected rates, as the scale of a Laplace distribution,
    /// between [`SCALE_MIN`] and [`SCALE_MAX`].
    pub scale: AngularRate,
    /// Input values that had to be clamped to the network's range.
    pub clamped_inputs: u16,
    /// The part of the corrections that follows from a sample's own rates.
    pub steady_gain: SteadyGain,
}

impl Estimate {
    /// An estimate without a correction, with the largest scale.
    pub const NONE: Self = Self {
        corrections: [AngularRate::ZERO; window::WINDOW],
        scale: SCALE_MAX,
        clamped_inputs: 0,
        steady_gain: SteadyGain::NONE,
    };
}

/// The factors that turn a constant angular rate about x, y and z into its correction: a linear part models the
/// unit's mounting and gain with them. Q24, from rate codes to a rate code.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct SteadyGain(pub [i32; 3]);

impl SteadyGain {
    /// The gain of a model without a linear part: zero.
    pub const NONE: Self = Self([0; 3]);

    /// Returns the factors of the roll and pitch rates, which model the mounting.
    #[must_use]
    pub const fn mounting(self) -> Self {
        let Self([roll, pitch, _]) = self;
        Self([roll, pitch, 0])
    }

    /// Returns the gain less `part`.
    #[must_use]
    pub fn minus(self, part: Self) -> Self {
        Self(core::array::from_fn(|axis| self.0[axis].saturating_sub(part.0[axis])))
    }

    /// Returns the correction of a sample with these rates.
    #[must_use]
    pub fn correction(&self, rates: [AngularRate; 3]) -> AngularRate {
        AngularRate(Linear::output(&self.0, &rates.map(|rate| rate.0)))
    }
}
