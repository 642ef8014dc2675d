//! Formats the board's reports as text, for the host tools; the image does not use it.

use super::device::{Firmware, FirmwareState};
use super::event::ResetCause;
use super::message::{FlashState, Origin};
use core::fmt::{Display, Formatter, Result};

impl Display for ResetCause {
    fn fmt(&self, f: &mut Formatter<'_>) -> Result {
        f.write_str(match self {
            Self::Unknown => "unknown cause (no reset flag is set)",
            Self::PowerOn => "power on",
            Self::BrownOut => "brown-out",
            Self::Pin => "reset pin",
            Self::Software => "software reset",
            Self::Watchdog => "watchdog",
            Self::LowPower => "forbidden low-power mode",
        })
    }
}

impl Display for Origin {
    fn fmt(&self, f: &mut Formatter<'_>) -> Result {
        match self {
            Self::BuiltIn => f.write_str("built in"),
            Self::Stored => f.write_str("stored"),
            Self::Refused(error) => write!(f, "built in; the stored one is refused: {error}"),
        }
    }
}

impl Display for FlashState {
    fn fmt(&self, f: &mut Formatter<'_>) -> Result {
        match self {
            Self::Absent => f.write_str("none that this image can use"),
            Self::Ready => f.write_str("ready"),
            Self::Damaged => f.write_str("a record is damaged, the previous one is used"),
            Self::Failed(error) => write!(f, "cannot be read: {error}"),
        }
    }
}

impl Display for Firmware {
    fn fmt(&self, f: &mut Formatter<'_>) -> Result {
        if let Some(slot) = self.slot {
            write!(f, "slot {slot}, ")?;
        }
        if let Some(crc) = self.crc {
            write!(f, "CRC {crc:08x}, ")?;
        }
        f.write_str(match self.state {
            FirmwareState::Alone => "flashed without the boot loader: no update over diagnosis",
            FirmwareState::Confirmed => "confirmed",
            FirmwareState::OnTrial => "on trial",
            FirmwareState::RolledBack => "the update has failed its trial and was rolled back",
            FirmwareState::NewerDamaged => "the newer firmware is damaged",
        })
    }
}
