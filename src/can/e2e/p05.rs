//! Profile 5 has its CRC in bytes 0 and 1, little-endian, and its counter in byte 2.

use super::Fault;

/// CRC-16-CCITT-FALSE: polynomial 0x1021, start FFFF, no final XOR.
const CRC: crc::Crc<u16> = crc::Crc::<u16>::new(&crc::CRC_16_IBM_3740);
pub(super) const COUNTERS: u16 = 256;
/// Longest message, bytes. The specification's limit of 4096 is one bit more than the CRC covers; CAN needs 64.
const MAX_LEN: usize = 64;

#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct P05 {
    /// Data identifier, known to both sides; it enters the CRC last, low byte first.
    pub data_id: u16,
}

impl P05 {
    pub fn protect(&self, data: &mut [u8], counter: u8) -> Result<(), Fault> {
        let len = data.len();
        let [crc_low, crc_high, header, rest @ ..] = data else { return Err(Fault::Length(len)) };
        if len > MAX_LEN {
            return Err(Fault::Length(len));
        }
        *header = counter;
        [*crc_low, *crc_high] = self.crc(counter, rest).to_le_bytes();
        Ok(())
    }

    pub fn check(&self, data: &[u8]) -> Result<u8, Fault> {
        let &[low, high, counter, ref rest @ ..] = data else {
            return Err(Fault::Length(data.len()));
        };
        if data.len() > MAX_LEN {
            return Err(Fault::Length(data.len()));
        }
        let received = u16::from_le_bytes([low, high]);
        let computed = self.crc(counter, rest);
        if computed == received { Ok(counter) } else { Err(Fault::Crc { computed, received }) }
    }

    fn crc(&self, counter: u8, rest: &[u8]) -> u16 {
        let mut digest = CRC.digest();
        digest.update(&[counter]);
        digest.update(rest);
        digest.update(&self.data_id.to_le_bytes());
        digest.finalize()
    }
}
