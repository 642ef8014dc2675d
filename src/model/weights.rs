//! These weights come with the library: GyroNet and a linear window trained on drives of one car, FoGNet trained on
//! simulated ones.
//!
//! Where they come from stands in their provenance ([`super::Blob::provenance`]). An image
//! that does not use them does not contain them.

use crate::nn::Aligned;

const BYTES: &[u8; include_bytes!("weights/gyronet.blob").len()] = include_bytes!("weights/gyronet.blob");

/// A weight file, on the boundary that [`super::Blob::new_checked`] wants.
pub static DEFAULT: Aligned<[u8; BYTES.len()]> = Aligned(*BYTES);

const LINEAR_WINDOW_BYTES: &[u8; include_bytes!("weights/linear_window.blob").len()] =
    include_bytes!("weights/linear_window.blob");

/// A weight file of a linear part alone, for the unit of that car: 600 multiplications a window.
pub static LINEAR_WINDOW: Aligned<[u8; LINEAR_WINDOW_BYTES.len()]> = Aligned(*LINEAR_WINDOW_BYTES);

const FOGNET_BYTES: &[u8; include_bytes!("weights/fognet.blob").len()] =
    include_bytes!("weights/fognet.blob");

/// A weight file of FoGNet's, on the boundary that [`super::FogBlob::new_checked`] wants.
pub static FOGNET: Aligned<[u8; FOGNET_BYTES.len()]> = Aligned(*FOGNET_BYTES);
