//! Download of GyroNet's weight file (services 0x34, 0x36, 0x37) to address 0, which is the unused slot.
//!
//! The file is used from the next start on, and only after routine FF01. If a download is interrupted before that,
//! GyroNet keeps its old file.

use super::response::{Nrc, Response, nrc, put};
use super::signature::{Digest, Hasher};
use crate::service::message::{BLOCK, Refusal};
use crate::service::{Device, MappedSlots};
use crate::store::Slot;
use embedded_storage::nor_flash::NorFlash;

/// Address that took FoGNet's file, which this board no longer runs.
const FOGNET: u32 = 1;

#[derive(Debug)]
pub(super) struct Download {
    length: u32,
    offset: u32,
    /// Number of the next block; it starts at 1 and wraps from 255 to 0.
    next: u8,
    /// Hash of the file so far, for the signature check.
    hasher: Hasher,
    /// Digest of the whole file, once the file has been checked.
    digest: Option<Digest>,
}

impl Download {
    /// Begins a download with the parameters of 0x34: no compression, the address, the length of the file.
    pub fn begin<R: NorFlash, W: MappedSlots>(
        parameters: &[u8],
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
        match number(address) {
            0 => {}
            FOGNET => return Err(nrc(device.refuse_request(Refusal::FogNet))),
            _ => return Err(Nrc::RequestOutOfRange),
        }
        let length = number(length);
        device.weights_begin(length).map_err(nrc)?;
        let [high, low] = (BLOCK as u16 + 2).to_be_bytes();
        put(out, &[0x20, high, low])?;
        Ok(Self { length, offset: 0, next: 1, hasher: Hasher::new(), digest: None })
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
        self.hasher.update(bytes);
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
        if self.offset < self.length {
            return Err(Nrc::RequestSequenceError);
        }
        device.weights_verify().map_err(nrc)?;
        let (slot, crc) = device.uploaded().ok_or(Nrc::GeneralProgrammingFailure)?;
        put(
            out,
            &[match slot {
                Slot::A => 0,
                Slot::B => 1,
            }],
        )?;
        put(out, &crc.to_be_bytes())?;
        let hasher = &mut self.hasher;
        self.digest.get_or_insert_with(|| hasher.finish());
        Ok(())
    }

    /// Returns the digest of the file, once the file has been checked.
    pub fn digest(&self) -> Option<&Digest> {
        self.digest.as_ref()
    }
}
