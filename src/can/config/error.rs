//! Why settings are refused.

use super::{MAX_PERIOD_MS, SAMPLE_MS};
use serde::{Deserialize, Serialize};

/// Why settings are no configuration.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum ConfigError {
    /// Nothing would be sent.
    Empty,
    /// Not a bit rate of a classic CAN bus.
    BitRate(u32),
    /// More than 11 bits, or kept for diagnosis.
    Identifier(u16),
    /// Two messages under one identifier.
    DuplicateIdentifier(u16),
    /// Not a multiple of 10 ms, or over a second.
    Period(u16),
    /// More bits than the mode sends, so that receivers could not tell it from another one.
    DataId(u16),
    /// Two messages with one E2E identifier: exchanged, they would pass.
    DuplicateDataId,
    /// Not an address that a J1939 node can have.
    SourceAddress(u8),
    /// Over 80 % of the bus.
    Overload {
        /// Bus load at worst, 1/1000.
        per_mille: u32,
    },
}

impl core::fmt::Display for ConfigError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::Empty => f.write_str("no message is configured"),
            Self::BitRate(rate) => write!(f, "{rate} bit/s is no bit rate of a classic CAN bus"),
            Self::Identifier(id) => write!(f, "identifier {id:03x} is reserved or has over 11 bits"),
            Self::DuplicateIdentifier(id) => write!(f, "identifier {id:03x} is used twice"),
            Self::Period(period) => {
                write!(f, "period {period} ms is not a multiple of {SAMPLE_MS} up to {MAX_PERIOD_MS}")
            }
            Self::DataId(id) => write!(f, "E2E identifier {id:x} has over 12 bits"),
            Self::DuplicateDataId => f.write_str("an E2E identifier is used twice"),
            Self::SourceAddress(address) => write!(f, "{address} is no J1939 source address"),
            Self::Overload { per_mille } => {
                write!(f, "the messages are {}.{} % of the bus", per_mille / 10, per_mille % 10)
            }
        }
    }
}

impl core::error::Error for ConfigError {}
