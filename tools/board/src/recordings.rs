//! Finds the recordings of real drives; a test without them is skipped. They are not part of the
//! repository, because we saw no licence that allows it.

use crate::require::{self, Need};
use std::path::{Path, PathBuf};

pub const VARIABLE: &str = "GYRONET_DATA";

pub fn workspace() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR")).ancestors().nth(2).expect("it lies in the workspace")
}

/// [`VARIABLE`], from the repository's root if relative, else `shared/data`
/// beside the repository.
pub fn folder() -> PathBuf {
    let beside = || workspace().parent().unwrap_or(workspace()).join("shared/data");
    std::env::var_os(VARIABLE).map_or_else(beside, |folder| workspace().join(folder))
}

/// A file or folder among the recordings; without it the test is reported as skipped.
pub fn found(name: &str) -> Option<PathBuf> {
    let path = folder().join(name);
    let missing = format!("no recording {} ({VARIABLE} names another folder)", path.display());
    require::wants(Need::Data, path.exists().then_some(path).ok_or(missing))
}

pub fn trial(number: u32) -> Option<PathBuf> {
    found(&format!("wid_car/trial{number:02}_100hz.csv"))
}

/// The recordings with a speed or wheels, in order.
pub fn with_speed() -> Option<Vec<PathBuf>> {
    found("wid_car")?;
    let sets = ["wid_car", "real_car", "rc_car", "utv", "truck", "car_mti710"];
    let mut paths: Vec<_> = sets.into_iter().flat_map(|set| drives(&folder().join(set))).collect();
    paths.sort();
    Some(paths)
}

/// The drives in a folder, in order; none without it.
pub fn drives(folder: &Path) -> Vec<PathBuf> {
    let files = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let is_drive = |path: &PathBuf| path.extension().is_some_and(|e| e == "csv");
    let mut paths: Vec<_> = files.map(|file| file.path()).filter(is_drive).collect();
    paths.sort();
    paths
}

pub fn trials(numbers: &[u32]) -> Option<Vec<PathBuf>> {
    numbers.iter().map(|number| trial(*number)).collect()
}
