//! Checks whether a drive can be trained on.

use crate::drive::DT;
use crate::drive::error::DataError;
use crate::drive::recording::{Recording, Row};
use crate::drive::replay::{ReplayError, initialise};
use crate::drive::stream::Drive;
use crate::evaluate::heading_error::{PLAUSIBLE_10S_RAD, Reference};
use gyronet::bias::STATIC_SAMPLES;
use gyronet::sample::{PERIOD_US, RATE_HZ};
use std::path::{Path, PathBuf};

/// Shortest length of a drive after static initialisation, s.
pub const SHORTEST_S: f64 = 30.0;
/// Largest difference of a sample period from 10 ms, microseconds.
const JITTER_US: u64 = 1_000;
/// Least angle of the reference in a second that counts as turning, rad; noise at rest must not count.
const TURNING_RAD: f64 = 0.02;

/// The reason why a drive cannot be trained on.
#[derive(Debug, thiserror::Error)]
pub enum Refusal {
    #[error(transparent)]
    Data(#[from] DataError),
    #[error(transparent)]
    Start(#[from] ReplayError),
    #[error("{path}: line {line}: no ref_gyr_z (true yaw rate), which training needs in every row{}", advice(*course))]
    NoReference {
        path: String,
        /// The first line without a true yaw rate.
        line: u64,
        /// True if the drive has a course instead.
        course: bool,
    },
    #[error("{path}: line {line}: {ms:.1} ms after the previous row; training needs a row every 10 ms")]
    Gap {
        path: String,
        /// The line after the first gap.
        line: u64,
        /// The time since the previous row, ms.
        ms: f64,
    },
    #[error("{path}: {seconds:.0} s after the 3 s at rest; training needs {SHORTEST_S:.0} s")]
    TooShort {
        path: String,
        /// Length of the drive after static initialisation, s.
        seconds: f64,
    },
    #[error(
        "{path}: ref_gyr_z disagrees with gyr_z by {rad:.2} rad in 10 s: a wrong unit, sign or clock, or another drive; \
        `gyronet doctor` says which"
    )]
    Disagrees {
        path: String,
        /// The typical difference in 10 s, rad.
        rad: f64,
    },
}

/// Returns advice for a drive whose only reference is a course.
fn advice(course: bool) -> &'static str {
    if course { "; its ref_yaw is enough for `gyronet calibrate`" } else { "" }
}

#[derive(Debug, Clone, PartialEq)]
pub struct Examined {
    pub path: PathBuf,
    /// The file's name without `.csv`.
    pub name: String,
    /// Length of the drive after static initialisation, s.
    pub seconds: f64,
    /// Sum of the turns to both sides, rad.
    pub turned_rad: f64,
}

pub fn examine(path: &Path) -> Result<Examined, Refusal> {
    let mut recording = Recording::read(path)?;
    // At its ends a reference from another source may be missing; the trainer leaves these rows out, too.
    let known = |row: &Row| row.reference.is_some();
    if let (Some(first), Some(last)) =
        (recording.rows.iter().position(known), recording.rows.iter().rposition(known))
    {
        recording.rows.truncate(last + 1);
        recording.rows.drain(..first);
    }
    let named = || recording.path.clone();
    if let Some(row) = recording.rows.iter().find(|row| row.reference.is_none()) {
        let course = recording.rows.iter().any(|row| row.course.is_some());
        return Err(Refusal::NoReference { path: named(), line: row.line, course });
    }
    let period = |pair: &[Row]| pair[1].sample.time.0 - pair[0].sample.time.0;
    let mut pairs = recording.rows.windows(2);
    if let Some(pair) = pairs.find(|pair| period(pair).abs_diff(PERIOD_US) > JITTER_US) {
        let (line, ms) = (pair[1].line, 1e-3 * period(pair) as f64);
        return Err(Refusal::Gap { path: named(), line, ms });
    }
    let moving = recording.rows.get(STATIC_SAMPLES as usize..).unwrap_or_default();
    let seconds = moving.len() as f64 * DT;
    if seconds < SHORTEST_S {
        return Err(Refusal::TooShort { path: named(), seconds });
    }
    let gyro: Vec<f64> = moving.iter().map(|row| row.sample.angular_rate[2].rad_per_sec()).collect();
    let reference: Vec<f64> = moving.iter().filter_map(|row| row.reference).collect();
    let bias = initialise(&Drive::from(&recording))?[2].rad_per_sec();
    let still: Vec<f64> = gyro.iter().map(|rate| rate - bias).collect();
    let seconds_turned =
        reference.chunks_exact(RATE_HZ as usize).map(|second| second.iter().sum::<f64>().abs() * DT);
    let turned_rad =
        seconds_turned.filter(|turned| *turned > TURNING_RAD).fold(0.0, |sum, turned| sum + turned);
    let typical = Reference::Rate(reference).errors(&still).and_then(|errors| errors.typical_10s);
    if let Some(rad) = typical.filter(|rad| *rad > PLAUSIBLE_10S_RAD) {
        return Err(Refusal::Disagrees { path: recording.path, rad });
    }
    Ok(Examined { path: path.to_owned(), name: recording.name().to_owned(), seconds, turned_rad })
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fmt::Write;

    /// Examines a drive with a row every 10 ms; `rates` gives the yaw rate and the reference at a time, s.
    fn examined(name: &str, seconds: u32, rates: impl Fn(f64) -> (f64, String)) -> Result<Examined, String> {
        let mut csv = String::from("t_s,acc_x,acc_y,acc_z,gyr_x,gyr_y,gyr_z,ref_gyr_z,ref_yaw\n");
        let course = if name == "course" { "0.1" } else { "" };
        for k in 0..seconds * RATE_HZ {
            let noise = 1e-3 * f64::from(k % 3) - 1e-3;
            let time = f64::from(k) * DT;
            let (gyro, reference) = rates(time);
            // Every axis varies as a sensor's does; equal readings count as stuck.
            let (up, gyro) = (9.8 + 10.0 * noise, gyro + noise);
            // Writing to a string does not fail.
            let _ =
                writeln!(csv, "{time:.2},{noise},{noise},{up},{noise},{noise},{gyro},{reference},{course}");
        }
        let path = std::env::temp_dir().join(format!("gyronet-examine-{}-{name}.csv", std::process::id()));
        std::fs::write(&path, csv).expect("a writable folder");
        let result = examine(&path).map_err(|refusal| refusal.to_string());
        std::fs::remove_file(&path).expect("the file just written");
        result
    }

    /// Returns half a turn per minute, from the fourth second on.
    fn turn(time: f64) -> f64 {
        if time < 3.0 { 0.0 } else { 0.05 }
    }

    #[test]
    fn a_drive_that_carries_a_training_is_measured() {
        let drive = examined("good", 63, |time| (turn(time) + 0.002, turn(time).to_string())).expect("good");
        assert!((drive.seconds - 60.0).abs() < 0.02, "{drive:?}");
        assert!((drive.turned_rad - 3.0).abs() < 0.06, "{drive:?}");
    }

    #[test]
    fn the_ends_without_a_reference_are_left_out() {
        let at = |time: f64| {
            if (1.0..61.0).contains(&time) { turn(time - 1.0).to_string() } else { String::new() }
        };
        let drive = examined("ends", 63, |time| (turn(time - 1.0) + 0.002, at(time))).expect("good");
        assert!((drive.seconds - 57.0).abs() < 0.02, "{drive:?}");
    }

    #[test]
    fn a_drive_that_carries_none_is_refused_with_the_reason() {
        let same = |rate: f64| (rate, rate.to_string());
        let without = |time| (0.0, if (20.0..40.0).contains(&time) { String::new() } else { "0".to_owned() });
        let never = |_| (0.0, String::new());
        for (name, seconds, reason, rates) in [
            ("blind", 63, "line 2002: no ref_gyr_z", &without as &dyn Fn(f64) -> (f64, String)),
            ("course", 63, "its ref_yaw is enough for `gyronet calibrate`", &never),
            ("short", 20, "17 s after the 3 s at rest; training needs 30 s", &|time| same(turn(time))),
            ("moving", 63, "starts moving: line ", &|time: f64| same((2.0 * time).sin())),
            ("mirrored", 63, "a wrong unit, sign or clock", &|time: f64| {
                (30.0 * turn(time), (-30.0 * turn(time)).to_string())
            }),
        ] {
            let refusal = examined(name, seconds, rates).expect_err(name);
            assert!(refusal.contains(reason) && refusal.contains(name), "{refusal}");
        }
    }
}
