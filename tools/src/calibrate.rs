//! This module calibrates one unit: gain and mounting of its gyro, from drives with a reference yaw rate.
//!
//! A yaw rate that the coprocessor has corrected still contains a share of the roll rate and of the pitch rate (the
//! sensor is not level in the vehicle, or the reference is not) and a share of itself (gain). Over a second or more
//! these errors add up to an angle, and the reference shows it. The shares are fitted to those angles, each drive with
//! a constant of its own, because bias belongs to the drive and not to the unit. They are the last row of a 3 x 3 map
//! ([`gyronet::mounting::GyroMap`]) that the board applies to every sample. The rows above it stay those of the
//! identity, because a heading does not depend on them.

mod fit;
mod spans;
pub mod unit_file;

use crate::drive::recording::Recording;
use crate::drive::replay::{Replay, ReplayError};
use fit::Fit;
use gyronet::mounting::GyroMap;
use spans::Span;
use unit_file::UnitFile;

/// A drive needs at least this many seconds after static initialisation.
const SHORTEST_S: f64 = 30.0;
/// The sigma of another axis's share may be at most this: 1.1 deg of mounting.
const MAX_CROSS_SIGMA: f64 = 0.02;
/// The sigma of the gain may be at most this.
const MAX_GAIN_SIGMA: f64 = 0.005;
/// The robust deviation of the spans' angles from the fit may be at most this, rad: no corrected gyro has so large an
/// error in so short a time.
const MAX_RESIDUAL_RAD: f64 = 0.05;

/// The reason why a drive gives no calibration.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum CalibrateError {
    /// The drive cannot be run.
    #[error(transparent)]
    Replay(#[from] ReplayError),
    /// The drive has no reference of its heading.
    #[error("{path}: no {columns}, which a calibration needs")]
    NoReference {
        /// The recording.
        path: String,
        /// The columns that would serve as one.
        columns: &'static str,
    },
    /// The drive is too short.
    #[error("{path}: {seconds:.0} s with a reference, a calibration needs {SHORTEST_S:.0}")]
    TooShort {
        /// The recording.
        path: String,
        /// The time with a reference, s.
        seconds: f64,
    },
    /// Reference and gyro contradict each other, whatever the calibration.
    #[error("{path}: reference and gyro differ by {rad:.3} rad from span to span: they are not of one drive")]
    Contradiction {
        /// The recording.
        path: String,
        /// The robust deviation.
        rad: f64,
    },
    /// An element is further from the identity than a real unit's can be.
    #[error("{what} {value:+.4}: no unit is so far off; configure how the sensor is mounted")]
    Implausible {
        /// The name of the element.
        what: &'static str,
        /// Its value.
        value: f64,
    },
}

/// Holds a share of the map, with its sigma.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Share {
    /// The name of the share.
    pub name: &'static str,
    /// The value; 0 where it is refused.
    pub value: f64,
    /// Its standard deviation, from fits that leave out one block of time each.
    pub sigma: f64,
    /// The reason why it is refused: the drives do not show it.
    pub refused: Option<&'static str>,
}

/// Holds a drive, replayed with the weights that the board runs.
pub struct Drive<'a> {
    /// The recording.
    pub recording: &'a Recording,
    /// Its replay, without a map.
    pub replay: Replay,
}

/// Lists the shares: the name, the largest sigma, and what the drives lack if the share is not found.
const SHARES: [(&str, f64, &str); 3] = [
    ("roll", MAX_CROSS_SIGMA, "no rolling: the drives do not show it"),
    ("pitch", MAX_CROSS_SIGMA, "no pitching: the drives do not show it"),
    ("gain", MAX_GAIN_SIGMA, "no turns: the drives do not show it"),
];

/// Fits the map of a unit to its drives.
///
/// # Errors
/// [`CalibrateError`].
pub fn calibrate(drives: &[Drive<'_>], weights: u32) -> Result<UnitFile, CalibrateError> {
    let spans: Vec<Vec<Span>> = drives.iter().map(spans::of).collect::<Result<_, _>>()?;
    let mut shown = [true; 3];
    let all = Fit::new(&spans, shown);
    for (shown, (sigma, (_, most, _))) in shown.iter_mut().zip(all.sigmas.iter().zip(SHARES)) {
        *shown = *sigma <= most;
    }
    let fit = Fit::new(&spans, shown);
    let shares: [Share; 3] = std::array::from_fn(|k| {
        let (name, _, lacking) = SHARES[k];
        match shown[k] {
            true => Share { name, value: fit.shares[k], sigma: fit.sigmas[k], refused: None },
            false => Share { name, value: 0.0, sigma: all.sigmas[k], refused: Some(lacking) },
        }
    });
    for (drive, deviation) in drives.iter().zip(&fit.deviations) {
        if *deviation > MAX_RESIDUAL_RAD {
            let path = drive.recording.path.clone();
            return Err(CalibrateError::Contradiction { path, rad: *deviation });
        }
    }
    let [roll, pitch, gain] = shares.map(|share| share.value);
    let elements = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [roll, pitch, 1.0 + gain]];
    let gyro_map = GyroMap::from_elements(elements.map(|row| row.map(|element| element as f32)));
    let gyro_map = gyro_map.ok_or_else(|| {
        let farthest = shares.iter().max_by(|a, b| a.value.abs().total_cmp(&b.value.abs()));
        let (what, value) = farthest.map_or(("map", 0.0), |share| (share.name, share.value));
        CalibrateError::Implausible { what, value }
    })?;
    Ok(UnitFile { gyro_map, shares, weights, drives: unit_file::drives(drives, &fit) })
}
