//! Profile 2 has its CRC in byte 0 and its counter in the low nibble of byte 1. The counter selects one of sixteen
//! identifiers, which enters the CRC last. Profile 22 sends the same bytes.

use super::{Fault, ShortHeader};

/// CRC-8-AUTOSAR (8H2F): polynomial 0x2F, start and final XOR FF.
const CRC: crc::Crc<u8> = crc::Crc::<u8>::new(&crc::CRC_8_AUTOSAR);
pub(super) const COUNTERS: u16 = 16;
/// Longest message, bytes: with the identifier at most 127 bits, the order of the polynomial.
const MAX_LEN: usize = 14;
const HEADER: ShortHeader = ShortHeader { max_len: MAX_LEN, counters: COUNTERS };

#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct P02 {
    pub data_ids: [u8; 16],
}

impl P02 {
    /// Writes the header; the high nibble of byte 1 is data.
    pub fn protect(&self, data: &mut [u8], counter: u8) -> Result<(), Fault> {
        HEADER.protect(data, counter, None, |behind| self.crc(counter, behind))
    }

    pub fn check(&self, data: &[u8]) -> Result<u8, Fault> {
        HEADER.check(data, |counter, behind| self.crc(counter, behind)).map(|(counter, _)| counter)
    }

    fn crc(&self, counter: u8, behind: &[u8]) -> u8 {
        let mut digest = CRC.digest();
        digest.update(behind);
        digest.update(&[self.data_ids[usize::from(counter & 0x0F)]]);
        digest.finalize()
    }
}
