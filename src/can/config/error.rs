//! Defines the reasons why settings are refused.

use super::{BIT_RATES, MAX_BUS_LOAD, MAX_PERIOD_MS, SAMPLE_MS};

/// The reason why settings are refused.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
#[allow(missing_docs, reason = "its messages say it")]
pub enum ConfigError {
    #[error("no message is configured")]
    Empty,
    #[error("bits_per_second: {0} is not one of {BIT_RATES:?}")]
    BitRate(u32),
    #[error("identifier {0} (0x{0:03x}) is above 2047, or reserved for diagnosis (0x7df to 0x7ef)")]
    Identifier(u16),
    #[error("identifier {0} (0x{0:03x}) is used twice")]
    DuplicateIdentifier(u16),
    #[error("period_ms: {0} is not a multiple of {SAMPLE_MS} up to {MAX_PERIOD_MS}")]
    Period(u16),
    #[error("E2E identifier {0:x} has more than 12 bits")]
    DataId(u16),
    /// Two messages have the same E2E identifier; a receiver would not notice if they were swapped.
    #[error("an E2E identifier is used twice")]
    DuplicateDataId,
    #[error(
        "the messages are {}.{} % of the bus at {} kbit/s, above {} %",
        .per_mille / 10, .per_mille % 10, .bits_per_second / 1_000, MAX_BUS_LOAD / 10
    )]
    Overload { per_mille: u32, bits_per_second: u32 },
}
