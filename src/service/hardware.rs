//! Defines the faults that the board detects in its own hardware at the start.

use core::fmt;
use serde::{Deserialize, Serialize};

/// The reason why the board runs on its internal 16 MHz oscillator, which is not accurate enough for CAN.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum ClockFault {
    /// The supply stayed below 3.0 V. The board restarts when the voltage has risen.
    SupplyLow,
    /// The crystal did not start. The board restarts when the crystal runs.
    NoCrystal,
    /// The frequency of the crystal differs from that in the board's description.
    CrystalFrequency {
        /// Measured frequency, kHz, as accurate as the internal oscillator; 0 if it could not be measured.
        khz: u16,
    },
    /// The PLL did not lock, or the flash latency was not accepted.
    Pll,
}

/// The reason why the CAN controller did not start, or sends no CAN FD.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, thiserror::Error)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[allow(missing_docs, reason = "its messages say it")]
pub enum CanFault {
    #[error("the clock is not exact enough")]
    Clock,
    #[error("the controller does not wake up")]
    Sleeping,
    #[error("the controller does not enter initialisation mode")]
    NotInitialising,
    #[error("no node takes CAN FD frames, so they are no longer sent")]
    Fd,
}

impl fmt::Display for ClockFault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::SupplyLow => f.write_str("the supply is below 3.0 V"),
            Self::NoCrystal => f.write_str("the crystal did not start"),
            Self::CrystalFrequency { khz: 0 } => f.write_str("the crystal's frequency could not be measured"),
            Self::CrystalFrequency { khz } => {
                write!(f, "the crystal has {}.{:03} MHz", khz / 1_000, khz % 1_000)
            }
            Self::Pll => f.write_str("the PLL did not lock"),
        }
    }
}
