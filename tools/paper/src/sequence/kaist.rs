//! Reads KAIST Complex Urban: `sensor_data/{xsens_imu,fog,encoder}.csv`,
//! `calibration/EncoderParameter.txt`, `global_pose.csv`. Files have no headers; stamps are nanoseconds since 1970; x
//! forward, y left, z up. The early sequences (campus00, urban00 to 05), which have no gyro, are refused.
//!
//! Sources: the readers irapkaist/file_player and tsyxyz/kaist2bag, and the data set's page.

use super::Files;
use super::rows::{Format, Rows};
use super::summary::seconds;
use super::track::{Track, Unwrap};
use gyronet_tools::drive::error::{DataError, read_text};
use std::f64::consts::PI;
use std::path::Path;

/// The used columns are the quaternion x, y, z, w, and, after the Euler angles, angular rate and specific force.
const IMU: Format = Format { columns: 17, used: &[1, 2, 3, 4, 8, 9, 10, 11, 12, 13], nominal_hz: 100.0 };
/// The used column is the yaw increment.
const FOG: Format = Format { columns: 4, used: &[3], nominal_hz: 1000.0 };
const ENCODER: Format = Format { columns: 3, used: &[1, 2], nominal_hz: 100.0 };
/// The used columns are r11, r21, x and y of three rows of rotation and position.
const POSE: Format = Format { columns: 13, used: &[1, 5, 4, 8], nominal_hz: 100.0 };
/// A wheel speed above this means that the wheel's counter was reset, m/s.
const IMPOSSIBLE_SPEED: f64 = 100.0;

pub(super) const CALIBRATION: &str = "calibration/EncoderParameter.txt";
pub(super) const PATHS: [&str; 4] =
    ["sensor_data/xsens_imu.csv", "sensor_data/fog.csv", "sensor_data/encoder.csv", "global_pose.csv"];

pub(super) fn open(folder: &Path) -> Result<Files, DataError> {
    let [imu, fog, encoder, pose] = PATHS.map(|path| folder.join(path));
    let parameters = EncoderParameters::read(&folder.join(CALIBRATION))?;
    let mut vendor = Unwrap::default();
    let imu = Track::new(Rows::open(&imu, IMU)?, None, move |row, _, _| {
        let [qx, qy, qz, qw, wx, wy, wz, fx, fy, fz] = row.fields;
        [fx, fy, fz, wx, wy, wz, vendor.angle(yaw([qx, qy, qz, qw]))]
    })?;
    let epoch = Some(imu.epoch);
    let mut turned = 0.0;
    let fog = Track::new(Rows::open(&fog, FOG)?, epoch, move |row, _, _| {
        turned += row.fields[0];
        [turned]
    })?;
    let mut wheels = Encoder::new(parameters);
    let encoder = Track::new(Rows::open(&encoder, ENCODER)?, epoch, move |row, time, summary| {
        let [left, right, ..] = row.fields;
        let (metres, reset) = wheels.metres([left, right], time);
        if reset {
            summary.resets.count(row.line);
        }
        metres
    })?;
    let mut heading = Unwrap::default();
    let truth = Track::new(Rows::open(&pose, POSE)?, epoch, move |row, _, _| {
        let [r11, r21, x, y, ..] = row.fields;
        // The nearest proper rotation has the same quotient of the two, however few digits are printed.
        [x, y, heading.angle(libm::atan2(r21, r11))]
    })?;
    let (epoch_s, wheel_base) = (seconds(imu.epoch), parameters.base);
    Ok(Files { epoch_s, imu, fog, wheels: encoder, truth, wheel_base })
}

pub(crate) fn yaw([x, y, z, w]: [f64; 4]) -> f64 {
    libm::atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
}

#[derive(Debug, Clone, Copy, PartialEq)]
struct EncoderParameters {
    /// Counts per revolution.
    resolution: f64,
    /// Diameter of the left and the right wheel, m.
    diameter: [f64; 2],
    /// The distance between the wheels, m.
    base: f64,
}

impl EncoderParameters {
    fn read(path: &Path) -> Result<Self, DataError> {
        let name = path.display().to_string();
        let text = read_text(path)?;
        // The second word of a line is the key, as in the data set's own readers.
        let number = |parameter: &'static str, key: &str| {
            let line = text.lines().find(|line| line.split_whitespace().nth(1) == Some(key));
            let value: Option<f64> = line
                .and_then(|line| line.split_whitespace().last())
                .and_then(|word| word.parse().ok())
                .filter(|value: &f64| value.is_finite() && *value > 0.0);
            value.ok_or_else(|| DataError::because(&name, format!("no usable parameter {parameter:?}")))
        };
        Ok(Self {
            resolution: number("Encoder resolution", "resolution:")?,
            diameter: [
                number("Encoder left wheel diameter", "left")?,
                number("Encoder right wheel diameter", "right")?,
            ],
            base: number("Encoder wheel base", "wheel")?,
        })
    }
}

/// Converts counts to distances since the first row, in metres, across resets.
struct Encoder {
    parameters: EncoderParameters,
    last: Option<(f64, [f64; 2])>,
    /// Distance and speed of both wheels, m and m/s.
    metres: [f64; 2],
    speed: [f64; 2],
}

impl Encoder {
    fn new(parameters: EncoderParameters) -> Self {
        Self { parameters, last: None, metres: [0.0; 2], speed: [0.0; 2] }
    }

    /// Returns the distances, m, and whether a counter was reset since the previous row. After a reset both wheels
    /// are assumed to have kept their speed.
    fn metres(&mut self, counts: [f64; 2], time: f64) -> ([f64; 2], bool) {
        let (last_time, last) = self.last.replace((time, counts)).unwrap_or((time, counts));
        let EncoderParameters { resolution, diameter, .. } = self.parameters;
        let seconds = time - last_time;
        let way = |wheel: usize| (counts[wheel] - last[wheel]) / resolution * diameter[wheel] * PI;
        let moved = [way(0), way(1)];
        // Counts are integers, so one count in 1 us does not measure the speed.
        let reset = moved.iter().any(|way| way.abs() > IMPOSSIBLE_SPEED * seconds.max(0.01));
        if !reset && seconds > 0.0 {
            self.speed = moved.map(|way| way / seconds);
        }
        for (metres, (moved, speed)) in self.metres.iter_mut().zip(moved.into_iter().zip(self.speed)) {
            *metres += if reset { speed * seconds } else { moved };
        }
        (self.metres, reset)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parameters() -> EncoderParameters {
        EncoderParameters { resolution: 4096.0, diameter: [0.623_022, 0.622_356], base: 1.5285 }
    }

    #[test]
    fn one_turn_of_each_wheel() {
        let mut encoder = Encoder::new(parameters());
        encoder.metres([0.0, 0.0], 0.0);
        let ([left, right], reset) = encoder.metres([4096.0, 4096.0], 0.1);
        assert!(!reset);
        assert!((left - 1.957_281_3).abs() < 5e-8 && (right - 1.955_189_0).abs() < 5e-8);
        let turned = (right - left) / parameters().base;
        assert!((turned + 0.001_368_9).abs() < 5e-7, "{turned}");
    }

    #[test]
    fn a_reset_is_bridged_at_the_last_speed() {
        let mut encoder = Encoder::new(parameters());
        for k in 0..10 {
            encoder.metres([500_000.0 + 100.0 * f64::from(k); 2], 0.01 * f64::from(k));
        }
        let ([before, _], _) = encoder.metres([501_000.0; 2], 0.1);
        let ([at, _], reset) = encoder.metres([3.0; 2], 0.11);
        assert!(reset);
        let ([after, _], reset) = encoder.metres([103.0; 2], 0.12);
        assert!(!reset);
        assert!(((at - before) - (after - at)).abs() < 1e-9);
    }
}
