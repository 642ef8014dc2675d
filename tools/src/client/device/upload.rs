//! Uploads a weight file of GyroNet, or another file in blocks.

use super::requests::USE_DOWNLOAD;
use super::{Device, DeviceError};
use crate::client::bus::Bus;
use gyronet::service::message::BLOCK;
use gyronet::store::Slot;
use gyronet::uds::Session;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Uploaded {
    pub slot: Slot,
    /// The checksum that the board computed.
    pub crc: u32,
}

/// Transfers a weight file to the board, which checks it and uses it after a restart. `progress` is called
/// with the number of bytes transferred so far.
pub fn upload<B: Bus>(
    device: &mut Device<B>,
    file: &[u8],
    progress: impl FnMut(usize),
) -> Result<Uploaded, DeviceError> {
    device.enter(Session::Programming)?;
    let uploaded = transfer(device, 0, file, progress)?;
    let trailer = device.trailer(USE_DOWNLOAD, file)?;
    device.ask(&[&[0x31, 1][..], &USE_DOWNLOAD.to_be_bytes(), &trailer].concat())?;
    Ok(uploaded)
}

/// Transfers a file to an address, and has the board check it.
pub(super) fn transfer<B: Bus>(
    device: &mut Device<B>,
    address: u32,
    file: &[u8],
    mut progress: impl FnMut(usize),
) -> Result<Uploaded, DeviceError> {
    let length = u32::try_from(file.len()).map_err(|_| DeviceError::TooLong)?;
    // Four bytes of address, and four of length.
    device.ask(&[&[0x34, 0, 0x44][..], &address.to_be_bytes(), &length.to_be_bytes()].concat())?;
    let mut number = 0u8;
    for (block, end) in file.chunks(BLOCK).zip((BLOCK..).step_by(BLOCK)) {
        number = number.wrapping_add(1);
        device.ask_at_rest(&[&[0x36, number], block].concat())?;
        progress(end.min(file.len()));
    }
    let response = device.ask(&[0x37])?;
    let [slot, crc @ ..] = <[u8; 5]>::try_from(response).map_err(|_| DeviceError::Mismatch)?;
    let slot = *Slot::ALL.get(usize::from(slot)).ok_or(DeviceError::Mismatch)?;
    Ok(Uploaded { slot, crc: u32::from_be_bytes(crc) })
}
