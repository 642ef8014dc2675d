//! This error names the reason why settings are refused.

use super::{MAX_PERIOD_MS, SAMPLE_MS};

/// The reason why settings are no configuration.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum ConfigError {
    /// No message is configured.
    #[error("no message is configured")]
    Empty,
    /// A classic CAN bus has no such bit rate.
    #[error("{0} bit/s is no bit rate of a classic CAN bus")]
    BitRate(u32),
    /// More than 11 bits, or kept for diagnosis.
    #[error("identifier {0:03x} is reserved or has over 11 bits")]
    Identifier(u16),
    /// Two messages under one identifier.
    #[error("identifier {0:03x} is used twice")]
    DuplicateIdentifier(u16),
    /// The period is not a multiple of 10 ms, or over a second.
    #[error("period {0} ms is not a multiple of {SAMPLE_MS} up to {MAX_PERIOD_MS}")]
    Period(u16),
    /// More bits than the mode sends, so that receivers could not tell it from another one.
    #[error("E2E identifier {0:x} has over 12 bits")]
    DataId(u16),
    /// Two messages with one E2E identifier: exchanged, they would pass.
    #[error("an E2E identifier is used twice")]
    DuplicateDataId,
    /// A J1939 node cannot have this address.
    #[error("{0} is no J1939 source address")]
    SourceAddress(u8),
    /// The messages take over 80 % of the bus.
    #[error("the messages are {}.{} % of the bus", .per_mille / 10, .per_mille % 10)]
    Overload {
        /// Bus load at worst, 1/1000.
        per_mille: u32,
    },
}
