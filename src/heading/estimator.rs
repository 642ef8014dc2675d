//! Learns bias and gain of the yaw gyro from a course while the vehicle drives, and holds the heading without one.
//!
//! Courses measure the states of `filter`, which the zero-rate updates share, so that a bias has one value and one
//! variance. A course is the direction of travel, some time ago, with errors that last for seconds. So
//!
//! - it is weighed by its accuracy, its speed and the rate: straight compared with straight counts, a turn shows the
//!   lag;
//! - courses that follow each other within [`CORRELATION`] count as one;
//! - the gain is learnt only where the vehicle turns both ways: in a steady circle a growing slip looks like a gain;
//! - a course far from the expected heading is refused, and one at some distance has bounded influence. After
//!   [`PATIENCE`] without a match the heading starts again from the course; bias and gain are again those of the
//!   newest course that matched well after [`CALM`], unless the vehicle has stood since. Where two such times show
//!   the same drift, the bias becomes uncertain by it. A refused course leaves those after it only the heading to teach:
//!   for a while before the bias is known ([`COST`]), then until all have matched for [`CALM`]. Courses that keep failing
//!   teach only the heading until they have matched for [`TRUST`];
//! - after a halt, and at low speed, a course may have jumped by half a turn, because the vehicle goes backwards.

use super::filter::{BIAS, Filter, GAIN, HEADING, LAG, Measured, wrap};
use super::gain::MAX_GAIN;
use super::turns::{BLOCK, BLOCK_SECONDS, Turns};
use super::{Gain, Heading};
use crate::health::count;
use crate::health::slow::Knowledge;
use crate::sample::RATE_HZ;
use crate::sqrt::sqrt;
use crate::units::AngularRate;
use core::f32::consts::PI;

/// Settings of the learning.
#[derive(Debug, Clone, Copy)]
pub struct CourseConfig {
    /// Slowest speed with a course whose accuracy is not stated, m/s.
    pub slowest: f32,
    /// Accuracy of a course, 1 sigma, besides what the receiver says: slip, wind and the crown of the road, rad.
    pub accuracy: f32,
    /// Accuracy of the speed across the direction of travel, where the receiver says nothing, m/s.
    pub across: f32,
    /// Error of a course in a turn, rad per rad/s, besides the lag's.
    pub turning: f32,
    /// Random walks of the course against the heading (rad) and of the lag (s), per square root of a second.
    pub walks: [f32; 2],
    /// How much the bias at rest and the bias on the road may differ, because the road shakes the sensor, rad/s.
    pub driving: f32,
    /// Gain of a part before anything is learnt, 1 sigma; 0: it is not learnt.
    pub gain: f32,
}

impl CourseConfig {
    /// A road vehicle with a GNSS receiver.
    pub const DEFAULT: Self = Self {
        slowest: 3.0,
        accuracy: 0.02,
        across: 0.1,
        turning: 0.1,
        walks: [2e-3, 0.02],
        driving: 3e-4,
        gain: 0.005,
    };

    /// Returns the accuracy of a course, 1 sigma, rad; `None` where it teaches nothing, because the vehicle is too slow or it
    /// is too inaccurate. Below [`Self::slowest`] it must be stated, and as good as one at that speed that states nothing.
    pub fn sigma(&self, heading: &Heading) -> Option<f32> {
        let (_, speed) = heading.course.zip(heading.speed)?;
        let stated = heading.course_sigma.or(heading.speed_sigma.map(|across| across / speed));
        if speed >= self.slowest {
            Some(stated.unwrap_or(self.across / speed)).filter(|sigma| *sigma < INACCURATE)
        } else {
            let sigma = stated?.max(LEAST_ACROSS / speed);
            (sigma <= self.across / self.slowest).then_some(sigma)
        }
    }
}

/// Errors of a course last so long, s.
const CORRELATION: f32 = 1.0;
/// Innovation over its sigma from which a course has no more influence, and from which it is refused.
const BOUNDED: f32 = 2.0;
const REFUSED: f32 = 4.0;
/// The same of one that matches well.
const WELL: f32 = 1.0;
/// Time without a course that matches before the heading starts again, samples.
const PATIENCE: u32 = 10 * RATE_HZ;
/// Time with courses that match after which failures are forgotten, samples; and so many failures are too many.
const TRUST: u32 = 60 * RATE_HZ;
const FAILURES: u8 = 3;
/// Samples with matching courses only, after which courses teach the bias again once one was refused: reflections off houses
/// last for seconds, and the courses that match by chance meanwhile are off to the same side.
const CALM: u32 = 10 * RATE_HZ;
/// Before the bias is known, a refused course suspends its learning for this many times the interval of the courses.
const COST: u32 = 2;
/// Drift of the heading by a wrong bias, rad/s, where one is noticed, rad, and how alike two are: a share, rad/s.
const DRIFT: core::ops::Range<f32> = 2e-3..0.03;
const NOTICED: f32 = 0.3;
const ALIKE: [f32; 2] = [0.25, 2e-3];
/// Time without a course after which it may have turned by half a turn, samples.
const HALT: u32 = 3 * RATE_HZ / 2;
const ROUND: f32 = 2.6;
/// Lag before it is estimated, its sigma, and its bounds, s.
const FIRST_LAG: [f32; 2] = [0.3, 0.3];
const LAGS: [f32; 2] = [-0.5, 2.0];
/// The turn over which left and right are remembered, the least of each, and the least share of either, rad.
const REMEMBERED: f32 = 12.0;
const BOTH_WAYS: [f32; 2] = [1.0, 0.2];
/// Turn during which a course that does not change has failed, rad.
const STANDS: f32 = 0.05;
/// A course this inaccurate, rad, teaches nothing; the best accuracy of a speed across that is believed, m/s.
const INACCURATE: f32 = 0.2;
const LEAST_ACROSS: f32 = 0.01;
/// Longest gap that is bridged by the mean of the rates around it, samples.
pub(crate) const BRIDGED: u32 = RATE_HZ / 5;
/// Fewest courses with which a vehicle starts in motion.
const FEW: u32 = 5;
/// Sigma of the bias with which a rate can be used, and with which it is as good as after a standstill, rad/s.
const COARSE_BIAS: f32 = 2e-3;
pub(crate) const FINE_BIAS: f32 = 5e-4;
/// The same of the gain.
const COARSE_GAIN: f32 = 0.003;
const FINE_GAIN: f32 = 0.0015;

/// The reason why a course teaches nothing.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Refusal {
    /// It is far from the heading that the gyro shows.
    Jump = 1,
    /// It does not change in a turn.
    Stands = 2,
    /// The vehicle stands.
    Standstill = 3,
    /// The receiver computed the course with sensors of its own.
    Reckoned = 4,
}

/// A course that has arrived: its tick, direction to the left, speed and accuracy.
#[derive(Debug, Clone, Copy)]
struct Arrived {
    tick: u32,
    course: f32,
    speed: f32,
    sigma: f32,
}

#[derive(Debug, Clone, Copy)]
struct Failing {
    /// Tick and distance of the first one after one that matched.
    since: Option<(u32, f32)>,
    /// Drift of the heading when it last started again, rad/s.
    drift: Option<f32>,
    /// Times in a row that the heading started again, and the tick of the newest one.
    times: u8,
    trusted: u32,
    /// Samples with courses that matched since the newest refusal; each course counts for one second at most.
    calm: u32,
    /// Courses have matched for most of [`TRUST`]: courses that drift away later are false, and the bias is right.
    is_confirmed: bool,
    /// Samples with matching courses for which the learning of a bias that is not known yet is still suspended.
    owed: u32,
    /// Bias and gain with their variances, before the courses that may be false: the newest, and those of [`CALM`] before
    /// it or more, because false ones may match at first. Then the tick of the newest.
    before: [Option<[f32; 4]>; 2],
    kept: u32,
}

impl Failing {
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
}

/// Counters of courses since the start.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize, serde::Deserialize)]
pub struct CourseCounters {
    /// Courses that were used.
    pub used: u32,
    /// Courses that were refused.
    pub refused: u32,
    /// Times that the heading started again.
    pub restarts: u32,
}

/// What courses have shown since the start.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CourseState {
    /// Counters.
    pub counters: CourseCounters,
    /// True while courses contradict the gyro: for 10 s none has matched, and since then they have not for a minute.
    pub is_contradicted: bool,
    /// True while a source of courses is configured and sends none.
    pub is_silent: bool,
    /// Why the newest course taught nothing; `None` where it was used.
    pub refusal: Option<Refusal>,
    /// The gain, once it is estimated.
    pub gain: Option<Gain>,
}

impl CourseState {
    /// Before the first course.
    pub const START: Self = Self {
        counters: CourseCounters { used: 0, refused: 0, restarts: 0 },
        is_contradicted: false,
        is_silent: false,
        refusal: None,
        gain: None,
    };
}

/// Learns from courses.
#[derive(Debug, Clone)]
pub struct Estimator {
    config: CourseConfig,
    turns: Turns,
    /// Tick and rate of the newest sample in the turns.
    tick: u32,
    rate: AngularRate,
    waiting: Option<Arrived>,
    newest: Option<f32>,
    unchanged: f32,
    /// Ticks of the newest course, and of the newest one that was used, once the heading is known.
    last: Option<u32>,
    used: Option<u32>,
    ways: [f32; 2],
    learns_gain: bool,
    is_backwards: bool,
    failing: Failing,
    refusal: Option<Refusal>,
    counters: CourseCounters,
}

impl Estimator {
    /// Creates it before the first course.
    pub const fn new(config: CourseConfig) -> Self {
        Self {
            config,
            turns: Turns::EMPTY,
            tick: 0,
            rate: AngularRate::ZERO,
            waiting: None,
            newest: None,
            unchanged: 0.0,
            last: None,
            used: None,
            ways: [0.0; 2],
            learns_gain: false,
            is_backwards: false,
            failing: Failing {
                since: None,
                drift: None,
                times: 0,
                trusted: 0,
                calm: CALM,
                owed: 0,
                is_confirmed: false,
                before: [None; 2],
                kept: 0,
            },
            refusal: None,
            counters: CourseState::START.counters,
        }
    }

    /// Takes a course that arrives after the sample of a tick. It is used once that sample's rate is final; one that
    /// arrives meanwhile is left out, and so is one without direction or speed, too slow or too inaccurate.
    pub fn arrived(&mut self, heading: &Heading, tick: u32) {
        let Heading { course: Some(course), speed: Some(speed), .. } = *heading else { return };
        if self.waiting.is_none()
            && let Some(sigma) = self.config.sigma(heading)
        {
            // Counted clockwise by receivers.
            self.waiting = Some(Arrived { tick, course: wrap(-course), speed, sigma });
        }
    }

    /// Adds a rate less the known bias; `None` where it may hide a turn. `stands` is true at a standstill.
    pub(crate) fn add(&mut self, filter: &mut Filter, tick: u32, rate: Option<AngularRate>, stands: bool) {
        let Some(rate) = rate else { return self.restart() };
        let missing = tick.wrapping_sub(core::mem::replace(&mut self.tick, tick)).wrapping_sub(1);
        let between = AngularRate(core::mem::replace(&mut self.rate, rate).0.midpoint(rate.0));
        let mut has_ended = false;
        if missing > BRIDGED {
            self.restart();
        } else if missing > 0 {
            let half = (rate.0 - between.0) as f32 / AngularRate::PER_RAD_PER_SEC;
            let half = half * missing as f32 / RATE_HZ as f32;
            filter.put_variance::<HEADING>(filter.variance::<HEADING>() + half * half);
            (0..missing).for_each(|_| has_ended |= self.advance(filter, between, stands));
        }
        if !(has_ended | self.advance(filter, rate, stands)) {
            return;
        }
        if let Some(arrived) = self.waiting.take_if(|arrived| tick.wrapping_sub(arrived.tick) < u32::MAX / 2)
        {
            match self.take(filter, &arrived, stands) {
                Ok(()) => {
                    self.refusal = None;
                    count(&mut self.counters.used, 1);
                }
                Err(refusal) => self.refuse(refusal),
            }
        }
    }

    pub(crate) fn refuse(&mut self, why: Refusal) {
        self.refusal = Some(why);
        count(&mut self.counters.refused, 1);
    }

    /// Starts the heading again, because a turn may have been missed.
    pub(crate) fn restart(&mut self) {
        (self.turns, self.used, self.waiting) = (Turns::EMPTY, None, None);
    }

    /// Adds the turn of a sample; returns whether a block has ended.
    fn advance(&mut self, filter: &mut Filter, rate: AngularRate, stands: bool) -> bool {
        let Some(turned) = self.turns.add(rate) else { return false };
        if self.used.is_some() {
            self.walk(filter, turned, stands);
        }
        true
    }

    fn walk(&mut self, filter: &mut Filter, turned: f32, stands: bool) {
        let [heading, lag] = self.config.walks.map(|walk| walk * walk * BLOCK_SECONDS);
        filter.turn(turned, BLOCK_SECONDS, stands);
        if stands {
            self.failing.before = [None; 2];
        }
        filter.put_variance::<LAG>((filter.variance::<LAG>() + lag).min(1.0));
        filter.put_variance::<HEADING>(filter.variance::<HEADING>() + heading);
        let driven = turned - filter.get::<BIAS>() * BLOCK_SECONDS;
        let kept = 1.0 - (libm::fabsf(driven) / REMEMBERED).min(1.0);
        let [left, right] = &mut self.ways;
        *left = (*left + driven.max(0.0)) * kept;
        *right = (*right - driven.min(0.0)) * kept;
        let (less, both) = (left.min(*right), *left + *right);
        let [least, share] = BOTH_WAYS;
        self.learns_gain = less >= least && less >= share * both;
        self.unchanged += driven;
    }

    fn take(&mut self, filter: &mut Filter, arrived: &Arrived, stands: bool) -> Result<(), Refusal> {
        if self.newest.replace(arrived.course) != Some(arrived.course) {
            self.unchanged = 0.0;
        }
        if stands {
            return Err(Refusal::Standstill);
        }
        if libm::fabsf(self.unchanged) > STANDS {
            return Err(Refusal::Stands);
        }
        if filter.variance::<LAG>() == 0.0 {
            let [lag, sigma] = FIRST_LAG;
            filter.restart::<LAG>(lag, sigma * sigma);
            // Earlier drives may have shown it.
            if filter.variance::<GAIN>() == 0.0 {
                filter.restart::<GAIN>(0.0, self.config.gain * self.config.gain);
            }
            let driving = self.config.driving;
            filter.put_variance::<BIAS>(filter.variance::<BIAS>() + driving * driving);
            self.failing.before = [Some(learnt(filter)); 2];
        }
        let paused = self.last.map_or(u32::MAX, |last| arrived.tick.wrapping_sub(last));
        self.last = Some(arrived.tick);
        let age = self.tick.wrapping_sub(arrived.tick) as f32 / BLOCK as f32;
        let back = age + filter.get::<LAG>() / BLOCK_SECONDS;
        // The first seconds are too short for a lag.
        let Some((since, rate)) = self.turns.since(back) else { return Ok(()) };
        let CourseConfig { slowest, accuracy, turning, .. } = self.config;
        let own = accuracy * accuracy + arrived.sigma * arrived.sigma + turning * turning * rate * rate;
        let interval = (paused as f32 / RATE_HZ as f32).max(BLOCK_SECONDS);
        let variance = own * (CORRELATION / interval).max(1.0);
        let half = if self.is_backwards { PI } else { 0.0 };
        let off = wrap(arrived.course + since + half - filter.get::<HEADING>());
        let start = |filter: &mut Filter| {
            filter.restart::<HEADING>(
                wrap(arrived.course + since),
                variance + rate * rate * filter.variance::<LAG>(),
            );
        };
        if self.used.is_none() {
            start(filter);
            (self.used, self.is_backwards) = (Some(arrived.tick), false);
            return Ok(());
        }
        let turns_round = (paused > HALT || arrived.speed < slowest) && libm::fabsf(off) > ROUND;
        self.is_backwards ^= turns_round;
        let off = if turns_round { wrap(off + PI) } else { off };
        let mut measured = Measured { off, rate, variance };
        let innovation = filter.innovation(&measured);
        let ratio = libm::fabsf(off) / sqrt(innovation);
        if ratio.is_nan() || ratio > REFUSED {
            self.failing.is_confirmed |= self.failing.calm >= TRUST;
            self.failing.calm = 0;
            self.failing.owed = (self.failing.owed + COST * paused.min(RATE_HZ)).min(CALM);
            let (since, _) = *self.failing.since.get_or_insert((arrived.tick, off));
            if arrived.tick.wrapping_sub(since) > PATIENCE {
                if let Some([bias, bias_variance, gain, gain_variance]) = self.failing.before[1].take() {
                    filter.restart::<BIAS>(bias, bias_variance);
                    filter.restart::<GAIN>(gain, gain_variance);
                }
                let drift = self.failing.start(arrived.tick, off);
                if let Some(drift) = drift.filter(|_| !self.failing.is_confirmed) {
                    filter.put_variance::<BIAS>(filter.variance::<BIAS>() + drift * drift);
                    self.failing = Failing { times: 0, drift: None, ..self.failing };
                }
                start(filter);
                (self.used, self.is_backwards) = (Some(arrived.tick), false);
                count(&mut self.counters.restarts, 1);
            }
            return Err(Refusal::Jump);
        }
        measured.variance += innovation * (ratio / BOUNDED - 1.0).max(0.0);
        if arrived.tick.wrapping_sub(self.failing.trusted) > TRUST {
            self.failing = Failing { times: 0, drift: None, ..self.failing };
        }
        self.failing.since = None;
        // After the heading has started again, false courses that drift match for a while.
        if self.failing.times == 0 || ratio < WELL {
            self.failing.calm = self.failing.calm.saturating_add(paused.min(RATE_HZ));
        }
        let is_calm = self.failing.calm >= CALM;
        // A bias that is not known yet has less to lose, and a start in motion waits for it.
        let is_known = filter.variance::<BIAS>() <= FINE_BIAS * FINE_BIAS;
        let holds = if is_known { !is_calm } else { self.failing.owed > 0 };
        self.failing.owed = self.failing.owed.saturating_sub(paused.min(RATE_HZ));
        let has_failed = self.failing.times >= FAILURES;
        filter.course(&measured, [has_failed || holds, has_failed || !is_calm || !self.learns_gain]);
        let [least, most] = LAGS;
        filter.put::<LAG>(filter.get::<LAG>().max(least).min(most));
        filter.put::<GAIN>(filter.get::<GAIN>().clamp(-MAX_GAIN, MAX_GAIN));
        self.used = Some(arrived.tick);
        if ratio < WELL && is_calm && arrived.tick.wrapping_sub(self.failing.kept) >= CALM {
            let now = Some(learnt(filter));
            self.failing.before = [now, self.failing.before[0].or(now)];
            self.failing.kept = arrived.tick;
        }
        Ok(())
    }

    pub(crate) fn has_begun(&self) -> bool {
        self.used.is_some()
    }

    /// Drops the bias that is kept for a return: the start in motion has subtracted it from the readings.
    pub(crate) fn refer(&mut self) {
        self.failing.before = [None; 2];
    }

    /// Returns whether the bias is known well enough to use the rate.
    pub(crate) fn is_usable(&self, filter: &Filter) -> bool {
        self.has_begun() && self.counters.used >= FEW && sqrt(filter.variance::<BIAS>()) <= COARSE_BIAS
    }

    /// Returns what courses have shown, without the gain.
    pub fn state(&self) -> CourseState {
        let Self { counters, refusal, failing, .. } = *self;
        CourseState { counters, refusal, is_contradicted: failing.times > 0, ..CourseState::START }
    }
}

fn learnt(filter: &Filter) -> [f32; 4] {
    [filter.get::<BIAS>(), filter.variance::<BIAS>(), filter.get::<GAIN>(), filter.variance::<GAIN>()]
}

pub(crate) fn gain_knowledge(sigma: f32) -> Knowledge {
    match sigma {
        fine if fine <= FINE_GAIN => Knowledge::Fine,
        coarse if coarse <= COARSE_GAIN => Knowledge::Coarse,
        _ => Knowledge::Unknown,
    }
}
