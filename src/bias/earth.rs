//! A gyro senses the rotation of the Earth, which must be subtracted from its rate once and not twice.
//!
//! About the vertical it is 15.041 deg/h times the sine of the latitude, 9 deg/h at 37 degrees: negligible for a MEMS
//! part, nearly all of the error of a fibre-optic gyro. A mean at standstill contains it; a bias from elsewhere (a
//! store, a data sheet, a filter) does not.

use crate::units::{Angle, AngularRate, RATE_HZ};

/// Rotation of the Earth against the stars, rad/s (WGS 84).
pub(crate) const EARTH_RATE: f32 = 7.292_115e-5;

/// A geographic latitude, as the Earth's rate about the vertical there: the sine is computed once.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Latitude {
    vertical_rate: AngularRate,
    step_turn: Angle,
}

impl Latitude {
    /// Creates a latitude from degrees, north positive; `None` when it is not finite or beyond a pole.
    pub fn from_degrees(degrees: f32) -> Option<Self> {
        if !(-90.0..=90.0).contains(&degrees) {
            return None;
        }
        let rate = EARTH_RATE * libm::sinf(degrees.to_radians());
        // 7e-5 rad/s at most.
        let vertical_rate = AngularRate(libm::roundf(rate * AngularRate::PER_RAD_PER_SEC) as i32);
        let step_turn = Angle(libm::roundf(rate / RATE_HZ as f32 * Angle::PER_RAD) as i64);
        Some(Self { vertical_rate, step_turn })
    }

    pub const fn vertical_rate(self) -> AngularRate {
        self.vertical_rate
    }

    /// Returns the Earth's turn about the upward vertical in a grid step, finer than the rate: 1e-6 deg/h.
    pub const fn step_turn(self) -> Angle {
        self.step_turn
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum EarthRate {
    /// It is part of the bias, of a gyro that is initialised at rest on each start.
    #[default]
    LeftInBias,
    /// The Earth's rate is known, and the bias is the part's own.
    Subtracted(Latitude),
}

impl EarthRate {
    /// Returns the rate that is not part of the bias, about the upward vertical.
    pub fn vertical(self) -> AngularRate {
        match self {
            Self::LeftInBias => AngularRate::ZERO,
            Self::Subtracted(latitude) => latitude.vertical_rate(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at_37() -> EarthRate {
        EarthRate::Subtracted(Latitude::from_degrees(37.0).unwrap())
    }

    #[test]
    fn nine_degrees_an_hour_at_37_north() {
        let rate = at_37().vertical().rad_per_sec().to_degrees() * 3600.0;
        assert!((rate - 9.0519).abs() < 1e-3, "{rate}");
        let south = Latitude::from_degrees(-37.0).unwrap().vertical_rate();
        assert_eq!(south.0, -at_37().vertical().0);
        assert_eq!(Latitude::from_degrees(90.1), None);
        assert_eq!(Latitude::from_degrees(f32::NAN), None);
    }
}
