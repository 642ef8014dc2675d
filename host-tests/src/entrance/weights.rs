//! Weight files of both networks, by the checks of an upload.

use super::{byte, take};
use crate::models;
use gyronet::model::blob::{Blob, CRC, Shape};
use gyronet::model::fognet_blob::FogBlob;
use gyronet::model::window::{FEATURES, WINDOW};
use gyronet::model::{GyroNet, WindowNetwork, weights};

fn aligned(bytes: &[u8]) -> Vec<u32> {
    let mut words = vec![0; bytes.len().div_ceil(4)];
    bytemuck::cast_slice_mut(&mut words)[..bytes.len()].copy_from_slice(bytes);
    words
}

/// `file` with patches from the data (three bytes of offset, one of length up to 15, then content) and a
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

/// Reads bytes as a file, which must be refused, or as patches to `file`, as the first byte says.
fn read(data: &[u8], file: &[u8], accepts: impl FnOnce(&[u8]) -> bool) {
    if let Some(words) = patched(data, file) {
        accepts(&bytemuck::cast_slice(&words)[..file.len()]);
    } else {
        let content = &data[data.len().min(1)..];
        assert!(!accepts(&bytemuck::cast_slice(&aligned(content))[..content.len()]));
    }
}

/// Patches are to the built-in file or to a small one. An accepted model must run at the limits of its inputs without an
/// overflow (which panics in the builds of these checks).
pub fn gyronet(data: &[u8]) {
    let file: &[u8] = match data {
        [first, ..] if first & 2 > 0 => &SMALL_FILE,
        _ => &weights::GYRONET.0,
    };
    read(data, file, |file| {
        let Ok(blob) = Blob::new_checked(file) else { return false };
        let estimate = GyroNet::new(blob).estimate(&[[i32::MAX; FEATURES]; WINDOW]);
        assert!(usize::from(estimate.clamped_inputs) <= WINDOW * FEATURES);
        true
    });
}

/// The kernels are those of [`gyronet`].
pub fn fognet(data: &[u8]) {
    read(data, &weights::FOGNET.0, |file| {
        let Ok(blob) = FogBlob::new_checked(file) else { return false };
        assert!(blob.input_clamp > 0);
        let _ = (blob.spread(i32::MIN), blob.spread(i32::MAX), blob.mean_gain());
        true
    });
}
