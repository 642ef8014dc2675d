//! What may have happened to the board: the cause of its last reset, a crash, and the faults of its hardware.

pub use super::crash::{Crash, CrashKind};
use serde::{Deserialize, Serialize};

/// The cause of the last reset, from the reset flags (RM0090 7.3.21).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum ResetCause {
    /// No flag is set.
    Unknown,
    /// Power-on reset.
    PowerOn,
    /// The supply voltage was too low.
    BrownOut,
    /// Reset pin.
    Pin,
    /// Software reset, by a request or after a crash (see [`Crash`]).
    Software,
    /// Watchdog reset.
    Watchdog,
    /// Reset by a forbidden low-power mode.
    LowPower,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, thiserror::Error)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[allow(missing_docs, reason = "its messages say it")]
pub enum SensorFault {
    #[error("the SPI controller did not answer")]
    Bus,
    #[error("the sensor did not restart after its reset")]
    Reset,
    #[error("its self-test has failed")]
    SelfTest,
    #[error("it sends messages {0:02x} alone, no MTData2 (36) of up to 254 bytes")]
    Foreign(u8),
    #[error("{} answers (identity {id:#04x})", if matches!(.0, 0 | 0xFF) { "no sensor" } else { "another sensor" }, id = .0)]
    Identity(u8),
    #[error("register {address:#04x} of bank {bank} holds {got:#04x}, not what was written")]
    Setting { bank: u8, address: u8, got: u8 },
}

/// The reason why the board runs on its internal 16 MHz oscillator, which is not accurate enough for CAN.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, thiserror::Error)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[allow(missing_docs, reason = "its messages say it")]
pub enum ClockFault {
    /// The board restarts when the voltage has risen.
    #[error("the supply is below 3.0 V")]
    SupplyLow,
    /// The board restarts when the crystal runs.
    #[error("the crystal did not start")]
    NoCrystal,
    /// Measured frequency, kHz, as accurate as the internal oscillator; 0 if it could not be measured.
    #[error(fmt = crystal)]
    CrystalFrequency { khz: u16 },
    #[error("the PLL did not lock")]
    Pll,
}

fn crystal(khz: &u16, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
    match khz {
        0 => f.write_str("the crystal's frequency could not be measured"),
        _ => write!(f, "the crystal has {}.{:03} MHz", khz / 1_000, khz % 1_000),
    }
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
