//! The networks of the paper: their topology and weight files, on top of the arithmetic of [`crate::nn`].

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
pub mod gyronet;
mod input;
#[doc(hidden)]
pub mod seconds;
pub mod weights;
#[doc(hidden)]
pub mod window;

pub use blob::{Blob, BlobError};
pub use fognet::FogNet;
pub use fognet_blob::FogBlob;
pub use gyronet::{GyroNet, GyroNetState, LargestState};
pub use window::{Corrections, Estimate, FEATURES, Features, WINDOW, WindowNetwork};
