//! A recorded drive is a CSV file with a header and one row for each sample, best of 100 Hz. Other rates from 50 to 1000 Hz
//! are brought to 100 Hz as on the board ([`gyronet::align`]).
//!
//! Columns are found by name, in any order; unknown columns are skipped.
//!
//! | column | unit | |
//! |---|---|---|
//! | `t_s` | s | device time, rising |
//! | `acc_x`, `acc_y`, `acc_z` | m/s^2 | specific force: x forward, y left, z up |
//! | `gyr_x`, `gyr_y`, `gyr_z` | rad/s | angular rate |
//! | `ref_gyr_z` | rad/s | optional: the true yaw rate; empty if unknown |
//! | `ref_yaw` | rad | optional: the true course, to the left; empty if unknown |
//! | `temp_c` | deg C | optional: temperature of the sensor; empty if not recorded |
//! | `course`, `course_sigma` | rad | optional: course over ground by GNSS, clockwise from north, and its accuracy |
//! | `gnss_speed` | m/s | optional: speed over ground by GNSS |
//! | `gnss_lat`, `gnss_lon` | deg | optional: position by GNSS; without `course` it gives course and speed |
//! | `wheel1_rate` .. `wheel4_rate` | rad/s | optional: rate of a wheel; empty if not recorded |
//!
//! Values are converted to the codes of [`gyronet::units`] through f32, and times through 10 kHz ticks, as the sensor
//! sends them. So a recording read here and the same recording parsed from MTData2 bytes are bit-identical samples.

mod position;
mod reader;
mod resampled;
mod rest;
mod survey;

pub use position::{Track, between};
pub use reader::Reader;
pub use resampled::resampled;
pub use survey::{Facts, Survey};

use gyronet::heading::Heading;
use gyronet::sample::ImuSample;
use std::path::Path;

pub const WHEELS: usize = 4;
/// Largest mean rate of a standing wheel over a second, rad/s. A rate sensor on a standing wheel reads up to 0.04.
pub const WHEEL_STANDS: f64 = 0.3;

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Row {
    /// Line number in the file; the header is line 1.
    pub line: u64,
    pub sample: ImuSample,
    /// The true yaw rate, rad/s, less [`Facts::reference_bias`] in a [`Recording`](super::stream::Recording) or [`Drive`](super::stream::Drive).
    pub reference: Option<f64>,
    /// The true course, rad, positive to the left, from any zero direction, wrapped or not.
    pub course: Option<f64>,
    /// Rates of the wheels, rad/s.
    pub wheels: [Option<f64>; WHEELS],
    /// Speed over ground by GNSS, m/s.
    pub speed: Option<f64>,
    /// Course over ground by GNSS that arrives with the sample.
    pub heading: Option<Heading>,
    /// Latitude and longitude by GNSS, degrees.
    pub place: Option<[f64; 2]>,
}

impl Row {
    /// Returns a row that has a sample and nothing else.
    pub fn of(line: u64, sample: ImuSample) -> Self {
        let [reference, course, speed] = [None; 3];
        Self { line, sample, reference, course, wheels: [None; WHEELS], speed, heading: None, place: None }
    }
}

/// The name of a file without folder and extension.
pub(super) fn name(path: &str) -> &str {
    Path::new(path).file_stem().and_then(|stem| stem.to_str()).unwrap_or(path)
}

/// The name of the folder that a drive lies in: its set.
pub fn set(path: &Path) -> String {
    let whole = std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
    whole.parent().and_then(Path::file_name).unwrap_or_default().to_string_lossy().into_owned()
}

#[cfg(test)]
mod tests;
