//! Profile 2: byte 0 CRC, low nibble of byte 1 counter; the counter selects one of sixteen
//! identifiers, which enters the CRC last. Profile 22 puts the same bytes on the bus.

use super::Fault;

/// CRC-8-AUTOSAR (8H2F): polynomial 0x2F, start and final XOR FF.
const CRC: crc::Crc<u8> = crc::Crc::<u8>::new(&crc::CRC_8_AUTOSAR);
/// All values of the nibble.
pub(super) const COUNTERS: u16 = 16;
/// With the identifier this is at most 127 bits, the order of the polynomial.
const MAX_LEN: usize = 14;

/// Profile 2 of one message.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct P02 {
    /// Identifier for each counter value.
    pub data_ids: [u8; 16],
}

impl P02 {
    /// Writes the header; the high nibble of byte 1 is data.
    ///
    /// # Errors
    /// [`Fault::Length`] and [`Fault::Counter`].
    pub fn protect(&self, data: &mut [u8], counter: u8) -> Result<(), Fault> {
        let len = data.len();
        if len > MAX_LEN {
            return Err(Fault::Length(len));
        }
        if u16::from(counter) >= COUNTERS {
            return Err(Fault::Counter(counter));
        }
        let [_, header, ..] = data else { return Err(Fault::Length(len)) };
        *header = (*header & 0xF0) | counter;
        let computed = self.crc(counter, data.get(1..).unwrap_or_default());
        if let Some(crc) = data.first_mut() {
            *crc = computed;
        }
        Ok(())
    }

    /// Checks the CRC; gives the counter.
    ///
    /// # Errors
    /// [`Fault`].
    pub fn check(&self, data: &[u8]) -> Result<u8, Fault> {
        let &[received, header, ..] = data else { return Err(Fault::Length(data.len())) };
        if data.len() > MAX_LEN {
            return Err(Fault::Length(data.len()));
        }
        let counter = header & 0x0F;
        let computed = self.crc(counter, data.get(1..).unwrap_or_default());
        if computed != received {
            return Err(Fault::Crc { computed: computed.into(), received: received.into() });
        }
        Ok(counter)
    }

    fn crc(&self, counter: u8, behind: &[u8]) -> u8 {
        let mut digest = CRC.digest();
        digest.update(behind);
        digest.update(&[self.data_ids[usize::from(counter & 0x0F)]]);
        digest.finalize()
    }
}
