//! Shows progress bars on stderr if that is a terminal.

use super::Common;
use indicatif::{MultiProgress, ProgressBar, ProgressDrawTarget, ProgressState, ProgressStyle};
use std::fmt::Write;
use std::time::Duration;

fn target(common: Common) -> ProgressDrawTarget {
    if common.quiet { ProgressDrawTarget::hidden() } else { ProgressDrawTarget::stderr() }
}

/// Returns a group of bars, one below the other, for the [`bar`]s of several threads.
pub fn bars(common: Common) -> MultiProgress {
    MultiProgress::with_draw_target(target(common))
}

/// Returns a bar with a length in samples, if that is known yet; it is invisible with `--quiet` and without a terminal.
pub fn bar(common: Common, samples: impl Into<Option<usize>>, doing: &str) -> ProgressBar {
    let style = ProgressStyle::with_template("{msg} [{bar:40}] {percent}% {left}");
    // A pace is known after a second of work.
    let left = |state: &ProgressState, out: &mut dyn Write| {
        let is_known = state.pos() > 0 && state.elapsed() > Duration::from_secs(1);
        let _ =
            if is_known { write!(out, "{} s left", state.eta().as_secs()) } else { write!(out, "starting") };
    };
    let style = style.unwrap_or_else(|_| ProgressStyle::default_bar()).with_key("left", left);
    let bar = ProgressBar::with_draw_target(samples.into().map(|count| count as u64), target(common))
        .with_style(style.progress_chars("=> "));
    bar.with_message(doing.to_owned())
}
