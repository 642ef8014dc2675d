//! Finds the recordings of real drives; a test without them is skipped. They are not part of the
//! repository, because we saw no licence that allows it.

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
pub fn trial(number: u32) -> Option<PathBuf> {
    let path = folder().join(format!("wid_car/trial{number:02}_100hz.csv"));
    let found = if path.is_file() {
        Ok(path)
    } else {
        Err(format!("no recording {} ({VARIABLE} names another folder)", path.display()))
    };
    require::wants(Need::Data, found)
}

/// Returns the files of these drives; where one is missing, reports that the test is skipped.
pub fn trials(numbers: &[u32]) -> Option<Vec<PathBuf>> {
    numbers.iter().map(|number| trial(*number)).collect()
}
