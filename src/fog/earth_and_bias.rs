//! Corrections of a gyro's turns for what is known without a network: the Earth's rate at the latitude, the tilt of
//! the gyro's axis, and its bias ([`super::rest`]).

use super::part::FogErrors;
use super::rest::{RestOutcome, RestReading};
use crate::bias::Latitude;
use crate::sample::{RATE_HZ, Standstill};
use crate::units::{Angle, AngularRate};

const TILT_FRACTION_BITS: u32 = 30;

/// The angle between gyro and vertical: it measures a turn's cosine, and some unknown part of the Earth's rate.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Tilt {
    secant_minus_one: i32,
}

impl Tilt {
    pub const NONE: Self = Self { secant_minus_one: 0 };

    /// Creates a tilt of 0 to 45 degrees; `None` for anything else.
    pub fn from_degrees(degrees: f32) -> Option<Self> {
        if !(0.0..=45.0).contains(&degrees) {
            return None;
        }
        // 1 / cos a - 1, by a half-angle that keeps small tilts exact.
        let half = libm::sinf(degrees.to_radians() / 2.0);
        let secant_minus_one = 2.0 * half * half / (1.0 - 2.0 * half * half);
        Some(Self {
            secant_minus_one: libm::roundf(secant_minus_one * (1u32 << TILT_FRACTION_BITS) as f32) as i32,
        })
    }
}

#[derive(Debug, Clone)]
pub struct EarthAndBias {
    tilt: Tilt,
    tilt_rest: i128,
    pub(super) latitude: Option<Latitude>,
    pub(super) rest: RestReading,
    /// The angle that is subtracted from each step; `None` before the first one.
    reading: Option<Angle>,
}

impl EarthAndBias {
    pub const fn new(errors: FogErrors, tilt: Tilt, latitude: Option<Latitude>) -> Self {
        let earth = match latitude {
            Some(latitude) => Some(earth_rate(latitude)),
            None => None,
        };
        Self { tilt, tilt_rest: 0, latitude, rest: RestReading::new(errors, earth), reading: None }
    }

    /// Sets the latitude. If the vehicle has `moved` there, the gyro's bias is kept.
    pub fn set_latitude(&mut self, latitude: Option<Latitude>, moved: bool) {
        self.latitude = latitude;
        self.rest.set_earth(latitude.map(earth_rate), moved);
        self.renew();
    }

    /// Returns the vehicle's turn about the vertical in a step: the gyro's, less its reading at rest.
    pub fn correct(
        &mut self,
        turn: Option<Angle>,
        standstill: Standstill,
    ) -> (Option<Angle>, Option<RestOutcome>) {
        let turn = turn.map(|turn| self.about_vertical(turn));
        let outcome = self.rest.observe(turn, standstill);
        if outcome == Some(RestOutcome::Used) {
            self.renew();
        }
        let reading = self.reading.unwrap_or_else(|| self.renew());
        (turn.map(|turn| Angle(turn.0.saturating_sub(reading.0))), outcome)
    }

    /// Returns the expected error of a second's mean rate, 1 sigma, of a vehicle that turns and shakes, rad/s.
    pub fn sigma(&self, rate: AngularRate, shake: f32) -> AngularRate {
        let sigma = self.rest.sigma(rate.0 as f32 / AngularRate::PER_RAD_PER_SEC, shake);
        AngularRate(libm::ceilf(sigma * AngularRate::PER_RAD_PER_SEC) as i32)
    }

    fn about_vertical(&mut self, turn: Angle) -> Angle {
        let added = self.tilt_rest + i128::from(turn.0) * i128::from(self.tilt.secant_minus_one);
        self.tilt_rest = added & ((1 << TILT_FRACTION_BITS) - 1);
        // At most 0.42 times an int64.
        Angle(turn.0.saturating_add((added >> TILT_FRACTION_BITS) as i64))
    }

    fn renew(&mut self) -> Angle {
        let reading = self.rest.reading() / RATE_HZ as f32 * Angle::PER_RAD;
        *self.reading.insert(Angle(libm::roundf(reading) as i64))
    }
}

const fn earth_rate(latitude: Latitude) -> f32 {
    latitude.step_turn().0 as f32 * (RATE_HZ as f32 / Angle::PER_RAD)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_earth_comes_off_to_the_resolution_of_an_increment() {
        for degrees in [90.0, 60.0, 0.0, -34.0, -90.0f32] {
            let mut fog = EarthAndBias::new(FogErrors::DSP1760, Tilt::NONE, None);
            fog.set_latitude(Latitude::from_degrees(degrees), false);
            let (turn, _) = fog.correct(Some(Angle::ZERO), Standstill::Moving);
            let taken = -turn.unwrap().rad() * 100.0;
            let earth = 7.292_115e-5 * f64::from(degrees).to_radians().sin();
            // 1e-5 deg/h.
            assert!((taken - earth).abs() < 5e-11, "{degrees}: {taken} {earth}");
        }
    }

    #[test]
    fn a_tilted_gyro_shows_the_whole_turn() {
        let tilt = Tilt::from_degrees(5.0).unwrap();
        let mut fog = EarthAndBias::new(FogErrors::DSP1760, tilt, None);
        // A full turn in 20 s.
        let turn = core::f64::consts::TAU / 2_000.0 * 5f64.to_radians().cos();
        let code = Angle((turn * f64::from(Angle::PER_RAD)).round() as i64);
        let turned = (0..2_000).filter_map(|_| fog.correct(Some(code), Standstill::Moving).0);
        let turned: f64 = turned.map(Angle::rad).sum();
        assert!((turned - core::f64::consts::TAU).abs() < 1e-8, "{turned}");
        assert_eq!([Tilt::from_degrees(0.0), Tilt::from_degrees(45.1)], [Some(Tilt::NONE), None]);
    }
}
