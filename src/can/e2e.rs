//! AUTOSAR end-to-end protection (PRS E2E Protocol) adds a CRC and a counter to the start of a message, so that a
//! receiver detects lost and corrupt ones. The CRC also covers an identifier that is not sent.
//!
//! | profile | header | CRC | counter |
//! |---|---|---|---|
//! | [`P01`] | 2 bytes | 8 bit, 0x1D, start 0, final XOR 0 | 0 to 14 |
//! | [`P02`] | 2 bytes | 8 bit, 0x2F, start and final XOR FF | 0 to 15 |
//! | [`P05`] | 3 bytes | 16 bit, 0x1021, start FFFF | 0 to 255 |
//!
//! Over 8 bytes, the CRC detects every error of one or two bits. In P01 with [`DataIdMode::Alternating`] and P02 the
//! counter selects the identifier: an error in it can be hidden from the CRC by a second one, and is then out of
//! sequence. The counter misses only the loss of a multiple of its cycle, so a receiver also needs a timeout. Profile
//! 11 sends the bytes of profile 1.

mod p01;
mod p02;
mod p05;
mod sequence;

pub use p01::{DataIdMode, P01};
pub use p02::P02;
pub use p05::P05;
pub use sequence::{Sequence, Verdict};

#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[allow(missing_docs, reason = "its messages say it")]
pub enum Fault {
    #[error("E2E: {0} bytes do not fit the profile")]
    Length(usize),
    /// The CRC is wrong: the data are corrupt, or belong to another identifier.
    #[error("E2E: CRC is {received:x}, should be {computed:x}")]
    Crc { computed: u16, received: u16 },
    #[error("E2E: identifier nibble {received:x} belongs to another message")]
    DataId { received: u8 },
    #[error("E2E: counter {0} is out of range")]
    Counter(u8),
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Profile {
    P01(P01),
    P02(P02),
    P05(P05),
}

impl Profile {
    /// Returns a mask of the header's bits; bit `8 * byte + bit` of the frame is the same bit of the mask.
    pub const fn header_mask(&self) -> u64 {
        match self {
            Self::P01(P01 { mode: DataIdMode::Nibble, .. }) => 0xFFFF,
            Self::P01(_) | Self::P02(_) => 0x0FFF,
            Self::P05(_) => 0x00FF_FFFF,
        }
    }

    pub const fn counters(&self) -> u16 {
        match self {
            Self::P01(_) => p01::COUNTERS,
            Self::P02(_) => p02::COUNTERS,
            Self::P05(_) => p05::COUNTERS,
        }
    }

    pub fn protect(&self, data: &mut [u8], counter: u8) -> Result<(), Fault> {
        match self {
            Self::P01(profile) => profile.protect(data, counter),
            Self::P02(profile) => profile.protect(data, counter),
            Self::P05(profile) => profile.protect(data, counter),
        }
    }

    /// Checks everything except the sequence, and returns the counter.
    pub fn check(&self, data: &[u8]) -> Result<u8, Fault> {
        match self {
            Self::P01(profile) => profile.check(data),
            Self::P02(profile) => profile.check(data),
            Self::P05(profile) => profile.check(data),
        }
    }
}

#[derive(Debug, Clone, Copy)]
pub struct Protector {
    profile: Profile,
    counter: u8,
}

impl Protector {
    pub const fn new(profile: Profile) -> Self {
        Self { profile, counter: 0 }
    }

    /// Writes the header of the next message; after an error the counter does not advance.
    pub fn protect(&mut self, data: &mut [u8]) -> Result<(), Fault> {
        self.profile.protect(data, self.counter)?;
        self.counter = ((u16::from(self.counter) + 1) % self.profile.counters()) as u8;
        Ok(())
    }
}

#[derive(Debug, Clone, Copy)]
pub struct Checker {
    profile: Profile,
    sequence: Sequence,
}

impl Checker {
    /// Creates a checker; counter steps up to `max_delta` count as loss (1: no message may be lost).
    pub const fn new(profile: Profile, max_delta: u8) -> Self {
        Self { profile, sequence: Sequence::new(profile.counters(), max_delta) }
    }

    /// Checks a message. A corrupt one counts as lost once the next good one arrives.
    pub fn check(&mut self, data: &[u8]) -> Result<Verdict, Fault> {
        let counter = self.profile.check(data)?;
        Ok(self.sequence.check(counter))
    }
}

/// The header of profiles 1 and 2, CRC and a counter of four bits; they differ in these limits and in the CRC's start.
#[derive(Debug, Clone, Copy)]
struct ShortHeader {
    /// Largest number of bytes that the CRC covers, header included.
    max_len: usize,
    counters: u16,
}

impl ShortHeader {
    /// Writes the header. `nibble`, if given, replaces the high nibble of byte 1, which is data otherwise.
    fn protect(
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

    /// Checks CRC and counter; returns the counter and the nibble beside it. `crc` gets both message parts.
    fn check(&self, data: &[u8], crc: impl FnOnce(u8, &[u8]) -> u8) -> Result<(u8, u8), Fault> {
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
