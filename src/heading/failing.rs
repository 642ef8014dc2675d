//! False courses: how they are noticed, and what they may teach.
//!
//! Among houses, or where a receiver is deceived, courses are off for seconds or minutes, and some match by chance. So
//!
//! - those after a refused one teach only heading and lag: for a while before the bias is known ([`COST`]), then until all have
//!   matched for [`CALM`];
//! - those that are off to one side on average ([`SIDE`]) teach only heading and lag, once others have confirmed the bias: one
//!   that drifts slowly never is far from the heading, which follows it. After [`SUSPENDED`] the gyro itself may have
//!   changed, and the bias becomes coarse;
//! - after [`PATIENCE`] without a match the heading starts again from the course; bias and gain are again those of the
//!   newest course that matched well after [`CALM`], unless the vehicle has stood since. Where two such times show the
//!   same drift, the bias becomes uncertain by it; where it was confirmed, only after [`MANY`] such times in a row;
//! - courses that keep failing teach only heading and lag until they have matched for [`TRUST`].

use super::filter::{BIAS, COARSE_BIAS, Filter, GAIN, wrap};
use crate::sample::RATE_HZ;
use core::ops::Range;

/// Time without a course that matches before the heading starts again, samples.
pub(super) const PATIENCE: u32 = 10 * RATE_HZ;
/// Time with courses that match after which failures are forgotten, samples; and so many failures are too many.
const TRUST: u32 = 60 * RATE_HZ;
const FAILURES: u8 = 3;
/// Samples with matching courses only, after which courses teach the bias again once one was refused: reflections off houses
/// last for seconds, and the courses that match by chance meanwhile are off to the same side.
const CALM: u32 = 10 * RATE_HZ;
/// Before the bias is known, a refused course suspends its learning for this many times the interval of the courses.
const COST: u32 = 2;
/// Distance of the courses over its sigma, on average over so many seconds with courses, from which they are off to one side;
/// and samples of it, not necessarily in a row, after which the bias becomes coarse.
const SIDE: f32 = 0.8;
const SIDE_SECONDS: f32 = 15.0;
const SUSPENDED: u32 = 2 * TRUST;
/// Times in a row that the heading started again, which take as long: courses match for a while after each.
const MANY: u8 = (SUSPENDED / PATIENCE / 2) as u8;
/// Distance over its sigma up to which a course matches well.
const WELL: f32 = 1.0;
/// Drift of the heading by a wrong bias, rad/s, where one is noticed, rad, and how alike two are: a share, rad/s.
const DRIFT: Range<f32> = 2e-3..0.03;
const NOTICED: f32 = 0.3;
const ALIKE: [f32; 2] = [0.25, 2e-3];

/// A course that was not refused.
#[derive(Debug, Clone, Copy)]
pub(super) struct Match {
    pub tick: u32,
    /// Samples since the course before it, at most one second.
    pub paused: u32,
    /// Its distance over its sigma; and the same with its sign, bounded, as if all courses of a second were one.
    pub ratio: f32,
    pub side: f32,
    /// It is neither too slow nor too late to teach a known bias.
    pub can_teach: bool,
}

/// What the courses since the start have shown of each other.
#[derive(Debug, Clone, Copy)]
pub(super) struct Failing {
    /// Tick and distance of the first one after one that matched.
    since: Option<(u32, f32)>,
    /// Drift of the heading when it last started again, rad/s.
    drift: Option<f32>,
    /// Times in a row that the heading started again, and the tick of the newest one.
    times: u8,
    trusted: u32,
    /// Samples with courses that matched since the newest one that was refused or off to one side.
    calm: u32,
    /// Mean of [`Match::side`], whether it was to the left when it was large last, and the samples for which it has been large
    /// since the newest calm.
    side: f32,
    is_left: bool,
    suspended: u32,
    /// True if the bias has become coarse since the estimator was last asked.
    pub became_coarse: bool,
    /// Courses have matched for [`TRUST`] with a known bias. Courses that drift away later are taken for false until
    /// [`SUSPENDED`].
    is_confirmed: bool,
    /// Samples with matching courses for which the learning of a bias that is not known yet is still suspended.
    owed: u32,
    /// Bias and gain with their variances, before the courses that may be false: the newest, and those of [`CALM`] before
    /// it or more, because false ones may match at first. Then the tick of the newest.
    before: [Option<[f32; 4]>; 2],
    kept: u32,
}

impl Failing {
    pub const NONE: Self = Self {
        since: None,
        drift: None,
        times: 0,
        trusted: 0,
        calm: CALM,
        side: 0.0,
        is_left: false,
        suspended: 0,
        became_coarse: false,
        is_confirmed: false,
        owed: 0,
        before: [None; 2],
        kept: 0,
    };

    /// Takes a refused course at this distance, rad; returns true where the heading starts again from it.
    pub fn refused(&mut self, filter: &mut Filter, tick: u32, off: f32, paused: u32) -> bool {
        self.calm = 0;
        self.owed = (self.owed + COST * paused).min(CALM);
        let (since, _) = *self.since.get_or_insert((tick, off));
        if tick.wrapping_sub(since) <= PATIENCE {
            return false;
        }
        let [_, before] = core::mem::take(&mut self.before);
        if let Some([bias, bias_variance, gain, gain_variance]) = before {
            filter.restart::<BIAS>(bias, bias_variance);
            filter.restart::<GAIN>(gain, gain_variance);
        }
        self.forget_side();
        let drift = self.start(tick, off);
        if let Some(drift) = drift.filter(|_| !self.is_confirmed || self.times >= MANY) {
            filter.put_variance::<BIAS>(filter.variance::<BIAS>() + drift * drift);
            (self.times, self.drift, self.became_coarse) = (0, None, true);
        }
        true
    }

    /// Notes that the heading starts again at this distance; returns the drift that two such times share, rad/s.
    fn start(&mut self, tick: u32, off: f32) -> Option<f32> {
        let (since, first) = self.since.take()?;
        let drift = wrap(off - first) * RATE_HZ as f32 / tick.wrapping_sub(since).max(1) as f32;
        (self.times, self.trusted) = (self.times.saturating_add(1), tick);
        let before = core::mem::replace(&mut self.drift, (libm::fabsf(first) < NOTICED).then_some(drift))?;
        let drift = self.drift?;
        let [share, least] = ALIKE;
        let is_alike = libm::fabsf(drift - before) < share * libm::fabsf(drift) + least;
        (is_alike && DRIFT.contains(&libm::fabsf(drift))).then_some(drift)
    }

    /// Takes one that matches; returns whether it teaches the bias, and the gain. `is_known` is true of a known bias.
    pub fn matched(&mut self, filter: &mut Filter, new: &Match, is_known: bool) -> [bool; 2] {
        if new.tick.wrapping_sub(self.trusted) > TRUST {
            (self.times, self.drift) = (0, None);
        }
        self.since = None;
        // After the heading has started again, false courses that drift match for a while.
        if self.times == 0 || new.ratio < WELL {
            self.calm = self.calm.saturating_add(new.paused);
        }
        if new.can_teach {
            self.judge_side(filter, new);
            self.is_confirmed |= is_known && self.calm >= TRUST && libm::fabsf(self.side) <= SIDE;
        }
        let is_calm = self.calm >= CALM;
        if is_calm || !self.is_confirmed {
            self.suspended = 0;
        }
        // A bias that is not known yet has less to lose, and a start in motion waits for it.
        let is_held = is_known || self.suspended > 0;
        let teaches = self.times < FAILURES && if is_held { is_calm } else { self.owed == 0 };
        self.owed = self.owed.saturating_sub(new.paused);
        [teaches, self.times < FAILURES && is_calm]
    }

    fn judge_side(&mut self, filter: &mut Filter, new: &Match) {
        let seconds = new.paused as f32 / RATE_HZ as f32;
        self.side += (new.side - self.side) * seconds / (SIDE_SECONDS + seconds);
        if !self.is_confirmed || libm::fabsf(self.side) <= SIDE {
            return;
        }
        self.calm = 0;
        if core::mem::replace(&mut self.is_left, self.side > 0.0) != self.is_left {
            self.suspended = 0;
        }
        self.suspended += new.paused;
        if self.suspended > SUSPENDED {
            filter.put_variance::<BIAS>(filter.variance::<BIAS>() + COARSE_BIAS * COARSE_BIAS);
            self.begin(filter);
            (self.is_confirmed, self.became_coarse) = (false, true);
        }
    }

    /// Keeps bias and gain after a course that matched.
    pub fn keep(&mut self, filter: &Filter, new: &Match) {
        if new.ratio < WELL && self.calm >= CALM && new.tick.wrapping_sub(self.kept) >= CALM {
            let now = Some(learnt(filter));
            self.before = [now, self.before[0].or(now)];
            self.kept = new.tick;
        }
    }

    /// Notes bias and gain before the first course, or once what was kept before no longer holds.
    pub fn begin(&mut self, filter: &Filter) {
        self.before = [Some(learnt(filter)); 2];
    }

    /// Adds a variance to that of the bias kept for a return, (rad/s)^2.
    pub fn widen(&mut self, variance: f32) {
        self.before.iter_mut().flatten().for_each(|[_, own, ..]| *own += variance);
    }

    /// Drops bias and gain that are kept for a return, because the bias has been measured meanwhile.
    pub fn forget(&mut self) {
        self.before = [None; 2];
        self.forget_side();
    }

    /// Forgets the side of the courses before, because the heading starts again or they are old.
    pub fn forget_side(&mut self) {
        (self.side, self.suspended) = (0.0, 0);
    }

    /// Returns whether courses contradict the gyro.
    pub const fn contradicts(&self) -> bool {
        self.times > 0 || self.suspended >= CALM
    }
}

fn learnt(filter: &Filter) -> [f32; 4] {
    [filter.get::<BIAS>(), filter.variance::<BIAS>(), filter.get::<GAIN>(), filter.variance::<GAIN>()]
}
