//! These weights come with the library: the default model and the paper's GyroNet, trained on drives of one car, and
//! FoGNet, trained on simulated drives.
//!
//! Their provenance describes their training ([`super::Blob::provenance`]). Each set is a separate static, so that an
//! image contains only those that it uses.

use crate::nn::Aligned;

const DEFAULT_BYTES: &[u8; include_bytes!("weights/default.blob").len()] =
    include_bytes!("weights/default.blob");

/// Units a direction of the default model, as its file states them.
pub const DEFAULT_UNITS: usize = u16::from_le_bytes([DEFAULT_BYTES[16], DEFAULT_BYTES[17]]) as usize;

/// The default weights, a linear part: on drives unseen as good as [`GYRONET`], with a 1,970th of the products.
pub static DEFAULT: Aligned<[u8; DEFAULT_BYTES.len()]> = Aligned(*DEFAULT_BYTES);

const GYRONET_BYTES: &[u8; include_bytes!("weights/gyronet.blob").len()] =
    include_bytes!("weights/gyronet.blob");

/// The weight file of the paper's GyroNet, on the 4-byte boundary that [`super::Blob::new_checked`] needs.
pub static GYRONET: Aligned<[u8; GYRONET_BYTES.len()]> = Aligned(*GYRONET_BYTES);

const FOGNET_BYTES: &[u8; include_bytes!("weights/fognet.blob").len()] =
    include_bytes!("weights/fognet.blob");

/// The weight file of FoGNet, on the 4-byte boundary that [`super::FogBlob::new_checked`] needs.
pub static FOGNET: Aligned<[u8; FOGNET_BYTES.len()]> = Aligned(*FOGNET_BYTES);
