//! Download (services 0x34, 0x36, 0x37) of GyroNet's weight file to address 0, the unused slot, and of firmware, as
//! the head of its update says ([`super::update`]), to address 2, the slot that does not run. Either is used from the
//! next start on, and only after routine FF01; until then the old one stays.

use super::response::{Nrc, Response, nrc, put};
use super::signature::{self, Digest};
use super::update::Head;
use crate::service::message::{BLOCK, Refusal};
use crate::service::{Device, MappedSlots};
use crate::store::Slot;
use crate::store::firmware::{FirmwareError, Label};
use embedded_storage::nor_flash::NorFlash;

const WEIGHTS: u32 = 0;
/// Address that took FoGNet's file, which this board no longer runs.
const FOGNET: u32 = 1;
const FIRMWARE: u32 = 2;

#[derive(Debug)]
pub(super) struct Download {
    /// Label, length and hash of the image, if this is firmware.
    image: Option<(Label, Digest)>,
    length: u32,
    offset: u32,
    /// Number of the next block; it starts at 1 and wraps from 255 to 0.
    next: u8,
    digest: Option<Digest>,
}

impl Download {
    /// Begins a download with the parameters of 0x34: no compression, the address, the length of the file.
    pub fn begin<R: NorFlash, W: MappedSlots>(
        parameters: &[u8],
        head: Option<&Head>,
        device: &mut Device<R, W>,
        out: &mut Response,
    ) -> Result<Self, Nrc> {
        let [format, sizes, rest @ ..] = parameters else {
            return Err(Nrc::IncorrectMessageLengthOrInvalidFormat);
        };
        let (length_bytes, address_bytes) = (usize::from(sizes >> 4), usize::from(sizes & 0xF));
        if *format != 0 || !(1..=4).contains(&length_bytes) || !(1..=4).contains(&address_bytes) {
            return Err(Nrc::RequestOutOfRange);
        }
        if rest.len() != length_bytes + address_bytes {
            return Err(Nrc::IncorrectMessageLengthOrInvalidFormat);
        }
        let (address, length) = rest.split_at(address_bytes);
        let number = |bytes: &[u8]| bytes.iter().fold(0u32, |sum, byte| sum << 8 | u32::from(*byte));
        let (address, length) = (number(address), number(length));
        let image = match address {
            WEIGHTS => {
                device.weights_begin(length).map_err(nrc)?;
                None
            }
            FOGNET => return Err(nrc(device.refuse_request(Refusal::FogNet))),
            FIRMWARE => {
                let refused =
                    |device: &mut Device<R, W>, error| nrc(device.refuse_request(Refusal::Firmware(error)));
                let Some(head) = head else { return Err(refused(device, FirmwareError::NoHead)) };
                let slot = device.firmware_check(&head.label, head.downgrade).map_err(nrc)?;
                let image = slot.of(head.images);
                if image.length != length {
                    return Err(refused(device, FirmwareError::Length(length)));
                }
                device.firmware_begin(slot, length).map_err(nrc)?;
                Some((head.label, image))
            }
            _ => return Err(Nrc::RequestOutOfRange),
        };
        let [high, low] = (BLOCK as u16 + 2).to_be_bytes();
        put(out, &[0x20, high, low])?;
        Ok(Self { image, length, offset: 0, next: 1, digest: None })
    }

    /// Writes a block. A repeated block is answered again, because its response may have been lost.
    pub fn block<R: NorFlash, W: MappedSlots>(
        &mut self,
        number: u8,
        bytes: &[u8],
        device: &mut Device<R, W>,
        out: &mut Response,
    ) -> Result<(), Nrc> {
        put(out, &[number])?;
        if number == self.next.wrapping_sub(1) && self.offset > 0 {
            return Ok(());
        }
        if self.digest.is_some() {
            return Err(Nrc::RequestSequenceError);
        }
        if number != self.next {
            return Err(Nrc::WrongBlockSequenceCounter);
        }
        let left = self.length - self.offset;
        let expected = left.min(BLOCK as u32) as usize;
        if bytes.len() != expected || expected == 0 {
            return Err(Nrc::IncorrectMessageLengthOrInvalidFormat);
        }
        device.weights_block(self.offset, bytes).map_err(nrc)?;
        self.offset += expected as u32;
        self.next = self.next.wrapping_add(1);
        Ok(())
    }

    /// Checks the whole file in flash. The response holds its slot (0 A, 1 B) and its checksum.
    pub fn finish<R: NorFlash, W: MappedSlots>(
        &mut self,
        device: &mut Device<R, W>,
        out: &mut Response,
    ) -> Result<(), Nrc> {
        let digest = match &self.image {
            Some((label, expected)) => device.firmware_verify(label, |image| {
                Some(signature::digest(image)).filter(|digest| digest == expected)
            }),
            None => device.weights_verify(signature::digest),
        };
        let digest = digest.map_err(nrc)?;
        let (slot, crc) = device.uploaded().ok_or(Nrc::GeneralProgrammingFailure)?;
        put(
            out,
            &[match slot {
                Slot::A => 0,
                Slot::B => 1,
            }],
        )?;
        put(out, &crc.to_be_bytes())?;
        self.digest = Some(digest);
        Ok(())
    }

    /// Returns the digest of the file, once the file has been checked, and whether it is firmware.
    pub fn checked(&self) -> Option<(&Digest, bool)> {
        Some((self.digest.as_ref()?, self.image.is_some()))
    }
}
