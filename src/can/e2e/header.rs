//! Profiles 1, 2 and 11 share a two-byte header: CRC in byte 0, counter in the low nibble of byte 1. What enters
//! the CRC besides the data is the profile's own.

use super::Fault;

/// The properties in which the profiles differ.
#[derive(Debug, Clone, Copy)]
pub(super) struct ShortHeader {
    /// The longest data that the CRC covers, the header included.
    pub max_len: usize,
    /// Values of the counter: 0 up to this.
    pub counters: u16,
}

impl ShortHeader {
    /// Writes the header; `nibble` replaces the high one of byte 1, which is data otherwise.
    pub fn protect(
        &self,
        data: &mut [u8],
        counter: u8,
        nibble: Option<u8>,
        crc: impl FnOnce(&[u8]) -> u8,
    ) -> Result<(), Fault> {
        if data.len() > self.max_len {
            return Err(Fault::Length(data.len()));
        }
        if u16::from(counter) >= self.counters {
            return Err(Fault::Counter(counter));
        }
        let len = data.len();
        let Some((first, behind)) = data.split_first_mut() else { return Err(Fault::Length(len)) };
        let Some(header) = behind.first_mut() else { return Err(Fault::Length(len)) };
        *header = nibble.map_or(*header & 0xF0, |nibble| nibble << 4) | counter;
        *first = crc(behind);
        Ok(())
    }

    /// Checks CRC and counter; gives the counter and the high nibble of byte 1. `crc` gets the
    /// counter and what stands behind the CRC.
    pub fn check(&self, data: &[u8], crc: impl FnOnce(u8, &[u8]) -> u8) -> Result<(u8, u8), Fault> {
        let [received, behind @ ..] = data else { return Err(Fault::Length(data.len())) };
        let Some(header) = behind.first() else { return Err(Fault::Length(data.len())) };
        if data.len() > self.max_len {
            return Err(Fault::Length(data.len()));
        }
        let counter = header & 0x0F;
        let computed = crc(counter, behind);
        if computed != *received {
            return Err(Fault::Crc { computed: computed.into(), received: (*received).into() });
        }
        if u16::from(counter) >= self.counters {
            return Err(Fault::Counter(counter));
        }
        Ok((counter, header >> 4))
    }
}
