//! Uploads a weight file.

use super::requests::USE_DOWNLOAD;
use super::{Device, DeviceError};
use crate::client::bus::Bus;
use gyronet::service::message::{BLOCK, Network};
use gyronet::store::{Place, Slot};
use gyronet::uds::Session;

/// A file that the board has accepted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Uploaded {
    /// The place in flash that holds the file.
    pub place: Place,
    /// The checksum that the board computed.
    pub crc: u32,
}

/// Transfers a network's weight file to the board, which checks it and uses it after a restart. `progress` is called
/// with the number of bytes transferred so far.
///
/// # Errors
/// [`DeviceError`]. GyroNet's weights in use are then unchanged; FoGNet's may be erased.
pub fn upload<B: Bus>(
    device: &mut Device<B>,
    network: Network,
    file: &[u8],
    mut progress: impl FnMut(usize),
) -> Result<Uploaded, DeviceError> {
    let length = u32::try_from(file.len()).map_err(|_| DeviceError::TooLong)?;
    device.enter(Session::Programming)?;
    let address = match network {
        Network::GyroNet => 0,
        Network::FogNet => 1,
    };
    // Four bytes of address, and four of length.
    device.ask(&[&[0x34, 0, 0x44, 0, 0, 0, address][..], &length.to_be_bytes()].concat())?;
    let mut number = 0u8;
    for (block, end) in file.chunks(BLOCK).zip((BLOCK..).step_by(BLOCK)) {
        number = number.wrapping_add(1);
        device.ask(&[&[0x36, number], block].concat())?;
        progress(end.min(file.len()));
    }
    let response = device.ask(&[0x37])?;
    let [place, crc @ ..] = <[u8; 5]>::try_from(response).map_err(|_| DeviceError::Mismatch)?;
    let places = [Place::Slot(Slot::A), Place::Slot(Slot::B), Place::FogNet];
    let place = *places.get(usize::from(place)).ok_or(DeviceError::Mismatch)?;
    let trailer = device.trailer(USE_DOWNLOAD, file)?;
    device.ask(&[&[0x31, 1][..], &USE_DOWNLOAD.to_be_bytes(), &trailer].concat())?;
    Ok(Uploaded { place, crc: u32::from_be_bytes(crc) })
}
