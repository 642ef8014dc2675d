//! Summarises a sequence's files and counts the skipped rows.

use serde::Serialize;
use std::fmt;
use std::path::Path;

/// A gap is longer than this many nominal periods.
const GAP_PERIODS: f64 = 2.5;
/// A file that ends earlier than this is remarked, s.
pub(super) const EARLY_S: f64 = 1.0;

/// Returns a time in s; stamps are nanoseconds since 1970.
pub(super) fn seconds(stamps: i64) -> f64 {
    stamps as f64 / 1e9
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
pub struct Seen {
    pub count: u64,
    pub first_line: Option<u64>,
}

impl Seen {
    pub(super) fn count(&mut self, line: u64) {
        self.count += 1;
        self.first_line.get_or_insert(line);
    }
}

#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct StreamSummary {
    pub file: String,
    pub rows: u64,
    pub rate_hz: f64,
    /// Number of times that two stamps are more than 2.5 nominal periods apart.
    pub gaps: u64,
    pub longest_gap_s: f64,
    /// Rows skipped because they repeat the stamp of the previous row.
    pub duplicates: Seen,
    /// Rows skipped because a field is NaN or infinite.
    pub not_finite: Seen,
    /// The last line if it lacks its end: half a number looks like a whole one.
    pub cut: Seen,
    /// Encoder resets; the wheels were assumed to keep their speed.
    pub resets: Seen,
    /// Time from its end to that of the file that ends last, s.
    pub ends_early_s: f64,
    #[serde(skip)]
    clock: Clock,
}

#[derive(Debug, Clone, Copy, PartialEq, Default)]
struct Clock {
    nominal_hz: f64,
    first: Option<i64>,
    last: i64,
}

impl StreamSummary {
    pub(crate) fn new(path: &Path, nominal_hz: f64) -> Self {
        Self {
            file: path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default(),
            clock: Clock { nominal_hz, ..Clock::default() },
            ..Self::default()
        }
    }

    pub(super) fn row(&mut self, stamp: i64) {
        self.rows += 1;
        let clock = &mut self.clock;
        let Some(first) = clock.first else {
            (clock.first, clock.last) = (Some(stamp), stamp);
            return;
        };
        let silence = seconds(stamp - clock.last);
        clock.last = stamp;
        self.rate_hz = (self.rows - 1) as f64 / seconds(stamp - first);
        self.gaps += u64::from(silence * clock.nominal_hz > GAP_PERIODS);
        self.longest_gap_s = self.longest_gap_s.max(silence);
    }
}

/// Compares the ends of files whose stamps are of one clock.
pub(super) fn compare_ends(files: &mut [StreamSummary; 4]) {
    let end = |file: &StreamSummary| seconds(file.clock.last);
    let last = files.iter().map(end).fold(0.0, f64::max);
    for file in files {
        file.ends_early_s = last - end(file);
    }
}

impl fmt::Display for StreamSummary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:<24}{:>9} rows {:>8.2} Hz", self.file, self.rows, self.rate_hz)?;
        write!(f, "  {} gaps, longest {:.1} ms", self.gaps, self.longest_gap_s * 1e3)?;
        for (seen, what) in [
            (self.duplicates, "duplicate stamps skipped"),
            (self.not_finite, "rows with NaN skipped"),
            (self.cut, "last line skipped, which is cut"),
            (self.resets, "encoder resets bridged"),
        ] {
            if let Some(line) = seen.first_line {
                write!(f, ", {} {what} (first: line {line})", seen.count)?;
            }
        }
        if self.ends_early_s > EARLY_S {
            write!(f, ", ends {:.1} s before the others: is it whole?", self.ends_early_s)?;
        }
        Ok(())
    }
}
