//! These modules are the networks of the paper, with their topology, on top of [`crate::nn`].

#[doc(hidden)]
pub mod background;
#[doc(hidden)]
pub mod blob;
pub(crate) mod file;
pub mod fognet;
#[doc(hidden)]
pub mod fognet_blob;
#[doc(hidden)]
pub mod fognet_f32;
pub mod gyronet;
#[doc(hidden)]
pub mod gyronet_f32;
mod input;
pub mod weights;
pub mod window;

pub use blob::{Blob, BlobError};
pub use fognet::FogNet;
pub use fognet_blob::FogBlob;
pub use gyronet::GyroNet;

use crate::model::window::{Features, WINDOW};
use crate::units::AngularRate;

/// Estimates of the yaw gyro's error, one for each sample of a window, oldest first.
pub type Corrections = [AngularRate; WINDOW];

/// The smallest [`Estimate::scale`]: 2^-20 rad/s (0.2 deg/h), far below what a window can tell.
pub const SCALE_MIN: AngularRate = AngularRate(1 << 7);
/// The largest [`Estimate::scale`]: 1 rad/s, which says that the estimate is worth nothing.
pub const SCALE_MAX: AngularRate = AngularRate(1 << AngularRate::FRACTION_BITS);

/// Whatever turns a window into corrections: the integer network, the f32 reference.
pub trait WindowNetwork {
    /// Runs the network over one window.
    fn estimate(&mut self, window: &[Features; WINDOW]) -> Estimate;
}

/// The result of a window: the gyro's error in each sample, and its expected error.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Estimate {
    /// The corrections.
    pub corrections: Corrections,
    /// Scale of the Laplace error that the mean of the window's corrected rates has: the
    /// absolute error to expect of it. Between [`SCALE_MIN`] and [`SCALE_MAX`].
    pub scale: AngularRate,
    /// Input values that had to be clamped to the network's range.
    pub clamped_inputs: u16,
}
