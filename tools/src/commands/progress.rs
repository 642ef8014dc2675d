//! Shows progress bars on stderr if that is a terminal.

use super::Common;
use indicatif::{MultiProgress, ProgressBar, ProgressDrawTarget, ProgressStyle};

fn target(common: Common) -> ProgressDrawTarget {
    if common.quiet { ProgressDrawTarget::hidden() } else { ProgressDrawTarget::stderr() }
}

/// Returns a group of bars, one below the other, for the [`bar`]s of several threads.
pub fn bars(common: Common) -> MultiProgress {
    MultiProgress::with_draw_target(target(common))
}

/// Returns a bar with a length in samples; it is invisible with `--quiet` and without a terminal.
pub fn bar(common: Common, samples: usize, doing: &str) -> ProgressBar {
    let style = ProgressStyle::with_template("{msg} [{bar:40}] {percent}% {eta}");
    let bar = ProgressBar::with_draw_target(Some(samples as u64), target(common))
        .with_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()).progress_chars("=> "));
    bar.set_message(doing.to_owned());
    bar
}
