//! Rotations turn the sensor's axes into the vehicle's: a configured one, and one that turns up what standstills and
//! turns have shown to be the vertical ([`VerticalEstimator`]). A gyro map then corrects what mounting and gain errors
//! of the rates a calibration has found. All are 3 x 3 matrices of Q30 numbers, applied in integers.

mod forward;
mod vertical;

pub use forward::{Forward, ForwardEstimator};
pub use vertical::{Judgement, Vertical, VerticalEstimator};

use crate::sample::ImuSample;
use crate::sqrt::sqrt;
use crate::units::{AngularRate, STANDARD_GRAVITY, SpecificForce};
use crate::vector::{dot, norm};

const Q: u32 = 30;
const ONE: f32 = (1u32 << Q) as f32;
/// The largest distance of a mean specific force from standard gravity, m/s^2.
const GRAVITY_TOLERANCE: f32 = 1.0;
/// Cosine of 150 degrees: beyond that tilt the direction in which to turn the board upright is too uncertain.
const UPSIDE_DOWN: f32 = -0.866;

/// Cosine of the angle, 25 degrees, beyond which a sensor has moved: streets are no steeper than 15 degrees.
const MOVED: f32 = 0.906;

/// Returns whether two mean specific forces at standstill are so far apart that the sensor was moved between them.
pub(crate) fn is_moved(before: &[SpecificForce; 3], now: &[SpecificForce; 3]) -> bool {
    let (before, now) = (metre_per_sec2(before), metre_per_sec2(now));
    dot(&before, &now) < MOVED * sqrt(dot(&before, &before) * dot(&now, &now))
}

fn metre_per_sec2(force: &[SpecificForce; 3]) -> [f32; 3] {
    force.each_ref().map(|axis| axis.0 as f32 / SpecificForce::PER_METRE_PER_SEC2)
}

#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum LevelError {
    #[error("the accelerometer shows {0:.2} m/s^2 at standstill instead of gravity")]
    NotGravity(f32),
    /// The board hangs upside down, degrees: its mounting has to be configured.
    #[error("the sensor is tilted by {0:.0} deg: configure how it is mounted")]
    UpsideDown(f32),
}

/// Rotates the sensor's axes into the vehicle's (x forward, y left, z up).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Rotation([[i32; 3]; 3]);

impl Rotation {
    /// This rotation changes no bit.
    pub const IDENTITY: Self = Self([[1 << Q, 0, 0], [0, 1 << Q, 0], [0, 0, 1 << Q]]);

    /// Creates the rotation of a board that is turned from the vehicle's axes by `yaw` about z, then by `pitch` about
    /// its own y, then by `roll` about its own x, degrees. `None` when one is not finite.
    pub fn from_mounting(roll: f32, pitch: f32, yaw: f32) -> Option<Self> {
        if ![roll, pitch, yaw].iter().all(|angle| angle.is_finite()) {
            return None;
        }
        let [(sr, cr), (sp, cp), (sy, cy)] =
            [roll, pitch, yaw].map(|angle| (libm::sinf(angle.to_radians()), libm::cosf(angle.to_radians())));
        Some(Self::from_elements([
            [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
            [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
            [-sp, cp * sr, cp * cr],
        ]))
    }

    /// Returns the smallest rotation that turns a mean specific force at rest upright, and its angle in degrees.
    #[doc(hidden)]
    pub fn levelling(rest: [SpecificForce; 3]) -> Result<(Self, f32), LevelError> {
        let force = metre_per_sec2(&rest);
        let norm = norm(&force);
        if libm::fabsf(norm - STANDARD_GRAVITY) > GRAVITY_TOLERANCE {
            return Err(LevelError::NotGravity(norm));
        }
        let up = force.map(|axis| axis / norm);
        let [x, y, cos] = up;
        let tilt = libm::atan2f(sqrt(x * x + y * y), cos).to_degrees();
        if cos < UPSIDE_DOWN {
            return Err(LevelError::UpsideDown(tilt));
        }
        Ok((Self::upright(&up), tilt))
    }

    /// Returns the smallest rotation that turns a direction upright: a unit vector that does not point down.
    pub(crate) fn upright(&[x, y, cos]: &[f32; 3]) -> Self {
        // Rodrigues' formula for the axis (y, -x, 0): I + [v] + [v]^2 / (1 + cos).
        let share = 1.0 / (1.0 + cos.max(UPSIDE_DOWN));
        Self::from_elements([
            [1.0 - x * x * share, -x * y * share, -x],
            [-x * y * share, 1.0 - y * y * share, -y],
            [x, y, cos],
        ])
    }

    pub(crate) fn inverse(&self) -> Self {
        Self(core::array::from_fn(|row| core::array::from_fn(|column| self.0[column][row])))
    }

    pub(crate) fn vector(&self, vector: &[f32; 3]) -> [f32; 3] {
        self.0.map(|row| dot(&row.map(|element| element as f32 / ONE), vector))
    }

    /// Returns the rotation that turns first by `self`, then by `next`.
    #[doc(hidden)]
    pub fn then(&self, next: &Self) -> Self {
        let Self(first) = self;
        let columns: [[i32; 3]; 3] =
            core::array::from_fn(|column| next.turn(core::array::from_fn(|row| first[row][column])));
        Self(core::array::from_fn(|row| core::array::from_fn(|column| columns[column][row])))
    }

    #[doc(hidden)]
    pub fn rate(&self, rate: [AngularRate; 3]) -> [AngularRate; 3] {
        self.turn(rate.map(|axis| axis.0)).map(AngularRate)
    }

    #[doc(hidden)]
    pub fn force(&self, force: [SpecificForce; 3]) -> [SpecificForce; 3] {
        self.turn(force.map(|axis| axis.0)).map(SpecificForce)
    }

    #[doc(hidden)]
    pub fn sample(&self, sample: &ImuSample) -> ImuSample {
        if is_identity(&self.0) {
            return *sample;
        }
        ImuSample {
            angular_rate: self.rate(sample.angular_rate),
            specific_force: self.force(sample.specific_force),
            ..*sample
        }
    }

    fn from_elements(elements: [[f32; 3]; 3]) -> Self {
        // Elements are at most 1 in size, so at most 2^30.
        Self(elements.map(|row| row.map(|element| libm::roundf(element * ONE) as i32)))
    }

    fn turn(&self, vector: [i32; 3]) -> [i32; 3] {
        product(&self.0, vector)
    }
}

/// Returns a Q30 matrix times a vector, rounded to nearest and saturated.
fn product([x, y, z]: &[[i32; 3]; 3], vector: [i32; 3]) -> [i32; 3] {
    let [a, b, c] = vector.map(i64::from);
    let row = |[x, y, z]: &[i32; 3]| {
        let sum = i64::from(*x) * a + i64::from(*y) * b + i64::from(*z) * c;
        ((sum + (1 << (Q - 1))) >> Q).clamp(i64::from(i32::MIN), i64::from(i32::MAX)) as i32
    };
    [row(x), row(y), row(z)]
}

fn is_identity(rows: &[[i32; 3]; 3]) -> bool {
    // Not `==`, which on a microcontroller compares byte by byte.
    rows.as_flattened().iter().zip(Rotation::IDENTITY.0.as_flattened()).all(|(a, b)| a == b)
}

/// Maps the gyro's rates, in the vehicle's axes, to the true ones. It is close to the identity, within
/// [`GyroMap::MAX_GAIN`] and off the diagonal [`GyroMap::MAX_CROSS`]: more is a mounting to configure.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct GyroMap([[i32; 3]; 3]);

impl GyroMap {
    pub const IDENTITY: Self = Self(Rotation::IDENTITY.0);
    pub const MAX_GAIN: f32 = 0.05;
    /// The largest plausible share of another axis: the sine of 8.6 degrees.
    pub const MAX_CROSS: f32 = 0.15;

    /// Creates a map from a matrix, row by row; `None` if an element is not finite or too far from the identity.
    pub fn from_elements(elements: [[f32; 3]; 3]) -> Option<Self> {
        let map = Self(elements.map(|row| row.map(|element| libm::roundf(element * ONE) as i32)));
        let finite = elements.as_flattened().iter().all(|element| element.is_finite());
        (finite && map.is_plausible()).then_some(map)
    }

    pub(crate) fn is_identity(&self) -> bool {
        is_identity(&self.0)
    }

    pub fn elements(&self) -> [[f32; 3]; 3] {
        self.0.map(|row| row.map(|element| element as f32 / ONE))
    }

    pub fn is_plausible(&self) -> bool {
        let [gain, cross] = [Self::MAX_GAIN, Self::MAX_CROSS].map(|limit| (limit * ONE) as u32);
        self.0.iter().zip(Self::IDENTITY.0).enumerate().all(|(row, (elements, identity))| {
            elements.iter().zip(identity).enumerate().all(|(column, (element, identity))| {
                element.abs_diff(identity) <= if row == column { gain } else { cross }
            })
        })
    }

    #[doc(hidden)]
    pub fn rate(&self, rate: [AngularRate; 3]) -> [AngularRate; 3] {
        product(&self.0, rate.map(|axis| axis.0)).map(AngularRate)
    }
}
