//! Profiles 1, 2 and 11 share a two-byte header: CRC in byte 0, counter in the low nibble of byte 1. Each profile
//! defines what enters the CRC in addition to the data.

use super::Fault;

/// The two-byte header, with the limits in which the profiles differ.
#[derive(Debug, Clone, Copy)]
pub(super) struct ShortHeader {
    /// Largest number of bytes that the CRC covers, header included.
    pub max_len: usize,
    /// Number of counter values; the counter stays below it.
    pub counters: u16,
}

impl ShortHeader {
    /// Writes the header. `nibble`, if given, replaces the high nibble of byte 1, which is data otherwise.
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

    /// Checks CRC and counter, and returns the counter and the high nibble of byte 1. `crc` gets the
    /// counter and the bytes after the CRC.
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
