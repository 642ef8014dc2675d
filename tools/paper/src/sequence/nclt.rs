//! Reads NCLT: `ms25.csv`, `kvh.csv`, `wheels.csv`, `groundtruth_DATE.csv`. Files have no headers; stamps
//! are microseconds since 1970; axes are x forward, y right, z down, heading clockwise from north. The output is x
//! forward, y left, z up, heading counter-clockwise from east, as in KAIST.
//!
//! The gyro's file holds its integrated angle, so that a lost message loses no angle. Source: the readers
//! bierschi/nclt2ros and ethz-asl/nclt_tools.

use super::Files;
use super::rows::{Format, Row, Rows};
use super::track::{Track, Unwrap};
use gyronet_tools::drive::error::{DataError, DataFault};
use std::f64::consts::FRAC_PI_2;
use std::path::{Path, PathBuf};

const MICROS: f64 = 1e6;
/// The used columns are specific force and angular rate, after the magnetic field.
const IMU: Format<6> =
    Format { columns: 10, used: [4, 5, 6, 7, 8, 9], stamps_per_second: MICROS, nominal_hz: 47.0 };
const FOG: Format<1> = Format { columns: 2, used: [1], stamps_per_second: MICROS, nominal_hz: 100.0 };
const WHEELS: Format<2> = Format { columns: 3, used: [1, 2], stamps_per_second: MICROS, nominal_hz: 41.0 };
/// The used columns are north, east and heading.
const POSE: Format<3> = Format { columns: 7, used: [1, 2, 6], stamps_per_second: MICROS, nominal_hz: 100.0 };

/// Finds the file of the truth, which has the date in its name.
pub(super) fn truth(folder: &Path) -> Result<PathBuf, DataError> {
    let entries =
        std::fs::read_dir(folder).map_err(|source| DataError::of(folder.display(), source.into()))?;
    let mut names: Vec<PathBuf> = entries.filter_map(|entry| entry.ok().map(|e| e.path())).collect();
    names.sort();
    let is_truth = |path: &PathBuf| {
        let name = path.file_name().and_then(|name| name.to_str()).unwrap_or_default();
        name.starts_with("groundtruth") && name.ends_with(".csv")
    };
    let missing = || DataError::of(folder.join("groundtruth_*.csv").display(), DataFault::Missing);
    names.into_iter().find(is_truth).ok_or_else(missing)
}

/// Names of the files other than the truth.
pub(super) const PATHS: [&str; 3] = ["ms25.csv", "kvh.csv", "wheels.csv"];

pub(super) fn open(folder: &Path) -> Result<Files, DataError> {
    let [imu, fog, wheels] = PATHS.map(|path| folder.join(path));
    let imu = Track::new(
        Rows::open(&imu, IMU)?,
        None,
        Box::new(|row: &Row<6>, _, _| {
            let [fx, fy, fz, wx, wy, wz] = row.fields;
            [fx, -fy, -fz, wx, -wy, -wz, 0.0]
        }),
    )?;
    let first = imu.epoch();
    let epoch = Some(first);
    let mut heading = Unwrap::default();
    let fog = Track::new(
        Rows::open(&fog, FOG)?,
        epoch,
        Box::new(move |row: &Row<1>, _, _| [-heading.angle(row.fields[0])]),
    )?;
    let (mut last, mut metres) = (None, [0.0; 2]);
    let wheels = Track::new(
        Rows::open(&wheels, WHEELS)?,
        epoch,
        Box::new(move |row: &Row<2>, time, _| {
            // A speed applies to the time since the previous row.
            let seconds = time - last.replace(time).unwrap_or(time);
            for (metres, speed) in metres.iter_mut().zip(row.fields) {
                *metres += speed * seconds;
            }
            metres
        }),
    )?;
    let mut yaw = Unwrap::default();
    let truth = Track::new(
        Rows::open(&truth(folder)?, POSE)?,
        epoch,
        Box::new(move |row: &Row<3>, _, _| {
            let [north, east, heading] = row.fields;
            [east, north, yaw.angle(FRAC_PI_2 - heading)]
        }),
    )?;
    Ok(Files {
        epoch_s: first as f64 / MICROS,
        imu: Box::new(imu),
        fog: Box::new(fog),
        wheels: Box::new(wheels),
        truth: Box::new(truth),
        has_gyro: true,
        has_vendor: false,
        wheel_base: None,
    })
}
