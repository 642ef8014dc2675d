//! These weights come with the library: GyroNet and a linear window trained on drives of one car, FoGNet trained on
//! simulated drives.
//!
//! Their provenance names their training ([`super::Blob::provenance`]). Each is a static of its own, so that an image
//! contains only those that it uses.

use crate::nn::Aligned;

const BYTES: &[u8; include_bytes!("weights/gyronet.blob").len()] = include_bytes!("weights/gyronet.blob");

/// The default weight file of GyroNet, on the 4-byte boundary that [`super::Blob::new_checked`] needs.
pub static DEFAULT: Aligned<[u8; BYTES.len()]> = Aligned(*BYTES);

const LINEAR_WINDOW_BYTES: &[u8; include_bytes!("weights/linear_window.blob").len()] =
    include_bytes!("weights/linear_window.blob");

/// The weight file of a linear part alone, for the unit of that car: 600 multiplications a window.
pub static LINEAR_WINDOW: Aligned<[u8; LINEAR_WINDOW_BYTES.len()]> = Aligned(*LINEAR_WINDOW_BYTES);

const FOGNET_BYTES: &[u8; include_bytes!("weights/fognet.blob").len()] =
    include_bytes!("weights/fognet.blob");

/// The weight file of FoGNet, on the 4-byte boundary that [`super::FogBlob::new_checked`] needs.
pub static FOGNET: Aligned<[u8; FOGNET_BYTES.len()]> = Aligned(*FOGNET_BYTES);
