//! Finds the recordings of real drives; a test without them is skipped. They are not part of the
//! repository, because their licence does not allow it.

use crate::require::{self, Need};
use std::path::{Path, PathBuf};

/// The environment variable that names the folder with `wid_car/`.
pub const VARIABLE: &str = "GYRONET_DATA";

pub fn workspace() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("host-tests lies in the workspace")
}

/// Returns the folder of the recordings: [`VARIABLE`], from the repository's root if relative, else `shared/data`
/// beside the repository.
pub fn folder() -> PathBuf {
    let beside = || workspace().parent().unwrap_or(workspace()).join("shared/data");
    std::env::var_os(VARIABLE).map_or_else(beside, |folder| workspace().join(folder))
}

/// Returns the file of one drive of `wid_car`; without it reports that the test is skipped.
pub fn trial(test: &str, number: u32) -> Option<PathBuf> {
    let path = folder().join(format!("wid_car/trial{number:02}_100hz.csv"));
    let found = if path.is_file() {
        Ok(path)
    } else {
        Err(format!("no recording {} ({VARIABLE} names another folder)", path.display()))
    };
    require::wants(test, Need::Data, found)
}

/// Returns the files of these drives; where one is missing, reports that the test is skipped.
pub fn trials(test: &str, numbers: &[u32]) -> Option<Vec<PathBuf>> {
    numbers.iter().map(|number| trial(test, *number)).collect()
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Row {
    /// The time, s.
    pub time: f64,
    /// The acceleration, m/s^2.
    pub acceleration: [f32; 3],
    /// The rate of turn, rad/s.
    pub rate_of_turn: [f32; 3],
    /// The rate of the reference gyro's z axis, rad/s.
    pub reference: f64,
}

/// Reads the rows of a recording. The tests have this reader of their own, to compare with that of the tools.
pub fn rows(path: &Path) -> Vec<Row> {
    let text = std::fs::read_to_string(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    let mut lines = text.lines();
    let header: Vec<&str> = lines.next().expect("a header").split(',').collect();
    let column = |name: &str| header.iter().position(|column| *column == name).expect(name);
    let vector = |prefix: &str| ["x", "y", "z"].map(|axis| column(&format!("{prefix}_{axis}")));
    let (time, acceleration, rate) = (column("t_s"), vector("acc"), vector("gyr"));
    let reference = column("ref_gyr_z");
    let row = |line: &str| {
        let fields: Vec<&str> = line.split(',').collect();
        let f32 = |column: usize| fields[column].parse::<f32>().expect("a number");
        let f64 = |column: usize| fields[column].parse::<f64>().expect("a number");
        Row {
            time: f64(time),
            acceleration: acceleration.map(f32),
            rate_of_turn: rate.map(f32),
            reference: f64(reference),
        }
    };
    lines.map(row).collect()
}
