//! Profile 11 sends the same bytes as profile 1 in its modes Both and Nibble.

use super::Fault;
use super::p01::{DataIdMode, P01};

/// The choice of bytes of the identifier that enter the CRC.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum P11Mode {
    /// Low byte, high byte (variant 11A).
    Both,
    /// Low byte, then 0; the low nibble of the high byte is sent in byte 1 (variant 11C).
    Nibble,
}

/// Protects and checks one message with profile 11.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct P11 {
    /// Data identifier, known to both sides. With [`P11Mode::Nibble`] it has 12 bits.
    pub data_id: u16,
    /// The bytes of the identifier that enter the CRC.
    pub mode: P11Mode,
}

impl P11 {
    const fn as_p01(self) -> P01 {
        let mode = match self.mode {
            P11Mode::Both => DataIdMode::Both,
            P11Mode::Nibble => DataIdMode::Nibble,
        };
        P01 { data_id: self.data_id, mode }
    }

    /// Writes the header.
    ///
    /// # Errors
    /// [`Fault::Length`] and [`Fault::Counter`].
    pub fn protect(&self, data: &mut [u8], counter: u8) -> Result<(), Fault> {
        self.as_p01().protect(data, counter)
    }

    /// Checks CRC, identifier and range of the counter, and returns the counter.
    pub fn check(&self, data: &[u8]) -> Result<u8, Fault> {
        self.as_p01().check(data)
    }
}
