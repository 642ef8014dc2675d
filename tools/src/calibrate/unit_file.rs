//! The calibration file of a unit holds the map for the board and the uncertainty of the map.

use super::{Cut, Share, fit::Fit};
use crate::drive::error::{DataError, read_text};
use gyronet::mounting::GyroMap;
use gyronet::store::UnitMap;
use serde::{Deserialize, Serialize};
use std::path::Path;

#[derive(Debug, Clone, PartialEq)]
pub struct UnitFile {
    /// The map that the board applies to the gyro.
    pub gyro_map: GyroMap,
    /// The shares of roll, pitch and yaw rate that the last row of the map adds to the yaw rate.
    pub shares: [Share; 3],
    /// The checksum of the weights that corrected the drives.
    pub weights: u32,
    pub drives: Vec<DriveFit>,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct DriveFit {
    pub name: String,
    /// The gyro's bias about x, y and z at the start of the drive, rad/s.
    pub gyro_bias_rad_per_s: [f64; 3],
    /// The remaining bias, rad/s: the reference less the corrected yaw rate.
    pub yaw_rate_bias_rad_per_s: f64,
    /// The robust standard deviation of the spans' angles from the fit, rad; `None` by a course.
    pub deviation_rad: Option<f64>,
}

#[derive(Serialize, Deserialize)]
struct Content {
    gyro_map: [[f32; 3]; 3],
    weights: u32,
    #[serde(default)]
    shares: serde_json::Value,
    #[serde(default)]
    drives: Vec<DriveFit>,
}

impl UnitFile {
    pub fn json(&self) -> serde_json::Value {
        let shares = self.shares.map(|Share { name, value, sigma, limit, refused, remark }| {
            let share =
                serde_json::json!({ "value": value, "sigma": sigma, "limit": limit, "refused": refused, "remark": remark });
            (String::from(name), share)
        });
        let content = Content {
            gyro_map: self.gyro_map.elements(),
            weights: self.weights,
            shares: serde_json::Value::Object(shares.into_iter().collect()),
            drives: self.drives.clone(),
        };
        serde_json::json!(content)
    }
}

pub fn read(path: &Path) -> Result<UnitMap, DataError> {
    let refused = |reason: String| DataError::because(path.display(), reason);
    let content: Content = serde_json::from_str(&read_text(path)?).map_err(|error| {
        refused(format!("not a calibration file, as `gyronet calibrate --out` writes it: {error}"))
    })?;
    let gyro_map = GyroMap::from_elements(content.gyro_map)
        .ok_or_else(|| refused("gyro_map: an element is too far from the identity".into()))?;
    Ok(UnitMap { gyro_map, weights: content.weights })
}

/// Reads the map of a file, which must have been computed with weights of the checksum `runs`.
pub fn read_for(path: &Path, runs: u32) -> Result<GyroMap, DataError> {
    let UnitMap { gyro_map, weights: found } = read(path)?;
    let reason = || format!("computed with the weights {found:08x}, but {runs:08x} are in use");
    (found == runs).then_some(gyro_map).ok_or_else(|| DataError::because(path.display(), reason()))
}

pub(super) fn drives(drives: &[Cut], fit: &Fit) -> Vec<DriveFit> {
    let mut fits = fit.biases.iter().zip(&fit.deviations);
    let of = |drive: &Cut| {
        let (bias, deviation_rad) = match drive.by_course {
            Some(learnt) => (learnt.bias, None),
            None => fits.next().map_or((0.0, None), |(bias, deviation)| (*bias, Some(*deviation))),
        };
        DriveFit {
            name: drive.name.clone(),
            gyro_bias_rad_per_s: drive.gyro_bias,
            yaw_rate_bias_rad_per_s: bias,
            deviation_rad,
        }
    };
    drives.iter().map(of).collect()
}
