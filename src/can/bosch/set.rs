//! The full MM5.10 set has three messages of the same layout, each with one rate and one acceleration.
//!
//! | message | identifier | rate | acceleration | byte 2, low nibble | byte 3 |
//! |---|---|---|---|---|---|
//! | TX1 | 0x174 | yaw | lateral | CLU_STAT | temperature |
//! | TX2 | 0x178 | roll | longitudinal | - | - |
//! | TX3 | 0x17C | pitch | vertical | HW_INDEX | - |
//!
//! A receiver takes the three as one sample only in this order with the same counter. The roll rate has the opposite
//! sign to the right-hand rule, as Bosch's has (its receiver negates it again).

use super::{
    CRC, MessageError, SignalStatus, TX1_ID, YawRateSignal, ZERO, encode_acceleration, encode_temperature,
};
use crate::units::{AngularRate, CentiCelsius, SpecificForce};
use embedded_can::{Frame, StandardId};

/// The layout of one message of the set: which values it carries.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Layout {
    /// Identifier.
    pub id: StandardId,
    /// Axis of the rate: 0 roll, 1 pitch, 2 yaw.
    pub rate_axis: usize,
    /// True if the rate is sent with the opposite sign.
    pub rate_negated: bool,
    /// Axis of the acceleration: 0 forward, 1 left, 2 up.
    pub force_axis: usize,
    /// True if byte 3 is the temperature; otherwise 0.
    pub temperature: bool,
}

/// TX1, TX2, TX3, in the order in which they are sent.
pub const LAYOUTS: [Layout; 3] = [
    Layout { id: TX1_ID, rate_axis: 2, rate_negated: false, force_axis: 1, temperature: true },
    Layout {
        id: StandardId::new(0x178).unwrap(),
        rate_axis: 0,
        rate_negated: true,
        force_axis: 0,
        temperature: false,
    },
    Layout {
        id: StandardId::new(0x17C).unwrap(),
        rate_axis: 1,
        rate_negated: false,
        force_axis: 2,
        temperature: false,
    },
];

/// One message of the set as codes: 0.005 deg/s and 0.127465e-3 g each, zero at 0x8000.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Message {
    /// Code of the rate.
    pub rate: u16,
    /// Status of the rate.
    pub rate_status: SignalStatus,
    /// CLU_STAT in TX1, HW_INDEX in TX3, 0 in TX2.
    pub nibble: u8,
    /// Code of the temperature in TX1, 0 in the others.
    pub temperature: u8,
    /// Code of the acceleration.
    pub acceleration: u16,
    /// Status of the acceleration.
    pub acceleration_status: SignalStatus,
    /// Message counter, 0 to 15, the same in the three messages of one sample.
    pub counter: u8,
}

impl Message {
    /// Encodes the message as eight bytes.
    pub fn emit(&self) -> [u8; 8] {
        let [rate0, rate1] = self.rate.to_le_bytes();
        let [force0, force1] = self.acceleration.to_le_bytes();
        let status = self.rate_status.0 << 4 | self.nibble & 0x0F;
        let counter = self.acceleration_status.0 << 4 | self.counter & 0x0F;
        let mut bytes = [rate0, rate1, status, self.temperature, force0, force1, counter, 0];
        bytes[7] = CRC.checksum(&bytes[..7]);
        bytes
    }

    /// Decodes eight bytes after checking length and CRC.
    pub fn parse(bytes: &[u8]) -> Result<Self, MessageError> {
        let &[rate0, rate1, status, temperature, force0, force1, counter, received] = bytes else {
            return Err(MessageError::Length(bytes.len()));
        };
        let computed = CRC.checksum(&bytes[..7]);
        if computed != received {
            return Err(MessageError::Crc { computed, received });
        }
        Ok(Self {
            rate: u16::from_le_bytes([rate0, rate1]),
            rate_status: SignalStatus(status >> 4),
            nibble: status & 0x0F,
            temperature,
            acceleration: u16::from_le_bytes([force0, force1]),
            acceleration_status: SignalStatus(counter >> 4),
            counter: counter & 0x0F,
        })
    }

    /// Returns the rate in deg/s.
    pub fn rate_deg_per_sec(&self) -> f64 {
        f64::from(i32::from(self.rate) - ZERO) * 0.005
    }

    /// Returns the frame with a layout's identifier; `None` only if the driver's type cannot hold it.
    pub fn frame<F: Frame>(&self, layout: &Layout) -> Option<F> {
        F::new(layout.id, &self.emit())
    }
}

/// One sample of the vehicle's motion (axes forward, left, up): the input of [`SetEncoder`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Motion {
    /// Angular rates about x (roll), y (pitch) and z (yaw).
    pub angular_rate: [AngularRate; 3],
    /// Specific force along x, y, z.
    pub specific_force: [SpecificForce; 3],
    /// Temperature of the sensor, if known.
    pub temperature: Option<CentiCelsius>,
    /// Status of the rates.
    pub rate_status: SignalStatus,
    /// Status of the accelerations.
    pub force_status: SignalStatus,
    /// Message counter; its low four bits are sent.
    pub counter: u8,
}

fn axis<T: Copy + Default>(axes: &[T; 3], axis: usize) -> T {
    axes.get(axis).copied().unwrap_or_default()
}

/// The encoder of the set; it holds the rounding residuals of the three rates.
#[derive(Debug, Clone, Copy, Default)]
pub struct SetEncoder {
    rates: [YawRateSignal; 3],
}

impl SetEncoder {
    /// Starts without a rounding residual.
    pub const START: Self = Self { rates: [YawRateSignal::START; 3] };

    /// Encodes the messages of [`LAYOUTS`]. A value that does not fit is sent as the limit and marked as failed.
    pub fn encode(&mut self, motion: &Motion) -> [Message; 3] {
        let mut messages = LAYOUTS.map(|layout| {
            let (acceleration, fits) = encode_acceleration(axis(&motion.specific_force, layout.force_axis));
            Message {
                rate: 0,
                rate_status: motion.rate_status,
                nibble: 0,
                temperature: if layout.temperature { encode_temperature(motion.temperature) } else { 0 },
                acceleration,
                acceleration_status: SignalStatus(motion.force_status.0 | fits.0),
                counter: motion.counter & 0x0F,
            }
        });
        for ((message, signal), layout) in messages.iter_mut().zip(&mut self.rates).zip(&LAYOUTS) {
            let rate = axis(&motion.angular_rate, layout.rate_axis);
            let rate = if layout.rate_negated { AngularRate(rate.0.saturating_neg()) } else { rate };
            message.rate = signal.encode(rate).unwrap_or_else(|limit| {
                message.rate_status = SignalStatus(message.rate_status.0 | SignalStatus::FAILURE.0);
                limit.0
            });
            if message.rate_status != SignalStatus::OK {
                // Receivers do not integrate rates that are marked bad.
                signal.reset();
            }
        }
        messages
    }
}
