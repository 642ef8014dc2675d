//! The Bosch MM5.10 yaw-rate message, 0x174 at 100 Hz, makes the board a drop-in replacement for production sensors.
//!
//! | bytes | signal | scale |
//! |---|---|---|
//! | 0-1 | YawRate, u16 LE | 0.005 deg/s, offset -163.84 deg/s |
//! | 2, low nibble | CLU_STAT | 0 |
//! | 2, high nibble | YawRate_STAT | bit 0 not available, 1 failure, 2 initialising |
//! | 3 | TEMP | 1 deg C, offset -50; 0xFF unknown |
//! | 4-5 | AY, u16 LE | 0.000127465 g, zero at 0x8000 |
//! | 6, low nibble | MSG_CNT | increments every 10 ms |
//! | 6, high nibble | AY_STAT | as YawRate_STAT |
//! | 7 | CRC | SAE J1850 over bytes 0 to 6: our choice, since it is not published |
//!
//! The other two messages of the set have the same shape: [`LAYOUTS`]. Source: Bosch's off_highway_mm7p10 receiver.
//!
//! With plain rounding a parked car would seem to turn at up to 9 deg/h. [`YawRateSignal`] therefore carries each
//! frame's rounding residual into the next one: the integral is never off by more than half an LSB times one period.

mod set;

#[doc(hidden)]
pub use set::{LAYOUTS, Layout, Message, Motion, SetEncoder};

use crate::units::{AngularRate, CentiCelsius, SpecificForce, divided};
use embedded_can::StandardId;

/// Identifier of the message that carries yaw rate and lateral acceleration (TX1).
pub const TX1_ID: StandardId = StandardId::new(0x174).unwrap();
/// SAE J1850: polynomial 0x1D, start and final XOR 0xFF.
pub static CRC: crc::Crc<u8> = crc::Crc::<u8>::new(&crc::CRC_8_SAE_J1850);

const ZERO: i32 = 0x8000;
/// LSB of the yaw rate, 0.005 deg/s, in units of 1e-9 deg/s x 2^-20.
const YAW_RATE_LSB: i64 = (YAW_RATE_ODD as i64) << YAW_RATE_SHIFT;
const YAW_RATE_ODD: u32 = 5_000_000 >> 6;
const YAW_RATE_SHIFT: u32 = 20 + 6;
/// One rate code in units of 1e-9 deg/s x 2^-20 (180e9 / pi / 2^27).
const NANO_DEG_PER_CODE_Q20: i64 = 447_623_277;
/// Signal codes per acceleration code of 2^-20 m/s^2 (1 / (0.000127465 * 9.80665 * 2^20)), times 2^32.
const AY_PER_CODE_Q32: i64 = 3_276_788;

/// The status nibble of one signal.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct SignalStatus(pub u8);

impl SignalStatus {
    /// The signal is good.
    pub const OK: Self = Self(0);
    /// The signal is not available.
    pub const NOT_AVAILABLE: Self = Self(1);
    /// The signal has failed: do not use it.
    pub const FAILURE: Self = Self(2);
    /// The sensor is initialising: do not use the signal yet.
    pub const INITIALISING: Self = Self(4);
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[allow(missing_docs, reason = "its messages say it")]
pub enum MessageError {
    #[error("a Bosch message has {0} bytes instead of 8")]
    Length(usize),
    #[error("the checksum of a Bosch message is {received:02x}, should be {computed:02x}")]
    Crc { computed: u8, received: u8 },
}

/// Carries the yaw rate's rounding residual from message to message.
#[derive(Debug, Clone, Copy, Default)]
pub struct YawRateSignal {
    /// Sum of the exact rates minus the sum of the rates sent, in 1e-9 deg/s x 2^-20; exact at this resolution.
    residual: i64,
}

/// The error for a rate outside the signal's range (+-163.84 deg/s); it holds the code of the nearest limit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct OutOfRange(pub u16);

impl YawRateSignal {
    /// Starts without a rounding residual.
    pub const START: Self = Self { residual: 0 };

    /// Encodes a rate with the rounding residual of earlier ones, which an error drops: the frame is marked bad.
    pub fn encode(&mut self, rate: AngularRate) -> Result<u16, OutOfRange> {
        let wanted = i64::from(rate.0) * NANO_DEG_PER_CODE_Q20 + self.residual;
        // Counted from the smallest code, so that it is positive; the shift leaves at most 35 bits to divide.
        let above = wanted + YAW_RATE_LSB / 2 + i64::from(ZERO) * YAW_RATE_LSB;
        let raw = u64::try_from(above >> YAW_RATE_SHIFT).map(divided::<YAW_RATE_ODD>);
        let code = raw.map_or(-1, |raw| raw as i64) - i64::from(ZERO);
        match u16::try_from(code + i64::from(ZERO)) {
            Ok(raw) => {
                self.residual = wanted - code * YAW_RATE_LSB;
                Ok(raw)
            }
            Err(_) => {
                self.reset();
                Err(OutOfRange(if code < 0 { 0 } else { u16::MAX }))
            }
        }
    }

    /// Drops the rounding residual, after a message that was marked bad.
    pub fn reset(&mut self) {
        self.residual = 0;
    }
}

/// Returns the nearest code of a lateral acceleration, and whether it fits (+-4.18 g).
#[doc(hidden)]
pub fn encode_acceleration(force: SpecificForce) -> (u16, SignalStatus) {
    let code = (i64::from(force.0) * AY_PER_CODE_Q32 + (1 << 31)) >> 32;
    let raw = code + i64::from(ZERO);
    match u16::try_from(raw) {
        Ok(raw) => (raw, SignalStatus::OK),
        Err(_) => (if raw < 0 { 0 } else { u16::MAX }, SignalStatus::FAILURE),
    }
}

/// Returns the code of a temperature: whole degrees from -50, 0xC9 above 150, 0xFF if unknown.
#[doc(hidden)]
pub fn encode_temperature(temperature: Option<CentiCelsius>) -> u8 {
    match temperature {
        None => 0xFF,
        Some(CentiCelsius(centi)) => {
            let degrees = (i32::from(centi) + 50).div_euclid(100);
            if degrees > 150 { 0xC9 } else { (degrees + 50).max(0) as u8 }
        }
    }
}
