//! These are the messages that configure an MTi to send what the pipeline needs.

use super::mtdata2::id;
use super::xbus;
use crate::sensor::serial::MAX_SENT;
use heapless::Vec;

/// The message identifiers; an acknowledgement has the next higher one.
pub mod mid {
    /// Requests the device identifier.
    pub const REQ_DID: u8 = 0x00;
    /// Starts measuring.
    pub const GO_TO_MEASUREMENT: u8 = 0x10;
    /// Stops measuring.
    pub const GO_TO_CONFIG: u8 = 0x30;
    /// Reports that the sensor has started.
    pub const WAKE_UP: u8 = 0x3E;
    /// Acknowledges [`WAKE_UP`].
    pub const WAKE_UP_ACK: u8 = 0x3F;
    /// Reports that the sensor refused a message; one byte is the error code.
    pub const ERROR: u8 = 0x42;
    /// Sets the outputs and their rates.
    pub const SET_OUTPUT_CONFIGURATION: u8 = 0xC0;
}

/// Rate code of outputs that are sent with every message, such as counters and time stamps.
const EVERY_MESSAGE: u16 = 0xFFFF;

/// One output of the sensor.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Output {
    /// Data identifier.
    pub id: u16,
    /// Rate, Hz.
    pub rate: u16,
}

/// The outputs that the pipeline needs: 100 Hz, all in single precision.
pub const OUTPUTS: [Output; 6] = [
    Output { id: id::PACKET_COUNTER, rate: EVERY_MESSAGE },
    Output { id: id::SAMPLE_TIME_FINE, rate: EVERY_MESSAGE },
    Output { id: id::ACCELERATION, rate: 100 },
    Output { id: id::RATE_OF_TURN, rate: 100 },
    Output { id: id::TEMPERATURE, rate: 1 },
    Output { id: id::STATUS_WORD, rate: EVERY_MESSAGE },
];

/// A step of the dialogue: one message.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Step {
    /// Stop measuring.
    GoToConfig,
    /// Set the outputs to [`OUTPUTS`].
    SetOutputConfiguration,
    /// Start measuring.
    GoToMeasurement,
}

impl Step {
    pub(super) const fn mid(self) -> u8 {
        match self {
            Self::GoToConfig => mid::GO_TO_CONFIG,
            Self::SetOutputConfiguration => mid::SET_OUTPUT_CONFIGURATION,
            Self::GoToMeasurement => mid::GO_TO_MEASUREMENT,
        }
    }

    /// Encodes the frame of the step.
    #[must_use]
    pub fn emit(self) -> Vec<u8, MAX_SENT> {
        let mut data = Vec::<u8, 24>::new();
        if self == Self::SetOutputConfiguration {
            for output in OUTPUTS {
                let _ = data.extend_from_slice(&output.id.to_be_bytes());
                let _ = data.extend_from_slice(&output.rate.to_be_bytes());
            }
        }
        xbus::emit(self.mid(), &data).unwrap_or_default()
    }
}
