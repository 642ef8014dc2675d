//! Passes weight files of both networks to the checks of an upload.

use super::{byte, take};
use crate::models;
use gyronet::model::blob::{Blob, CRC, Shape};
use gyronet::model::fognet_blob::FogBlob;
use gyronet::model::window::{FEATURES, WINDOW};
use gyronet::model::{GyroNet, WindowNetwork, weights};

/// Copies bytes to a word boundary.
fn aligned(bytes: &[u8]) -> Vec<u32> {
    let mut words = vec![0; bytes.len().div_ceil(4)];
    bytemuck::cast_slice_mut(&mut words)[..bytes.len()].copy_from_slice(bytes);
    words
}

/// Returns `file` with patches from the data (three bytes of offset, one of length up to 15, then content) and a
/// valid checksum; `None` if the data are a file themselves.
fn patched(mut data: &[u8], file: &[u8]) -> Option<Vec<u32>> {
    if byte(&mut data) & 1 == 0 {
        return None;
    }
    let mut words = aligned(file);
    let bytes: &mut [u8] = bytemuck::cast_slice_mut(&mut words);
    let end = file.len() - 4;
    while !data.is_empty() {
        let [a, b, c] = [byte(&mut data), byte(&mut data), byte(&mut data)].map(usize::from);
        let at = (a | b << 8 | c << 16) % end;
        let len = usize::from(byte(&mut data) & 15);
        for (to, from) in bytes[at..end].iter_mut().zip(take(&mut data, len)) {
            *to = *from;
        }
    }
    let crc = CRC.checksum(&bytes[..end]).to_le_bytes();
    bytes[end..file.len()].copy_from_slice(&crc);
    Some(words)
}

const SMALL: Shape = Shape { units: 8, linear: true };
static SMALL_FILE: [u8; SMALL.file_len(0)] = models::file(SMALL, 5);

/// Reads bytes as a file, or as patches to the built-in file or to a small one, as the first byte says. An accepted
/// model must run at the limits of its inputs without an overflow (which panics in the builds of these checks).
pub fn gyronet(data: &[u8]) {
    let file: &[u8] = match data {
        [first, ..] if first & 2 > 0 => &SMALL_FILE,
        _ => &weights::GYRONET.0,
    };
    match patched(data, file) {
        None => {
            let content = &data[data.len().min(1)..];
            assert!(Blob::new_checked(&bytemuck::cast_slice(&aligned(content))[..content.len()]).is_err());
        }
        Some(words) => {
            if let Ok(blob) = Blob::new_checked(&bytemuck::cast_slice(&words)[..file.len()]) {
                let mut network = GyroNet::new(blob);
                let estimate = network.estimate(&[[i32::MAX; FEATURES]; WINDOW]);
                assert!(usize::from(estimate.clamped_inputs) <= WINDOW * FEATURES);
            }
        }
    }
}

/// Reads bytes as [`gyronet`] does, for FoGNet; its kernels are the same.
pub fn fognet(data: &[u8]) {
    let file = &weights::FOGNET.0;
    match patched(data, file) {
        None => {
            let content = &data[data.len().min(1)..];
            assert!(FogBlob::new_checked(&bytemuck::cast_slice(&aligned(content))[..content.len()]).is_err());
        }
        Some(words) => {
            if let Ok(blob) = FogBlob::new_checked(&bytemuck::cast_slice(&words)[..file.len()]) {
                assert!(blob.input_clamp > 0);
                let _ = (blob.spread(i32::MIN), blob.spread(i32::MAX), blob.mean_gain());
            }
        }
    }
}
