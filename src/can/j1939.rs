//! SAE J1939 carries the yaw rate on trucks and machines in its message VDC2 (vehicle dynamic stability control 2).
//!
//! | bytes | SPN | signal | scale |
//! |---|---|---|---|
//! | 0-1 | 1807 | steering wheel angle | not sent: FFFF |
//! | 2 | 1811, 1812 | turn counter, sensor type | not sent: FF |
//! | 3-4 | 1808 | yaw rate, u16 LE | 1/8192 rad/s, -3.92 |
//! | 5-6 | 1809 | lateral acceleration, u16 LE | 1/2048 m/s^2, -15.687 |
//! | 7 | 1810 | longitudinal acceleration | 0.1 m/s^2, -12.5 |
//!
//! Codes up to FAFF (FA) are values; FE00 (FE) is an error, FFFF (FF) not available. 1/8192 rad/s is 25
//! deg/h, and zero lies between two codes (32112.64): with plain rounding, a parked car would seem to turn
//! at 9 deg/h indefinitely. The rounding residual is therefore carried.

use super::residual::{RoundingResidual, Scale};
use crate::units::{AngularRate, SpecificForce};
use embedded_can::{ExtendedId, Frame};

/// Parameter group number of VDC2.
pub const VDC2_PGN: u32 = 61_449;
/// Default priority of VDC2 on the bus.
pub const VDC2_PRIORITY: u8 = 6;
/// Largest code that stands for a value.
const MAX_CODE: i64 = 0xFAFF;
const ERROR: u16 = 0xFE00;
const LONGITUDINAL_ERROR: u8 = 0xFE;
const NOT_AVAILABLE: u16 = 0xFFFF;

/// 1/8192 rad/s is 2^14 rate codes; zero is 3.92 * 8192.
const YAW_RATE: Scale = Scale { factor_q32: 1 << 18, zero_q32: 137_922_738_588_221 };
/// 15.687 * 2048, times 2^9; 1/2048 m/s^2 is 2^9 acceleration codes.
const LATERAL_ZERO_Q9: i64 = 16_449_012;

/// Returns the 29-bit identifier of a broadcast parameter group, for a priority of 0 to 7 and the sender's
/// address.
pub const fn broadcast_id(pgn: u32, priority: u8, source: u8) -> Option<ExtendedId> {
    if priority > 7 || pgn > 0x3_FFFF {
        return None;
    }
    ExtendedId::new((priority as u32) << 26 | pgn << 8 | source as u32)
}

/// The codes of the VDC2 signals that the coprocessor sends; the other bytes of the frame say "not available".
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Vdc2 {
    /// Code of the yaw rate, counter-clockwise positive.
    pub yaw_rate: u16,
    /// Code of the lateral acceleration, left positive.
    pub lateral: u16,
    /// Code of the longitudinal acceleration, forward positive.
    pub longitudinal: u8,
}

/// The error for a frame that does not have eight bytes; it holds the length.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[error("VDC2 has {} bytes instead of 8", .0)]
pub struct Vdc2Length(pub usize);

impl Vdc2 {
    /// Encodes the message as eight bytes.
    pub const fn emit(&self) -> [u8; 8] {
        let [yaw0, yaw1] = self.yaw_rate.to_le_bytes();
        let [lateral0, lateral1] = self.lateral.to_le_bytes();
        [0xFF, 0xFF, 0xFF, yaw0, yaw1, lateral0, lateral1, self.longitudinal]
    }

    /// Decodes eight bytes.
    pub const fn parse(bytes: &[u8]) -> Result<Self, Vdc2Length> {
        let &[_, _, _, yaw0, yaw1, lateral0, lateral1, longitudinal] = bytes else {
            return Err(Vdc2Length(bytes.len()));
        };
        let yaw_rate = u16::from_le_bytes([yaw0, yaw1]);
        Ok(Self { yaw_rate, lateral: u16::from_le_bytes([lateral0, lateral1]), longitudinal })
    }

    /// Returns the frame in a driver's own type; `None` only if that type cannot hold it.
    pub fn frame<F: Frame>(&self, source: u8) -> Option<F> {
        F::new(broadcast_id(VDC2_PGN, VDC2_PRIORITY, source)?, &self.emit())
    }

    /// Returns whether a signal reports an error.
    pub const fn has_error(&self) -> bool {
        self.yaw_rate == ERROR || self.lateral == ERROR || self.longitudinal == LONGITUDINAL_ERROR
    }

    /// Returns the yaw rate in rad/s; `None` if the code is not a value.
    pub fn yaw_rate_rad_per_sec(&self) -> Option<f64> {
        (i64::from(self.yaw_rate) <= MAX_CODE).then(|| f64::from(self.yaw_rate) / 8192.0 - 3.92)
    }
}

/// The validity of the rate.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Validity {
    /// The rate is valid.
    Valid,
    /// The rate is not available, because the sensor is not ready.
    NotAvailable,
    /// The rate is in error.
    Error,
}

/// Carries the yaw rate's rounding residual from message to message.
#[derive(Debug, Clone, Copy)]
#[doc(hidden)]
pub struct Vdc2Encoder {
    yaw_rate: RoundingResidual,
}

impl Default for Vdc2Encoder {
    fn default() -> Self {
        Self::START
    }
}

impl Vdc2Encoder {
    /// Starts without a rounding residual.
    pub const START: Self = Self { yaw_rate: RoundingResidual::new(YAW_RATE) };

    /// Encodes one sample; the axes of the specific force are forward, left, up. J1939 has no status next to a value,
    /// so for a rate that is not valid, or a value out of range, a special code is sent instead.
    pub fn encode(&mut self, rate: AngularRate, validity: Validity, force: &[SpecificForce; 3]) -> Vdc2 {
        let [forward, left, _] = force;
        let yaw_rate = match validity {
            Validity::Valid => value(self.yaw_rate.encode(rate).into()),
            Validity::NotAvailable => NOT_AVAILABLE,
            Validity::Error => ERROR,
        };
        if i64::from(yaw_rate) > MAX_CODE {
            self.yaw_rate.reset();
        }
        let lateral = (i64::from(left.0) + LATERAL_ZERO_Q9 + (1 << 8)) >> 9;
        let longitudinal = (i64::from(forward.0) * 10 + (125 << 20) + (1 << 19)) >> 20;
        Vdc2 {
            yaw_rate,
            lateral: value(lateral),
            longitudinal: if (0..=250).contains(&longitudinal) {
                longitudinal as u8
            } else {
                LONGITUDINAL_ERROR
            },
        }
    }
}

/// Returns a code if it stands for a value, else the error code.
const fn value(code: i64) -> u16 {
    if code >= 0 && code <= MAX_CODE { code as u16 } else { ERROR }
}
