//! Defines the reasons why settings are refused.

use super::{BIT_RATES, MAX_BUS_LOAD, MAX_PERIOD_MS, SAMPLE_MS};

/// The reason why settings are refused.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum ConfigError {
    /// No message is configured.
    #[error("no message is configured")]
    Empty,
    /// The bit rate is not one of [`BIT_RATES`].
    #[error("bits_per_second: {0} is not one of {BIT_RATES:?}")]
    BitRate(u32),
    /// An identifier has more than 11 bits, or is reserved for diagnosis.
    #[error("identifier {0:03x} is reserved or has more than 11 bits")]
    Identifier(u16),
    /// Two messages have the same identifier.
    #[error("identifier {0:03x} is used twice")]
    DuplicateIdentifier(u16),
    /// The period is zero, not a multiple of 10 ms, or longer than a second.
    #[error("period {0} ms is not a multiple of {SAMPLE_MS} up to {MAX_PERIOD_MS}")]
    Period(u16),
    /// An E2E identifier has more bits than the mode uses, so receivers could confuse it with another.
    #[error("E2E identifier {0:x} has more than 12 bits")]
    DataId(u16),
    /// Two messages have the same E2E identifier; a receiver would not notice if they were swapped.
    #[error("an E2E identifier is used twice")]
    DuplicateDataId,
    /// The source address is not valid for a J1939 node.
    #[error("{0} is not a J1939 source address")]
    SourceAddress(u8),
    /// The worst-case bus load is above 80 %.
    #[error(
        "the messages are {}.{} % of the bus at {} kbit/s, above {} %",
        .per_mille / 10, .per_mille % 10, .bits_per_second / 1_000, MAX_BUS_LOAD / 10
    )]
    Overload {
        /// Worst-case bus load, 1/1000.
        per_mille: u32,
        /// Bit rate of the bus, bit/s.
        bits_per_second: u32,
    },
}
