//! Profile 1 has its CRC in byte 0, its counter in the low nibble of byte 1, and four ways to include the identifier.
//!
//! AUTOSAR's start and final XOR values cancel: on the bus the polynomial is 0x1D, start 0, no final XOR.

use super::{Fault, ShortHeader};

/// CRC with start 0 and final XOR 0; unlike the J1850 CRC of other messages, although the polynomial is the same.
pub(super) const CRC: crc::Crc<u8> = crc::Crc::<u8>::new(&crc::Algorithm {
    width: 8,
    poly: 0x1D,
    init: 0,
    refin: false,
    refout: false,
    xorout: 0,
    check: 0x37,
    residue: 0,
});

/// Number of counter values, 0 to 14; 15 marks an invalid counter.
pub(super) const COUNTERS: u16 = 15;
/// Longest message, bytes: 240 bits. Above 255 bits the CRC would miss two-bit errors.
const MAX_LEN: usize = 30;
const HEADER: ShortHeader = ShortHeader { max_len: MAX_LEN, counters: COUNTERS };

#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum DataIdMode {
    /// Low byte, high byte (variant 1A).
    Both,
    /// Low byte with an even counter, high byte with an odd one (variant 1B).
    Alternating,
    Low,
    /// Low byte, then 0; the low nibble of the high byte is sent in byte 1 (variant 1C).
    Nibble,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct P01 {
    /// Data identifier, known to both sides. With [`DataIdMode::Nibble`] it has 12 bits.
    pub data_id: u16,
    pub mode: DataIdMode,
}

impl P01 {
    /// Writes the header; the high nibble of byte 1 is data except in [`DataIdMode::Nibble`].
    pub fn protect(&self, data: &mut [u8], counter: u8) -> Result<(), Fault> {
        let nibble = (self.mode == DataIdMode::Nibble).then(|| self.nibble());
        HEADER.protect(data, counter, nibble, |behind| self.crc(counter, behind))
    }

    pub fn check(&self, data: &[u8]) -> Result<u8, Fault> {
        let (counter, nibble) = HEADER.check(data, |counter, behind| self.crc(counter, behind))?;
        if self.mode == DataIdMode::Nibble && nibble != self.nibble() {
            return Err(Fault::DataId { received: nibble });
        }
        Ok(counter)
    }

    fn nibble(&self) -> u8 {
        (self.data_id >> 8) as u8 & 0x0F
    }

    fn crc(&self, counter: u8, behind: &[u8]) -> u8 {
        let [low, high] = self.data_id.to_le_bytes();
        let mut digest = CRC.digest();
        match self.mode {
            DataIdMode::Both => digest.update(&[low, high]),
            DataIdMode::Alternating if counter & 1 == 0 => digest.update(&[low]),
            DataIdMode::Alternating => digest.update(&[high]),
            DataIdMode::Low => digest.update(&[low]),
            DataIdMode::Nibble => digest.update(&[low, 0]),
        }
        digest.update(behind);
        digest.finalize()
    }
}
