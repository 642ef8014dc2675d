//! The fixed-point quantities of the integer pipeline: all between the sensor parser and the CAN payload is integer
//! arithmetic, so that every machine computes the same bits.

use serde::{Deserialize, Serialize};

/// Rate of the common grid that the networks see, Hz.
pub const RATE_HZ: u32 = 100;

/// Standard gravity converts the readings of parts that measure in g, m/s^2.
pub const STANDARD_GRAVITY: f32 = 9.806_65;

/// Returns `value / DIVISOR`, rounded down, by hardware divisions of 32 bits; `value` below 2^63 / `DIVISOR`.
#[inline]
pub const fn divided<const DIVISOR: u32>(value: u64) -> u64 {
    const HIGH: u64 = 1 << 32;
    let (high, low) = ((value >> 32) as u32, value as u32);
    let (quotient, remainder) = (HIGH / DIVISOR as u64, (HIGH % DIVISOR as u64) as u32);
    let rest = (high * remainder + low % DIVISOR) / DIVISOR;
    high as u64 * quotient + (low / DIVISOR) as u64 + rest as u64
}

const _: () = {
    assert!(divided::<1_000>(u32::MAX as u64 * 1_000 + 999) == u32::MAX as u64);
    assert!(divided::<1_000>((1 << 53) + 7) == ((1 << 53) + 7) / 1_000);
    assert!(divided::<78_125>((1 << 46) - 1) == ((1 << 46) - 1) / 78_125);
};

/// The reason why a reading does not fit the fixed-point format.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum RangeError {
    /// The reading is NaN or infinite.
    #[error("not a finite number")]
    NotFinite,
    /// The reading is finite but beyond what any part of this kind can measure.
    #[error("out of range")]
    OutOfRange,
}

/// Holds an angular rate, signed 32 bit, LSB 2^-27 rad/s (4.3e-7 deg/s), range +-16 rad/s (+-916 deg/s).
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct AngularRate(pub i32);

impl AngularRate {
    /// Fraction bits of the code.
    pub const FRACTION_BITS: u32 = 27;
    /// Codes per rad/s.
    pub const PER_RAD_PER_SEC: f32 = (1u32 << Self::FRACTION_BITS) as f32;
    /// The rate of no rotation.
    pub const ZERO: Self = Self(0);

    /// Returns the nearest code to a rate in deg/s, for constants; beyond +-916 deg/s the code saturates.
    pub const fn from_deg_per_sec(value: f64) -> Self {
        let code = value * (core::f64::consts::PI / 180.0) * (1u32 << Self::FRACTION_BITS) as f64;
        Self((code + if code < 0.0 { -0.5 } else { 0.5 }) as i32)
    }

    /// Returns the nearest code to a reading in rad/s, which must be inside +-16 rad/s.
    pub fn from_rad_per_sec(value: f32) -> Result<Self, RangeError> {
        to_code(value, Self::PER_RAD_PER_SEC).map(Self)
    }

    /// Returns the rate in rad/s, for display and evaluation.
    pub fn rad_per_sec(self) -> f64 {
        f64::from(self.0) / f64::from(Self::PER_RAD_PER_SEC)
    }
}

/// Holds a specific force, signed 32 bit, LSB 2^-20 m/s^2, range +-2048 m/s^2.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct SpecificForce(pub i32);

impl SpecificForce {
    /// Fraction bits of the code.
    pub const FRACTION_BITS: u32 = 20;
    /// Codes per m/s^2.
    pub const PER_METRE_PER_SEC2: f32 = (1u32 << Self::FRACTION_BITS) as f32;
    /// Standard gravity, 9.80665 m/s^2.
    pub const STANDARD_GRAVITY: Self = Self(10_283_018);

    /// Returns the nearest code to a reading in m/s^2, which must be inside +-2048 m/s^2.
    pub fn from_metre_per_sec2(value: f32) -> Result<Self, RangeError> {
        to_code(value, Self::PER_METRE_PER_SEC2).map(Self)
    }

    /// Returns the specific force in m/s^2, for display and evaluation.
    pub fn metre_per_sec2(self) -> f64 {
        f64::from(self.0) / f64::from(Self::PER_METRE_PER_SEC2)
    }
}

/// An angle turned, LSB 2^-44 rad (3.3e-12 deg), up to 524,288 rad: rounding a thousand increments a second, always in
/// one direction, stays below 6e-6 deg/h.
#[derive(Debug, Clone, Copy, PartialEq, Hash, Eq, PartialOrd, Ord, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Angle(pub i64);

impl Angle {
    /// Fraction bits of the code.
    pub const FRACTION_BITS: u32 = 44;
    /// Codes per rad.
    pub const PER_RAD: f32 = (1u64 << Self::FRACTION_BITS) as f32;
    /// The angle of no turn.
    pub const ZERO: Self = Self(0);

    /// Returns the nearest code to an angle in rad inside +-524,288 rad; the conversion is exact from 2^-20 rad on.
    pub fn from_rad(value: f32) -> Result<Self, RangeError> {
        if !value.is_finite() {
            return Err(RangeError::NotFinite);
        }
        let code = libm::roundf(value * Self::PER_RAD);
        // 2^63 itself is the first f32 that does not fit.
        if !(-9_223_372_036_854_775_808.0..9_223_372_036_854_775_808.0).contains(&code) {
            return Err(RangeError::OutOfRange);
        }
        Ok(Self(code as i64))
    }

    /// Returns the angle in rad, for display and evaluation.
    pub fn rad(self) -> f64 {
        self.0 as f64 / f64::from(Self::PER_RAD)
    }
}

/// An accumulated yaw, LSB 2^-27 rad/s x 10 ms: the sum of rates over steps of the sensor's clock.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Yaw(pub i64);

impl Yaw {
    /// Returns the angle in rad, unwrapped.
    pub fn rad(self) -> f64 {
        // Exact to 2^53 codes: 2^53 x 7.5e-11 rad is 671,000 rad.
        self.0 as f64 / (f64::from(AngularRate::PER_RAD_PER_SEC) * f64::from(RATE_HZ))
    }
}

/// Holds the speed of a wheel over ground, signed 32 bit, LSB 2^-16 m/s, range +-32768 m/s.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct WheelSpeed(pub i32);

impl WheelSpeed {
    /// Fraction bits of the code.
    pub const FRACTION_BITS: u32 = 16;

    /// Returns the speed in m/s, for display and evaluation.
    pub fn metre_per_sec(self) -> f64 {
        f64::from(self.0) / f64::from(1u32 << Self::FRACTION_BITS)
    }
}

/// Holds a temperature of the part, in 1/100 deg C.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct CentiCelsius(pub i16);

/// Holds an instant in microseconds: the time of a part by its own clock, unwrapped, or of the caller's clock.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Micros(pub u64);

impl Micros {
    /// Returns the instant that is later by a duration; it saturates at the largest one.
    #[must_use]
    pub const fn after(self, span: Duration) -> Self {
        Self(self.0.saturating_add(span.0))
    }

    /// Returns the time since an earlier instant; zero since a later one.
    pub const fn since(self, earlier: Self) -> Duration {
        Duration(self.0.saturating_sub(earlier.0))
    }
}

/// Holds a duration in microseconds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Duration(pub u64);

impl Duration {
    /// Creates a duration of milliseconds.
    pub const fn from_millis(millis: u32) -> Self {
        Self(millis as u64 * 1_000)
    }
}

/// Scales by a power of two (exact in f32) and rounds to nearest, ties away from zero.
fn to_code(value: f32, per_unit: f32) -> Result<i32, RangeError> {
    if !value.is_finite() {
        return Err(RangeError::NotFinite);
    }
    let code = libm::roundf(value * per_unit);
    // 2^31 itself is the first f32 that does not fit.
    if !(-2_147_483_648.0..2_147_483_648.0).contains(&code) {
        return Err(RangeError::OutOfRange);
    }
    Ok(code as i32)
}
