//! A vehicle file is a small TOML file with the mounting of the sensor, the dimensions of the wheels, and the names
//! of the logs' channels. `gyronet import` reads one and writes it beside the drive, as `drive.toml` beside
//! `drive.csv`, where every command that reads the drive finds it.
//!
//! ```toml
//! [mounting]          # of the IMU: degrees about its axes, roll first
//! yaw_deg = 90.0
//! [wheels]
//! radius_m = 0.31     # rolling radius
//! track_m = 1.52      # distance between left and right
//! [recording]         # written by the import
//! start = 1700000000.25    # time of day of the first row, s since 1970
//! ```

use super::error::{DataError, DataFault, read_text};
use gyronet::mounting::Rotation;
use serde::Deserialize;
use serde::de::IgnoredAny;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Default rolling radius, m: that of the recorded car. The vehicle file gives another vehicle's.
pub const RADIUS: f64 = 0.289;

/// The contents of a vehicle file. The tables and names with which a log is imported are for Python only.
#[derive(Debug, Clone, Default, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Vehicle {
    pub mounting: Mounting,
    pub wheels: Wheels,
    pub recording: Origin,
    /// Channels of the logs, by role.
    pub signals: BTreeMap<String, String>,
    bus: IgnoredAny,
    columns: IgnoredAny,
    #[serde(skip)]
    pub path: Option<PathBuf>,
}

/// The import of the drive, as `gyronet import` writes it.
#[derive(Debug, Clone, Default, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Origin {
    /// Time of day of the first row, s since 1970, if a clock of the logs shows it.
    pub start: Option<f64>,
    /// The mounting by which the rows have been turned already.
    pub mounting: Mounting,
    /// Unit of each channel that was used.
    pub units: BTreeMap<String, String>,
    /// Samples a second of each source, by its role.
    pub rates: BTreeMap<String, f64>,
    /// Records that could not be used, by reason.
    pub dropped: BTreeMap<String, u64>,
}

/// Angles from the sensor's axes to the vehicle's, degrees, as in the board's configuration.
#[derive(Debug, Clone, Copy, Default, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Mounting {
    pub roll_deg: f64,
    pub pitch_deg: f64,
    pub yaw_deg: f64,
    /// The rows of the drive are already in the vehicle's axes: so wrote older imports, instead of zero angles.
    pub applied: bool,
}

/// The dimensions of the wheels, and the channels of their speeds.
#[derive(Debug, Clone, Default, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Wheels {
    /// Rolling radius, m; it converts speeds to wheel rates.
    pub radius_m: Option<f64>,
    /// Distance between the left and the right wheels, m.
    pub track_m: Option<f64>,
    pub front_left: Option<String>,
    pub front_right: Option<String>,
    pub rear_left: Option<String>,
    pub rear_right: Option<String>,
}

impl Vehicle {
    pub fn read(path: &Path) -> Result<Self, DataError> {
        let vehicle = Self::parse(&path.display().to_string(), &read_text(path)?)?;
        Ok(Self { path: Some(path.to_owned()), ..vehicle })
    }

    pub fn beside(drive: &Path) -> PathBuf {
        drive.with_extension("toml")
    }

    /// Reads the vehicle file of a drive; returns the defaults if there is none.
    pub fn of_drive(drive: &Path) -> Result<Self, DataError> {
        let path = Self::beside(drive);
        if path.is_file() { Self::read(&path) } else { Ok(Self::default()) }
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
        if vehicle.recording.start.is_some_and(|start| !(0.0..1e11).contains(&start)) {
            return Err(error("recording.start must be a time in seconds since 1970".to_owned()));
        }
        let Mounting { roll_deg, pitch_deg, yaw_deg, .. } = vehicle.mounting;
        if [roll_deg, pitch_deg, yaw_deg].iter().any(|angle| angle.is_nan() || angle.abs() > 360.0) {
            return Err(error("the angles of mounting must be at most 360 degrees".to_owned()));
        }
        Ok(vehicle)
    }
}

impl Mounting {
    /// The mounting of these angles of roll, pitch and yaw, degrees.
    pub fn of([roll_deg, pitch_deg, yaw_deg]: [f64; 3]) -> Self {
        Self { roll_deg, pitch_deg, yaw_deg, applied: false }
    }

    /// Returns the rotation that the rows of a drive still need, as the board computes it; `None` if they need none.
    pub fn rotation(&self) -> Option<Rotation> {
        let [roll, pitch, yaw] = [self.roll_deg, self.pitch_deg, self.yaw_deg].map(|angle| angle as f32);
        let rotation = Rotation::from_mounting(roll, pitch, yaw)?;
        (!self.applied && rotation != Rotation::IDENTITY).then_some(rotation)
    }

    /// The mounting that turns rows as this one and then as `next`.
    #[must_use]
    pub fn then(&self, next: &Self) -> Self {
        let (first, second) = (self.matrix(), next.matrix());
        let element =
            |row: usize, column: usize| (0..3).map(|k| second[row][k] * first[k][column]).sum::<f64>();
        let m: [[f64; 3]; 3] = std::array::from_fn(|row| std::array::from_fn(|column| element(row, column)));
        let level = m[2][1].hypot(m[2][2]);
        // With x upright, roll and yaw turn about the same axis.
        let (roll, yaw) = if level > 1e-6 {
            (m[2][1].atan2(m[2][2]), m[1][0].atan2(m[0][0]))
        } else {
            (0.0, (-m[0][1]).atan2(m[1][1]))
        };
        Self::of([roll, (-m[2][0]).atan2(level), yaw].map(f64::to_degrees))
    }

    fn matrix(&self) -> [[f64; 3]; 3] {
        let angles = if self.applied { [0.0; 3] } else { [self.roll_deg, self.pitch_deg, self.yaw_deg] };
        let [(sr, cr), (sp, cp), (sy, cy)] = angles.map(|angle| angle.to_radians().sin_cos());
        [
            [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
            [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
            [-sp, cp * sr, cp * cr],
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use gyronet::units::SpecificForce;

    #[test]
    fn two_mountings_are_one() {
        for (first, second) in [
            ([12.0, -34.0, 56.0], [-170.0, 20.0, 100.0]),
            ([0.0, 90.0, 30.0], [0.0; 3]),
            ([180.0, 0.0, 0.0], [0.0, 0.0, -90.0]),
        ] {
            let (first, second) = (Mounting::of(first), Mounting::of(second));
            let both = first.then(&second).rotation().unwrap_or(Rotation::IDENTITY);
            let [first, second] = [first, second].map(|one| one.rotation().unwrap_or(Rotation::IDENTITY));
            for axis in [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]] {
                let axis = axis.map(|value| SpecificForce::from_metre_per_sec2(value).unwrap());
                for (one, two) in both.force(axis).iter().zip(second.force(first.force(axis))) {
                    assert!((one.metre_per_sec2() - two.metre_per_sec2()).abs() < 1e-4, "{one:?} {two:?}");
                }
            }
        }
    }

    #[test]
    fn the_tables_of_an_import_are_read_or_left_to_python() {
        let text = "[mounting]\nyaw_deg = 90\n[wheels]\nrear_left = 'WHEELS.RL'\n[signals]\nimu = '/imu'\n[bus]\n\
                    dbc = 'car.dbc'\n[columns]\nt_s = { name = 'zeit', unit = 'ms' }\n";
        let old = Vehicle::parse("car.toml", text).unwrap();
        assert_eq!((old.mounting.yaw_deg, &old.recording), (90.0, &Origin::default()));
        let text = format!(
            "{text}[recording]\nstart = 1700000000.25\nunits = {{ '/imu' = 'm/s^2, rad/s' }}\nrates = {{ imu = 25 }}\n"
        );
        let new = Vehicle::parse("car.toml", &text).unwrap();
        assert_eq!(new.recording.start, Some(1_700_000_000.25));
    }

    #[test]
    fn a_misspelt_key_is_refused_by_name() {
        let error = Vehicle::parse("car.toml", "[wheels]\nradius = 0.3\n").unwrap_err().to_string();
        assert!(error.starts_with("car.toml: ") && error.contains("unknown field `radius`"), "{error}");
        let error = Vehicle::parse("car.toml", "[wheels]\nradius_m = 30\n").unwrap_err().to_string();
        assert_eq!(error, "car.toml: not a valid vehicle file: wheels.radius_m must be 0.01 to 10 m");
    }
}
