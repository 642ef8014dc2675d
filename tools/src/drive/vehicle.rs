//! A vehicle file is a small TOML file with the mounting of the sensor, the dimensions of the wheels, and the names
//! of the logs' channels. `gyronet import` reads one and writes it beside the drive, as `drive.toml` beside
//! `drive.csv`, where every command that reads the drive finds it.
//!
//! ```toml
//! [mounting]          # of the IMU: degrees about its axes, roll first
//! yaw_deg = 90.0
//! applied = false     # true: the rows of the drive are already in the vehicle's axes
//! [wheels]
//! radius_m = 0.31     # rolling radius
//! track_m = 1.52      # distance between left and right
//! front_left = "WHEELS.FL"
//! [signals]           # needed if several channels fit
//! imu = "/imu/data"
//! position = "/gps/fix"
//! [columns]           # of a text table: our name = name in the table, with a unit
//! t_s = { name = "timestamp", unit = "ms" }
//! ```

use super::error::{DataError, DataFault};
use gyronet::mounting::Rotation;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Default rolling radius, m: that of the recorded car. The vehicle file gives another vehicle's.
pub const RADIUS: f64 = 0.289;

/// The contents of a vehicle file.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Vehicle {
    /// The mounting of the IMU.
    pub mounting: Mounting,
    /// The wheels and the signals of their speeds.
    pub wheels: Wheels,
    /// The channels to use if several fit.
    pub signals: Signals,
    pub bus: BusFiles,
    /// The columns of a text table.
    pub columns: Columns,
    #[serde(skip)]
    pub path: Option<PathBuf>,
}

/// The columns of a text table, by our name of each column.
pub type Columns = BTreeMap<String, Column>;

/// A column of a text table.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Column {
    pub name: String,
    /// The unit of the column; SI if absent.
    pub unit: Option<String>,
}

/// Angles from the sensor's axes to the vehicle's, degrees, as in the board's configuration.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Mounting {
    /// Angle about x.
    pub roll_deg: f64,
    /// Angle about y.
    pub pitch_deg: f64,
    /// Angle about z.
    pub yaw_deg: f64,
    /// The rows of the drive are already in the vehicle's axes.
    pub applied: bool,
}

/// The dimensions of the wheels and the channels of their speeds.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Wheels {
    /// Rolling radius, m; it converts speeds to wheel rates.
    pub radius_m: Option<f64>,
    /// Distance between the left and the right wheels, m.
    pub track_m: Option<f64>,
    /// Channel of the front left wheel's speed.
    pub front_left: Option<String>,
    /// Channel of the front right wheel's speed.
    pub front_right: Option<String>,
    /// Channel of the rear left wheel's speed.
    pub rear_left: Option<String>,
    /// Channel of the rear right wheel's speed.
    pub rear_right: Option<String>,
}

/// The channels to use if several fit.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Signals {
    /// Channel of the gyro and accelerometer.
    pub imu: Option<String>,
    /// Channel of the odometry, whose speed replaces the wheels.
    pub odometry: Option<String>,
    /// Channel of the GNSS position.
    pub position: Option<String>,
    /// Channel of the reference yaw rate, `ref_gyr_z`: that of a better gyro, never of the IMU itself.
    pub reference_rate: Option<String>,
}

#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct BusFiles {
    /// The DBC file; a relative path starts at the vehicle file's folder.
    pub dbc: Option<PathBuf>,
}

impl Vehicle {
    /// Reads a vehicle file.
    pub fn read(path: &Path) -> Result<Self, DataError> {
        let name = path.display().to_string();
        let text = std::fs::read_to_string(path).map_err(|source| DataError::open(&name, source))?;
        let mut vehicle = Self::parse(&name, &text)?;
        if let (Some(dbc), Some(folder)) = (&mut vehicle.bus.dbc, path.parent()) {
            *dbc = folder.join(&*dbc);
        }
        vehicle.path = Some(path.to_owned());
        Ok(vehicle)
    }

    pub fn beside(drive: &Path) -> PathBuf {
        drive.with_extension("toml")
    }

    /// Reads the vehicle file of a drive; returns the defaults if there is none.
    pub fn of_drive(drive: &Path) -> Result<Self, DataError> {
        let path = Self::beside(drive);
        if path.is_file() { Self::read(&path) } else { Ok(Self::default()) }
    }

    /// Returns the vehicle without the names of channels, columns and bus files.
    pub fn without_names(self) -> Self {
        let Wheels { radius_m, track_m, .. } = self.wheels;
        let wheels = Wheels { radius_m, track_m, ..Wheels::default() };
        Self { mounting: self.mounting, wheels, path: self.path, ..Self::default() }
    }

    /// Returns the rolling radius of the wheels, m; [`RADIUS`] if the file gives none.
    pub fn radius_m(&self) -> f64 {
        self.wheels.radius_m.unwrap_or(RADIUS)
    }

    pub fn parse(path: &str, text: &str) -> Result<Self, DataError> {
        let error = |reason: String| DataError::of(path, DataFault::Vehicle { reason });
        let vehicle: Self = toml::from_str(text).map_err(|cause| {
            let cause = cause.to_string();
            error(cause.lines().filter(|line| !line.trim().is_empty()).collect::<Vec<_>>().join(" "))
        })?;
        for (name, length) in [("radius_m", vehicle.wheels.radius_m), ("track_m", vehicle.wheels.track_m)] {
            if length.is_some_and(|length| !(0.01..10.0).contains(&length)) {
                return Err(error(format!("wheels.{name} must be 0.01 to 10 m")));
            }
        }
        let Mounting { roll_deg, pitch_deg, yaw_deg, .. } = vehicle.mounting;
        if [roll_deg, pitch_deg, yaw_deg].iter().any(|angle| angle.is_nan() || angle.abs() > 360.0) {
            return Err(error("the angles of mounting must be at most 360 degrees".to_owned()));
        }
        Ok(vehicle)
    }
}

impl Mounting {
    /// Returns the rotation that the rows of a drive still need, as the board computes it; `None` if they need none.
    pub fn rotation(&self) -> Option<Rotation> {
        let [roll, pitch, yaw] = [self.roll_deg, self.pitch_deg, self.yaw_deg].map(|angle| angle as f32);
        let rotation = Rotation::from_mounting(roll, pitch, yaw)?;
        (!self.applied && rotation != Rotation::IDENTITY).then_some(rotation)
    }

    /// Rotates a vector from the sensor's axes to the vehicle's, unless the rows are already in the vehicle's axes.
    pub fn turn(&self, [x, y, z]: [f64; 3]) -> [f64; 3] {
        if self.applied {
            return [x, y, z];
        }
        let [(sr, cr), (sp, cp), (sy, cy)] =
            [self.roll_deg, self.pitch_deg, self.yaw_deg].map(|angle| angle.to_radians().sin_cos());
        let (y, z) = (cr * y - sr * z, sr * y + cr * z);
        let (x, z) = (cp * x + sp * z, cp * z - sp * x);
        [cy * x - sy * y, sy * x + cy * y, z]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use gyronet::units::AngularRate;

    #[test]
    fn angles_mean_what_they_mean_on_the_board() {
        let (roll, pitch, yaw) = (12.0f32, -34.0f32, 56.0f32);
        let mounting =
            Mounting { roll_deg: roll.into(), pitch_deg: pitch.into(), yaw_deg: yaw.into(), applied: false };
        let board = mounting.rotation().unwrap();
        assert_eq!(Mounting { applied: true, ..mounting }.rotation(), None);
        for axis in [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]] {
            let rate = axis.map(|w: f64| AngularRate::from_rad_per_sec(w as f32).unwrap());
            for (here, there) in mounting.turn(axis).iter().zip(board.rate(rate)) {
                assert!((here - there.rad_per_sec()).abs() < 1e-5, "{here} {there:?}");
            }
        }
    }

    #[test]
    fn a_misspelt_key_is_refused_by_name() {
        let error = Vehicle::parse("car.toml", "[wheels]\nradius = 0.3\n").unwrap_err().to_string();
        assert!(error.starts_with("car.toml: ") && error.contains("unknown field `radius`"), "{error}");
        let error = Vehicle::parse("car.toml", "[wheels]\nradius_m = 30\n").unwrap_err().to_string();
        assert_eq!(error, "car.toml: not a valid vehicle file: wheels.radius_m must be 0.01 to 10 m");
    }
}
