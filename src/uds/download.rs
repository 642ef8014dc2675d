//! Download (services 0x34, 0x36, 0x37) of GyroNet's weight file to address 0, the unused slot, and of firmware, as
//! the head of its update says ([`super::update`]), to address 2, the slot that does not run. Either is used from the
//! next start on, and only after routine FF01; until then the old one stays.

use super::exchange::{Download, Exchange};
use super::lock::Seed;
use super::response::{Nrc, nrc, put};
use super::signature;
use crate::service::MappedSlots;
use crate::service::message::{BLOCK, Refusal};
use crate::store::firmware::FirmwareError;
use crate::store::slots::SlotError;
use embedded_storage::nor_flash::NorFlash;

const WEIGHTS: u32 = 0;
/// Address that took FoGNet's file, which this board no longer runs.
const FOGNET: u32 = 1;
const FIRMWARE: u32 = 2;

impl<R: NorFlash, W: MappedSlots, E: FnMut() -> Option<Seed>> Exchange<'_, R, W, E> {
    /// Begins a download with the parameters of 0x34: no compression, the address, the length of the file.
    pub fn begin_download(&mut self, parameters: &[u8]) -> Result<Download, Nrc> {
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
                self.device.weights_begin(length).map_err(nrc)?;
                None
            }
            FOGNET => return Err(self.refuse(Refusal::FogNet)),
            FIRMWARE => {
                let (head, _) = self.services.update.ok_or_else(|| self.refuse(FirmwareError::NoHead))?;
                let slot = self.device.firmware_check(&head.label, head.downgrade).map_err(nrc)?;
                let image = slot.of(head.images);
                if image.length != length {
                    return Err(self.refuse(FirmwareError::Length(length)));
                }
                self.device.firmware_begin(slot, length).map_err(nrc)?;
                Some((head.label, image))
            }
            _ => return Err(Nrc::RequestOutOfRange),
        };
        let [high, low] = (BLOCK as u16 + 2).to_be_bytes();
        put(self.out, &[0x20, high, low])?;
        Ok(Download { image, next: 1, digest: None })
    }

    /// Writes a block. A repeated block is answered again, because its response may have been lost.
    pub fn download_block(&mut self, number: u8, bytes: &[u8]) -> Result<(), Nrc> {
        let download = self.services.download.as_mut().ok_or(Nrc::RequestSequenceError)?;
        put(self.out, &[number])?;
        let Some(upload) = self.device.upload() else { return Err(self.refuse(SlotError::NotBegun)) };
        if number == download.next.wrapping_sub(1) && upload.written() > 0 {
            return Ok(());
        }
        if download.digest.is_some() {
            return Err(Nrc::RequestSequenceError);
        }
        if number != download.next {
            return Err(Nrc::WrongBlockSequenceCounter);
        }
        let expected = upload.missing().min(BLOCK as u32) as usize;
        if bytes.len() != expected || expected == 0 {
            return Err(Nrc::IncorrectMessageLengthOrInvalidFormat);
        }
        self.device.upload_block(bytes).map_err(nrc)?;
        download.next = download.next.wrapping_add(1);
        Ok(())
    }

    /// Checks the whole file in flash. The response holds its slot (0 A, 1 B) and its checksum.
    pub fn finish_download(&mut self) -> Result<(), Nrc> {
        let download = self.services.download.as_mut().ok_or(Nrc::RequestSequenceError)?;
        let digest = match &download.image {
            Some((label, expected)) => self.device.firmware_verify(label, |image| {
                Some(signature::digest(image)).filter(|digest| digest == expected)
            }),
            None => self.device.weights_verify(signature::digest),
        };
        let digest = digest.map_err(nrc)?;
        let (slot, crc) = self.device.uploaded().ok_or(Nrc::GeneralProgrammingFailure)?;
        put(self.out, &[slot as u8])?;
        put(self.out, &crc.to_be_bytes())?;
        download.digest = Some(digest);
        Ok(())
    }
}
