//! What may have happened to the board: the cause of its last reset, a crash, and the faults of its hardware.

pub use super::crash::{Crash, CrashKind};
pub use super::hardware::{CanFault, ClockFault};
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
