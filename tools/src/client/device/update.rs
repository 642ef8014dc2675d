//! Updates the firmware of a board.

use super::requests::{FIRMWARE, USE_DOWNLOAD};
use super::upload::transfer;
use super::{Device, DeviceError};
use crate::client::bus::Bus;
use gyronet::store::Slot;
use gyronet::store::firmware::{FirmwareError, Label};
use gyronet::uds::Session;
use gyronet::uds::signature::digest;
use gyronet::uds::update::{HEAD, Head};

const ADDRESS: u32 = 2;

/// The file of an update: its head, the image for slot A, the image for slot B.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Update {
    pub head: Head,
    /// The image for each slot.
    pub images: [Vec<u8>; 2],
}

impl Update {
    pub fn new(label: Label, images: [Vec<u8>; 2]) -> Self {
        let [a, b] = &images;
        Self { head: Head { label, downgrade: false, images: [digest(a), digest(b)] }, images }
    }

    /// Reads an update, which is complete and whose images are those of its head.
    pub fn parse(bytes: &[u8]) -> Result<Self, DeviceError> {
        let parsed = bytes.split_first_chunk::<HEAD>().and_then(|(head, rest)| {
            let head = Head::parse(head)?;
            let (a, b) = rest.split_at_checked(head.images[0].length as usize)?;
            let update = Self { head, images: [a.to_vec(), b.to_vec()] };
            ([digest(a), digest(b)] == head.images).then_some(update)
        });
        parsed.ok_or(DeviceError::Refused(FirmwareError::NotAnUpdate.into()))
    }

    pub fn bytes(&self) -> Vec<u8> {
        let [a, b] = &self.images;
        [&self.head.bytes()[..], a, b].concat()
    }
}

/// Transfers the image for the slot that does not run. It starts on trial at the next start. `progress` is called with the
/// number of bytes transferred so far and the size of the image.
pub fn update<B: Bus>(
    device: &mut Device<B>,
    update: &Update,
    mut progress: impl FnMut(usize, usize),
) -> Result<Slot, DeviceError> {
    device.enter(Session::Programming)?;
    let head = update.head.bytes();
    let trailer = device.trailer(FIRMWARE, &head)?;
    device.ask(&[&[0x2E][..], &FIRMWARE.to_be_bytes(), &head, &trailer].concat())?;
    let runs = device.read(FIRMWARE)?;
    let spare = usize::from(runs.first() == Some(&0));
    let image = &update.images[spare];
    let uploaded = transfer(device, ADDRESS, image, |sent| progress(sent, image.len()))?;
    device.ask_at_rest(&[&[0x31, 1][..], &USE_DOWNLOAD.to_be_bytes()].concat())?;
    Ok(uploaded.slot)
}
