//! Computes the errors of many drives on all cores, with at most one drive per core in memory.

use super::{Common, progress};
use gyronet_tools::evaluate::report::DriveErrors;
use indicatif::ProgressBar;
use std::error::Error;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;
use std::sync::atomic::{AtomicUsize, Ordering};

type Judged = Result<DriveErrors, Box<dyn Error + Send + Sync>>;

/// Judges each file and returns the results in the order of the files. After an error no further file is begun; the
/// error of the first failed file in that order is returned.
pub fn errors(
    files: &[PathBuf],
    common: Common,
    judge: impl Fn(&Path, &ProgressBar) -> Judged + Sync,
) -> Result<Vec<DriveErrors>, Box<dyn Error>> {
    let next = AtomicUsize::new(0);
    let results: Vec<OnceLock<Judged>> = files.iter().map(|_| OnceLock::new()).collect();
    let bars = progress::bars(common);
    let work = || {
        while let Some((file, result)) =
            Some(next.fetch_add(1, Ordering::Relaxed)).and_then(|k| files.get(k).zip(results.get(k)))
        {
            let name = file.file_stem().unwrap_or_default().to_string_lossy();
            let bar = bars.add(progress::bar(common, None, &name));
            bar.tick();
            let judged = judge(file, &bar);
            bar.finish_and_clear();
            if judged.is_err() {
                next.store(files.len(), Ordering::Relaxed);
            }
            // No other thread has this place.
            let _ = result.set(judged);
        }
    };
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    std::thread::scope(|scope| {
        for _ in 0..cores.min(files.len()) {
            scope.spawn(work);
        }
    });
    let judged = results.into_iter().filter_map(OnceLock::into_inner);
    judged.collect::<Result<_, _>>().map_err(|error| -> Box<dyn Error> { error })
}
