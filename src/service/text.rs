//! Formats the board's reports as text, for the host tools; the image does not use it.

use super::device::{Firmware, FirmwareState};
use super::event::{EventKind, ResetCause, SensorFault};
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

impl Display for SensorFault {
    fn fmt(&self, f: &mut Formatter<'_>) -> Result {
        match self {
            Self::Bus => f.write_str("the SPI controller did not answer"),
            Self::SelfTest => f.write_str("its self-test has failed"),
            Self::Foreign(mid) => {
                write!(f, "it sends messages {mid:02x} alone, no MTData2 (36) of up to 254 bytes")
            }
            Self::Reset => f.write_str("the sensor did not restart after its reset"),
            Self::Identity(identity @ (0 | 0xFF)) => {
                write!(f, "no sensor answers (identity {identity:#04x})")
            }
            Self::Identity(identity) => write!(f, "another sensor answers (identity {identity:#04x})"),
            Self::Setting { bank, address, got } => {
                write!(f, "register {address:#04x} of bank {bank} holds {got:#04x}, not what was written")
            }
        }
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

impl Display for EventKind {
    fn fmt(&self, f: &mut Formatter<'_>) -> Result {
        match self {
            Self::Started(cause) => write!(f, "started by {cause}"),
            Self::Crashed(crash) => write!(f, "crashed before: {crash}"),
            Self::WheelsRefused(error) => {
                write!(f, "stored wheel settings refused, built-in ones used: {error}")
            }
            Self::ConfigurationRefused(error) => {
                write!(f, "stored configuration refused, defaults used: {error}")
            }
            Self::CalibrationRefused(error) => write!(f, "stored calibration refused: {error}"),
            Self::AcceptedRefused(error) => write!(f, "record of accepted weights refused: {error}"),
            Self::SlotRefused(slot, error) => write!(f, "slot {slot} not used: {error}"),
            Self::NoWeights => f.write_str("no valid weights: the network is off"),
            Self::Status(status) => write!(f, "status: {status}"),
            Self::ConfigurationStored => f.write_str("configuration stored"),
            Self::WheelsStored => f.write_str("wheel settings stored"),
            Self::CalibrationStored => f.write_str("calibration stored"),
            Self::WeightsAccepted(slot) => write!(f, "weights in slot {slot} accepted"),
            Self::FirmwareStored(slot) => {
                write!(f, "firmware in slot {slot} starts on trial at the next start")
            }
            Self::FirmwareConfirmed(slot) => write!(f, "firmware in slot {slot} confirmed"),
            Self::FirmwareRefused(slot) => {
                write!(f, "newer firmware in slot {slot} not used: its trial failed, or it is damaged")
            }
            Self::WeightsDamaged => f.write_str("weights in use damaged: the network is off"),
            Self::RecordsDamaged => f.write_str("stored records damaged: older or built-in ones are used"),
            Self::Sensor(None) => f.write_str("sensor set up"),
            Self::AccessRefused(error) => write!(f, "access record refused, nobody may write: {error}"),
            Self::KeyStored => f.write_str("key stored: written data must be signed"),
            Self::KeyRemoved => f.write_str("key removed: everyone may write"),
            Self::LearnedRefused(error) => write!(f, "learned data not read or stored: {error}"),
            Self::LearnedStored => f.write_str("learned data stored"),
            Self::NoRoom(error) => write!(f, "cannot make room for new records: {error}"),
            Self::MountMoved => f.write_str("the sensor was moved since earlier drives"),
            Self::TroublesRefused(error) => write!(f, "trouble memory not read or stored: {error}"),
            Self::Sensor(Some(fault)) => write!(f, "sensor not set up: {fault}"),
            Self::FlashRefused(fault) => write!(f, "nothing is stored until a restart: flash: {fault}"),
        }
    }
}
