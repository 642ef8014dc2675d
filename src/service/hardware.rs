//! These are the faults that the board finds in its own hardware while it starts.

use core::fmt;
use serde::{Deserialize, Serialize};

/// The reason why the board runs on its internal oscillator of 16 MHz, which is too inexact for CAN.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum ClockFault {
    /// The board is emulated without a clock tree.
    Emulated,
    /// The supply stayed below 3.0 V. The board restarts when it has risen.
    SupplyLow,
    /// The crystal did not start. The board restarts when it runs.
    NoCrystal,
    /// The crystal has another frequency than the board's description says.
    CrystalFrequency {
        /// The measured frequency, kHz, as exact as the internal oscillator; 0: it could not be measured.
        khz: u16,
    },
    /// The PLL or the flash latency was not taken over.
    Pll,
}

/// The reason why the CAN controller does not take part in the bus.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, thiserror::Error)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum CanFault {
    /// The clock is not exact enough.
    #[error("the clock is not exact enough")]
    Clock,
    /// The controller did not leave its sleep mode.
    #[error("the controller does not wake up")]
    Sleeping,
    /// The controller did not enter initialisation mode.
    #[error("the controller does not enter initialisation mode")]
    NotInitialising,
}

impl fmt::Display for ClockFault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Emulated => f.write_str("the board is emulated without a clock tree"),
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
