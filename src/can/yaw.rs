//! Our own yaw messages carry rate and accumulated yaw at full resolution, with their quality. `src/can/README.md` has
//! their bytes.
//!
//! The accumulated yaw wraps at half a turn, so the 32-bit difference of two readings is the angle turned between
//! them, and lost messages lose no angle. The rate carries its rounding residual: its sum over the sensor's true
//! periods ([`crate::align::clock_ratio`]) is the accumulated yaw to half an LSB.

pub use crate::health::{Faults, Quality, Source};

use crate::units::{AngularRate, Yaw};

/// The same of a fibre-optic gyro, and E2E data identifiers; sent from power-up if configured, else from a sample on.
pub const FOG_IDS: [u16; 3] = [0x1A4, 0x1A5, 0x1A6];

/// Rate code that means "not available".
pub const RATE_NOT_AVAILABLE: i32 = i32::MIN;
/// Code of an unknown expected error.
pub const SIGMA_UNKNOWN: u16 = u16::MAX;
/// Code of an unknown latency.
pub const LATENCY_UNKNOWN: u8 = u8::MAX;

/// Codes of 360 deg / 2^32 per code of [`Yaw`] (0.32 / 2 pi), times 2^56.
const ANGLE_PER_YAW_Q56: i128 = 3_669_863_129_102_502;
/// Codes of 1e-5 deg/s per rate code, times 2^32.
const SIGMA_PER_CODE_Q32: u64 = 183_346_494;

/// The reason why bytes are not a yaw message. The E2E check is done before.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum YawError {
    /// The frame does not have eight bytes.
    #[error("yaw message has {0} bytes instead of 8")]
    Length(usize),
    /// The source is unknown to this version.
    #[error("yaw rate from an unknown source ({0})")]
    Source(u8),
}

/// The rate message: the rate (1e-6 deg/s per code), its source and its quality.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct RateMessage {
    /// Code of the rate.
    pub rate: i32,
    /// Source of the rate.
    pub source: Source,
    /// Quality of the rate.
    pub quality: Quality,
}

impl RateMessage {
    /// Encodes the message as eight bytes with an empty header.
    pub const fn emit(&self) -> [u8; 8] {
        let [a, b, c, d] = self.rate.to_le_bytes();
        [0, 0, 0, a, b, c, d, self.source as u8 | (self.quality as u8) << 3]
    }

    /// Decodes the content after the header.
    pub const fn parse(bytes: &[u8]) -> Result<Self, YawError> {
        let &[_, _, _, a, b, c, d, judgement] = bytes else {
            return Err(YawError::Length(bytes.len()));
        };
        let source = match judgement & 7 {
            0 => Source::Raw,
            1 => Source::Static,
            2 => Source::Model,
            4 => Source::EarthRate,
            unknown => return Err(YawError::Source(unknown)),
        };
        let quality = match judgement >> 3 & 3 {
            0 => Quality::Good,
            1 => Quality::Degraded,
            2 => Quality::Initialising,
            _ => Quality::Unusable,
        };
        Ok(Self { rate: i32::from_le_bytes([a, b, c, d]), source, quality })
    }

    /// Returns the rate in deg/s; `None` when it is not available.
    pub fn deg_per_sec(&self) -> Option<f64> {
        (self.rate != RATE_NOT_AVAILABLE).then(|| f64::from(self.rate) * 1e-6)
    }
}

/// The angle message: accumulated yaw (360 deg / 2^32 per code) and the faults.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct AngleMessage {
    /// Code of the accumulated yaw.
    pub yaw: i32,
    /// Faults since the previous message.
    pub faults: Faults,
}

impl AngleMessage {
    /// Encodes the message as eight bytes with an empty header.
    pub const fn emit(&self) -> [u8; 8] {
        let [a, b, c, d] = self.yaw.to_le_bytes();
        [0, 0, 0, a, b, c, d, self.faults.0]
    }

    /// Decodes the content after the header.
    pub const fn parse(bytes: &[u8]) -> Result<Self, YawError> {
        let &[_, _, _, a, b, c, d, faults] = bytes else {
            return Err(YawError::Length(bytes.len()));
        };
        Ok(Self { yaw: i32::from_le_bytes([a, b, c, d]), faults: Faults(faults) })
    }

    /// Returns the angle in deg, -180 to below 180.
    pub fn deg(&self) -> f64 {
        f64::from(self.yaw) * (360.0 / 4_294_967_296.0)
    }
}

/// The detail message: correction (2e-4 deg/s per code), expected error (1e-5 deg/s), latency (0.5 ms).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct DetailMessage {
    /// Code of the correction.
    pub correction: i16,
    /// Code of the expected error.
    pub sigma: u16,
    /// Code of the latency.
    pub latency: u8,
}

impl DetailMessage {
    /// Encodes the message as eight bytes with an empty header.
    pub const fn emit(&self) -> [u8; 8] {
        let [a, b] = self.correction.to_le_bytes();
        let [c, d] = self.sigma.to_le_bytes();
        [0, 0, 0, a, b, c, d, self.latency]
    }

    /// Decodes the content after the header.
    pub const fn parse(bytes: &[u8]) -> Result<Self, YawError> {
        let &[_, _, _, a, b, c, d, latency] = bytes else {
            return Err(YawError::Length(bytes.len()));
        };
        Ok(Self { correction: i16::from_le_bytes([a, b]), sigma: u16::from_le_bytes([c, d]), latency })
    }
}

/// Returns the nearest code of an accumulated yaw; whole turns are dropped.
#[doc(hidden)]
pub const fn encode_angle(yaw: Yaw) -> i32 {
    ((yaw.0 as i128 * ANGLE_PER_YAW_Q56 + (1 << 55)) >> 56) as i32
}

/// Returns the code of an expected error, rounded up, so that the error is never understated below saturation.
#[doc(hidden)]
pub const fn encode_sigma(sigma: Option<AngularRate>) -> u16 {
    let Some(AngularRate(sigma)) = sigma else { return SIGMA_UNKNOWN };
    let code = (sigma.unsigned_abs() as u64 * SIGMA_PER_CODE_Q32).div_ceil(1 << 32);
    if code < SIGMA_UNKNOWN as u64 { code as u16 } else { SIGMA_UNKNOWN - 1 }
}

#[doc(hidden)]
pub const fn encode_latency(latency_us: Option<u32>) -> u8 {
    let Some(latency_us) = latency_us else { return LATENCY_UNKNOWN };
    let code = latency_us.div_ceil(500);
    if code < LATENCY_UNKNOWN as u32 { code as u8 } else { LATENCY_UNKNOWN - 1 }
}
