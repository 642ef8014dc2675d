//! These weights come with the library: GyroNet trained on drives of one car, FoGNet trained on simulated ones.
//!
//! Where they come from stands in their provenance ([`super::Blob::provenance`]). An image
//! that does not use them does not contain them.

use crate::nn::Aligned;

const BYTES: &[u8; include_bytes!("weights/gyronet.blob").len()] = include_bytes!("weights/gyronet.blob");

/// A weight file, on the boundary that [`super::Blob::new_checked`] wants.
pub static DEFAULT: Aligned<[u8; BYTES.len()]> = Aligned(*BYTES);

const FOGNET_BYTES: &[u8; include_bytes!("weights/fognet.blob").len()] =
    include_bytes!("weights/fognet.blob");

/// A weight file of FoGNet's, on the boundary that [`super::FogBlob::new_checked`] wants.
pub static FOGNET: Aligned<[u8; FOGNET_BYTES.len()]> = Aligned(*FOGNET_BYTES);
