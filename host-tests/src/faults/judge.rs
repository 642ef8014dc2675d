//! The judgement of a run: every second that is marked good, against the undamaged run and against the truth.

use super::receiver::{Reports, Seen};
use gyronet::sample::RATE_HZ;

/// Number of rows over which yaw is compared: a second.
const SECOND: usize = RATE_HZ as usize;
/// Number of rows after a report that are not judged: their rates still compensate for estimates of bad samples.
const PAID: usize = 20;
const RADIANS: f64 = std::f64::consts::TAU / 4_294_967_296.0;

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Limits {
    /// Largest yaw that may move in a second before the first report, whatever expected error is sent, rad. It also
    /// limits a build that states too large an error.
    pub moved: f64,
    /// The largest mean error of a second of an undamaged drive, rad.
    pub mean: f64,
    /// The largest error of a second of an undamaged drive, rad.
    pub largest: f64,
    /// Least and largest share of these errors that may be inside the stated error, if one is stated.
    pub inside_sigma: [f64; 2],
}

impl Limits {
    /// A MEMS part: `moved` is twice the expected error of a rate that the network has not corrected.
    pub const INERTIAL: Self = Self { moved: 5e-4, mean: 5e-4, largest: 2.5e-3, inside_sigma: [0.25, 0.85] };
    /// A fibre-optic gyro, which states no error: `moved` is twice the error of its undamaged drives.
    pub const FIBRE_OPTIC: Self = Self { moved: 1e-4, mean: 1e-4, largest: 2e-4, inside_sigma: [0.0, 1.0] };
}

/// The messages of the undamaged run, row by row.
#[derive(Debug, Clone)]
pub struct Baseline {
    rows: Vec<Row>,
    /// The true yaw at the sample of each row's message, rad.
    truth: Option<Vec<f64>>,
    limits: Limits,
}

#[derive(Debug, Clone, Copy, Default)]
struct Row {
    reports: Reports,
    yaw: Option<i32>,
    sigma: Option<f64>,
    /// Consecutive good rows up to this one.
    good: usize,
}

#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Outcome {
    /// Time from the fault's first effect to the first message, or first missing message, that reports it, s.
    pub reported_after: Option<f64>,
    /// Largest yaw moved in a second that is all marked good, before the first report, rad.
    pub moved: f64,
    /// Largest ratio of the moved yaw to its limit: the smaller of [`Limits::moved`] and the expected error that was
    /// sent with it.
    pub moved_limits: f64,
    /// Largest growth of a good second's error over the same undamaged second, from 0.2 s after the last report on,
    /// rad; without a reference, the largest yaw moved. The yaw itself is not compared there: the windows then begin
    /// at another sample, and two equally good estimates need not be equal.
    pub grown: f64,
    /// Largest ratio of the growth to the limit.
    pub grown_limits: f64,
    /// Largest error against the true yaw in a second all marked good, rad.
    pub error: f64,
    /// Time from the end of the fault to its last report, s; 0 if the last report was earlier.
    pub recovery: f64,
    /// The fault was still reported at the end, though it was over.
    pub not_recovered: bool,
}

impl Outcome {
    pub fn is_undetected(&self) -> bool {
        self.moved_limits > 1.0
    }

    pub fn is_harmless(&self) -> bool {
        self.reported_after.is_none() && !self.is_undetected()
    }
}

/// The errors of the undamaged run against the drive's reference, over whole good seconds.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct AgainstTruth {
    pub seconds: usize,
    /// Mean error of a second, rad.
    pub mean: f64,
    /// Largest error of a second, rad.
    pub largest: f64,
    /// Share of the errors inside the expected error that was sent; `None` where none is sent.
    pub inside_sigma: Option<f64>,
    /// All these errors are within [`Limits`].
    pub in_order: bool,
}

#[derive(Debug, Clone, Copy)]
pub struct Times {
    /// First row of the run.
    pub from: usize,
    /// The time of the fault's first effect, microseconds.
    pub begin: u64,
    /// The time at which the fault is over, or the end of the run if it lasts.
    pub end: u64,
    /// The time at which the run ends.
    pub last: u64,
}

impl Baseline {
    pub fn new(count: usize, seen: &[Seen], truth: Option<Vec<f64>>, limits: Limits) -> Self {
        let mut rows = vec![Row::default(); count];
        for seen in seen {
            let Some(set) = seen.set else { continue };
            let (yaw, sigma, good) = (Some(set.yaw), set.sigma, 0);
            rows[set.row] = Row { reports: seen.reports, yaw, sigma, good };
        }
        let mut good = 0;
        for row in &mut rows {
            good = if row.yaw.is_some() && row.reports.is_nothing() { good + 1 } else { 0 };
            row.good = good;
        }
        Self { rows, truth, limits }
    }

    /// Compares the undamaged run with the truth, second by second; `None` without a truth.
    pub fn against_truth(&self) -> Option<AgainstTruth> {
        let truth = self.truth.as_ref()?;
        let mut found = AgainstTruth::default();
        let (mut stated, mut inside) = (0_usize, 0_usize);
        for row in (SECOND..self.rows.len()).step_by(SECOND) {
            let (now, then) = (&self.rows[row], &self.rows[row - SECOND]);
            let (Some(to), Some(from)) = (now.yaw, then.yaw) else { continue };
            if now.good <= SECOND {
                continue;
            }
            let turned = f64::from(to.wrapping_sub(from)) * RADIANS;
            let error = (turned - (truth[row] - truth[row - SECOND])).abs();
            found.seconds += 1;
            found.mean += error;
            found.largest = found.largest.max(error);
            if let Some(sigma) = now.sigma {
                stated += 1;
                inside += usize::from(error <= sigma);
            }
        }
        found.mean /= found.seconds.max(1) as f64;
        found.inside_sigma = (stated > 0).then(|| inside as f64 / stated as f64);
        let Limits { mean, largest, inside_sigma: [least, most], .. } = self.limits;
        let inside = found.inside_sigma.is_none_or(|share| (least..=most).contains(&share));
        found.in_order = found.mean <= mean && found.largest <= largest && inside;
        Some(found)
    }

    pub fn judge(&self, seen: &[Seen], times: Times) -> Outcome {
        let mut outcome = Outcome::default();
        // The yaw moved up to each row, and the yaw of each row; `None` for a row without a set.
        let mut moved = vec![None; self.rows.len()];
        let mut yaws = vec![None; self.rows.len()];
        let before = times.from.saturating_sub(SECOND + 1)..times.from;
        for row in before {
            moved[row] = (self.rows[row].good > 0).then_some(0);
            yaws[row] = self.rows[row].yaw;
        }
        let mut good = times.from.checked_sub(1).map_or(0, |row| self.rows[row].good);
        let mut last_row = times.from.wrapping_sub(1);
        let (mut last_report, mut report_row) = (None, 0);
        for seen in seen {
            let undamaged = seen.set.map_or(Reports::default(), |set| self.rows[set.row].reports);
            if !seen.reports.beyond(undamaged).is_nothing() && seen.at >= times.begin {
                let after = (seen.at - times.begin) as f64 * 1e-6;
                outcome.reported_after.get_or_insert(after);
                last_report = Some(seen.at);
                report_row = seen.set.map_or(last_row, |set| set.row);
            }
            let Some(set) = seen.set else {
                good = 0;
                continue;
            };
            let connected = set.row == last_row.wrapping_add(1);
            last_row = set.row;
            let base = self.rows[set.row].yaw;
            good = match (seen.reports.is_nothing(), connected) {
                (true, true) => good + 1,
                (true, false) => 1,
                (false, _) => 0,
            };
            moved[set.row] = base.map(|base| set.yaw.wrapping_sub(base));
            yaws[set.row] = Some(set.yaw);
            if good <= SECOND || set.row < SECOND {
                continue;
            }
            let start = set.row - SECOND;
            let error = |yaws: [Option<i32>; 2]| {
                let truth = self.truth.as_ref()?;
                let turned = f64::from(yaws[1]?.wrapping_sub(yaws[0]?)) * RADIANS;
                Some((turned - (truth[set.row] - truth[start])).abs())
            };
            let own = error([yaws[start], Some(set.yaw)]);
            outcome.error = outcome.error.max(own.unwrap_or_default());
            let (Some(now), Some(then)) = (moved[set.row], moved[start]) else { continue };
            let most = self.limits.moved;
            let limit = set.sigma.map_or(most, |sigma| sigma.min(most));
            let by = f64::from(now.wrapping_sub(then)).abs() * RADIANS;
            if outcome.reported_after.is_none() {
                outcome.moved = outcome.moved.max(by);
                outcome.moved_limits = outcome.moved_limits.max(by / limit);
            } else if start >= report_row.saturating_add(PAID) {
                let undamaged = error([self.rows[start].yaw, self.rows[set.row].yaw]);
                let grown =
                    own.zip(undamaged).map_or(by, |(own, undamaged)| (own - undamaged).clamp(0.0, by));
                outcome.grown = outcome.grown.max(grown);
                outcome.grown_limits = outcome.grown_limits.max(grown / limit);
            }
        }
        if let Some(last_report) = last_report {
            outcome.recovery = last_report.saturating_sub(times.end) as f64 * 1e-6;
            // Half a second without a report counts as recovery.
            outcome.not_recovered = times.end < times.last && last_report + 500_000 > times.last;
        }
        outcome
    }
}
