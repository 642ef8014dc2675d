//! AUTOSAR end-to-end protection (PRS E2E Protocol) adds a CRC, a counter and an identifier that is not sent, so that a
//! receiver notices loss and damage on the path between two ECUs.
//!
//! | profile | header | CRC | counter |
//! |---|---|---|---|
//! | [`P01`] | 2 bytes | 8 bit, 0x1D, start 0, final XOR 0 | 0 to 14 |
//! | [`P02`] | 2 bytes | 8 bit, 0x2F, start and final XOR FF | 0 to 15 |
//! | [`P05`] | 3 bytes | 16 bit, 0x1021, start FFFF | 0 to 255 |
//! | [`P11`] | 2 bytes | as P01 | 0 to 14 |
//!
//! What they promise over 8 bytes: every error of one or two bits fails the CRC (0x1D has order
//! 255, 0x2F 127, 0x1021 32767 bits). Where the counter selects the identifier (P01 with
//! [`DataIdMode::Alternating`], P02) an error in the counter exchanges the identifier too, and a
//! second bit can hide it from the CRC; the counter is then out of sequence. A counter sees
//! every loss but that of a whole multiple of its cycle: a receiver needs a time-out besides.
//!
//! The header is at the start of the data in all of them.

mod header;
mod p01;
mod p02;
mod p05;
mod p11;
mod sequence;

pub use p01::{DataIdMode, P01};
pub use p02::P02;
pub use p05::P05;
pub use p11::{P11, P11Mode};
pub use sequence::{Sequence, Verdict};

/// The reason why protected data are not to be used.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum Fault {
    /// Shorter than the header, or longer than the profile covers.
    #[error("E2E: {0} bytes do not fit the profile")]
    Length(usize),
    /// The CRC does not fit: damaged, or not the data that were meant (identifier).
    #[error("E2E: CRC is {received:x}, should be {computed:x}")]
    Crc {
        /// The CRC of the received data.
        computed: u16,
        /// The value as received.
        received: u16,
    },
    /// The part of the identifier that is sent is another one.
    #[error("E2E: identifier nibble {received:x} is foreign")]
    DataId {
        /// The value as received.
        received: u8,
    },
    /// A counter value that does not occur.
    #[error("E2E: counter {0} does not occur")]
    Counter(u8),
}

/// One of the profiles with its identifier.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Profile {
    /// Profile 1.
    P01(P01),
    /// Profile 2.
    P02(P02),
    /// Profile 5.
    P05(P05),
    /// Profile 11.
    P11(P11),
}

impl Profile {
    /// Returns the number of bytes at the start of the data that belong to the profile.
    #[must_use]
    pub const fn header_len(&self) -> usize {
        match self {
            Self::P01(_) | Self::P02(_) | Self::P11(_) => 2,
            Self::P05(_) => 3,
        }
    }

    /// Returns the bits of the frame that belong to the header: bit `8 * byte + bit` of the frame is that bit here.
    #[must_use]
    pub const fn header_mask(&self) -> u64 {
        match self {
            Self::P01(P01 { mode: DataIdMode::Nibble, .. })
            | Self::P11(P11 { mode: P11Mode::Nibble, .. }) => 0xFFFF,
            Self::P01(_) | Self::P02(_) | Self::P11(_) => 0x0FFF,
            Self::P05(_) => 0x00FF_FFFF,
        }
    }

    /// Returns the number of counter values; after the last one comes 0.
    #[must_use]
    pub const fn counters(&self) -> u16 {
        match self {
            Self::P01(_) | Self::P11(_) => p01::COUNTERS,
            Self::P02(_) => p02::COUNTERS,
            Self::P05(_) => p05::COUNTERS,
        }
    }

    /// Writes the header for the data behind it.
    ///
    /// # Errors
    /// [`Fault::Length`] and [`Fault::Counter`].
    pub fn protect(&self, data: &mut [u8], counter: u8) -> Result<(), Fault> {
        match self {
            Self::P01(profile) => profile.protect(data, counter),
            Self::P02(profile) => profile.protect(data, counter),
            Self::P05(profile) => profile.protect(data, counter),
            Self::P11(profile) => profile.protect(data, counter),
        }
    }

    /// Checks everything but the sequence; gives the counter.
    ///
    /// # Errors
    /// [`Fault`].
    pub fn check(&self, data: &[u8]) -> Result<u8, Fault> {
        match self {
            Self::P01(profile) => profile.check(data),
            Self::P02(profile) => profile.check(data),
            Self::P05(profile) => profile.check(data),
            Self::P11(profile) => profile.check(data),
        }
    }
}

/// The sending side of one message: the profile and its counter.
#[derive(Debug, Clone, Copy)]
pub struct Protector {
    profile: Profile,
    counter: u8,
}

impl Protector {
    /// Begins with counter 0.
    #[must_use]
    pub const fn new(profile: Profile) -> Self {
        Self { profile, counter: 0 }
    }

    /// Protects the next message: it sets the counter and the checksum.
    ///
    /// # Errors
    /// [`Fault::Length`]; the counter stays.
    pub fn protect(&mut self, data: &mut [u8]) -> Result<(), Fault> {
        self.profile.protect(data, self.counter)?;
        self.counter = ((u16::from(self.counter) + 1) % self.profile.counters()) as u8;
        Ok(())
    }
}

/// Checks one message on the receiving side.
#[derive(Debug, Clone, Copy)]
pub struct Checker {
    profile: Profile,
    sequence: Sequence,
}

impl Checker {
    /// Begins before the first message. `max_delta` is the largest step of the counter that still counts as loss
    /// (1: no message may be lost).
    #[must_use]
    pub const fn new(profile: Profile, max_delta: u8) -> Self {
        Self { profile, sequence: Sequence::new(profile.counters(), max_delta) }
    }

    /// Judges one message. A damaged one says nothing of the sequence, so it counts as lost when
    /// the next good one comes.
    ///
    /// # Errors
    /// [`Fault`].
    pub fn check(&mut self, data: &[u8]) -> Result<Verdict, Fault> {
        let counter = self.profile.check(data)?;
        Ok(self.sequence.check(counter))
    }
}
