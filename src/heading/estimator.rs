//! Learns bias and gain of the yaw gyro from a course while the vehicle drives, and holds the heading without one.
//!
//! Courses measure the states of `filter`, which the zero-rate updates share, so that a bias has one value and one
//! variance. A course is the direction of travel, some time ago, with errors that last for seconds. So
//!
//! - it is weighed by its accuracy, its speed and the rate: straight compared with straight counts, a turn shows the
//!   lag;
//! - courses that follow each other within [`CORRELATION`] count as one;
//! - the gain is learnt only where the vehicle turns both ways: in a steady circle a growing slip looks like a gain; and
//!   only by courses on a straight, because during a turn a course that is smoothed, early or a trailer's is off as if by
//!   a gain. Once the gain can be learnt ([`SETTLED`]), courses between two straights teach bias and lag, but hardly move
//!   the heading, so that the next straight still shows by how much the gyro misread the turn;
//! - a course whose lag is known and at its bounds ([`LAGS`]) teaches only heading and lag;
//! - a course far from the expected heading is refused, and one at some distance has bounded influence. What else shows
//!   false ones is in `failing`;
//! - after a halt, and at low speed, a course may have jumped by half a turn, because the vehicle goes backwards.

use super::course_config::CourseConfig;
use super::failing::{Failing, Match, PATIENCE};
use super::filter::{BIAS, COARSE_BIAS, FINE_BIAS, Filter, GAIN, HEADING, LAG, Measured, wrap};
use super::gain::MAX_GAIN;
use super::turns::{BLOCK, BLOCK_SECONDS, Turns};
use super::{Gain, Heading};
use crate::health::count;
use crate::health::slow::Knowledge;
use crate::sample::RATE_HZ;
use crate::sqrt::sqrt;
use crate::units::AngularRate;
use core::f32::consts::PI;

/// Errors of a course last so long, s.
const CORRELATION: f32 = 1.0;
/// Innovation over its sigma from which a course has no more influence, and from which it is refused.
const BOUNDED: f32 = 2.0;
const REFUSED: f32 = 4.0;
/// Rate below which a vehicle goes straight, rad/s, and the blocks of it, 2 s, after which a course shows the gain.
const STRAIGHT: f32 = 0.05;
const STRAIGHT_BLOCKS: f32 = 20.0;
/// Sigma of the bias that would be left if the gain were known, up to which the gain is learnt, rad/s; and the weight with
/// which a course between straights then moves the heading.
const SETTLED: f32 = 2.8e-4;
const BETWEEN: f32 = 1.0 / 16.0;
/// Time without a course after which it may have turned by half a turn, samples.
const HALT: u32 = 3 * RATE_HZ / 2;
const ROUND: f32 = 2.6;
/// Lag before it is estimated, its sigma, and its bounds, s.
const FIRST_LAG: [f32; 2] = [0.3, 0.3];
const LAGS: [f32; 2] = [-0.5, 2.3];
/// Sigma of a lag that is known, s: on a straight it is not, and does not matter.
const KNOWN_LAG: f32 = 0.25;
/// The turn over which left and right are remembered, the least of each, and the least share of either, rad.
const REMEMBERED: f32 = 12.0;
const BOTH_WAYS: [f32; 2] = [1.0, 0.2];
/// Turn during which a course that does not change has failed, rad.
const STANDS: f32 = 0.05;
/// Speed below which a course of unknown accuracy teaches neither a known bias nor the gain, m/s: there a reflection that
/// moves the position by 0.3 m/s turns the course by several degrees, for many seconds.
const SLOW: f32 = 4.0;
/// Longest gap that is bridged by the mean of the rates around it, samples.
pub(crate) const BRIDGED: u32 = RATE_HZ / 5;
/// Fewest courses with which a vehicle starts in motion.
const FEW: u32 = 5;
/// Sigma of the gain from which it is coarse, and from which it is fine.
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
    is_stated: bool,
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
    /// True while courses contradict the gyro: for 10 s none has matched, and since then they have not for a minute; or they
    /// have been off to one side for 10 s, and have not matched for 10 s since.
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
    /// Blocks in a row in which the vehicle has gone straight.
    straight: u32,
    is_backwards: bool,
    failing: Failing,
    /// True if a course has taught the bias since the last [`Self::take_has_taught`].
    has_taught: bool,
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
            straight: 0,
            is_backwards: false,
            failing: Failing::NONE,
            has_taught: false,
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
            let is_stated = heading.course_sigma.or(heading.speed_sigma).is_some();
            self.waiting = Some(Arrived { tick, course: wrap(-course), speed, sigma, is_stated });
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
        (self.turns, self.used, self.waiting, self.straight) = (Turns::EMPTY, None, None, 0);
        self.failing.forget_side();
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
            self.failing.forget();
        }
        filter.put_variance::<LAG>((filter.variance::<LAG>() + lag).min(FIRST_LAG[1] * FIRST_LAG[1]));
        filter.put_variance::<HEADING>(filter.variance::<HEADING>() + heading);
        let driven = turned - filter.get::<BIAS>() * BLOCK_SECONDS;
        let is_straight = libm::fabsf(driven) < STRAIGHT * BLOCK_SECONDS && !stands;
        self.straight = if is_straight { self.straight.saturating_add(1) } else { 0 };
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
            self.failing.begin(filter);
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
            if self.failing.refused(filter, arrived.tick, off, paused.min(RATE_HZ)) {
                start(filter);
                (self.used, self.is_backwards) = (Some(arrived.tick), false);
                count(&mut self.counters.restarts, 1);
            }
            return Err(Refusal::Jump);
        }
        measured.variance += innovation * (ratio / BOUNDED - 1.0).max(0.0);
        if paused > PATIENCE {
            self.failing.forget_side();
        }
        let side = off / sqrt((innovation - variance).max(0.0) + own);
        let side = side.clamp(-BOUNDED, BOUNDED);
        let is_known = filter.variance::<BIAS>() <= FINE_BIAS * FINE_BIAS;
        let is_clear = arrived.is_stated || arrived.speed >= SLOW;
        let is_straight = self.straight as f32 >= STRAIGHT_BLOCKS + back;
        let [least, most] = LAGS;
        let lag = filter.get::<LAG>();
        let is_in_time = lag > least && lag < most || filter.variance::<LAG>() > KNOWN_LAG * KNOWN_LAG;
        let can_teach = is_in_time && is_clear;
        let new = Match { tick: arrived.tick, paused: paused.min(RATE_HZ), ratio, side, can_teach };
        let [teaches_bias, teaches_gain] = self.failing.matched(filter, &new, is_known);
        let teaches_bias = teaches_bias && is_in_time && (is_clear || !is_known);
        let learns_gain = self.learns_gain && filter.bias_beside_gain() <= SETTLED * SETTLED;
        let teaches_gain = teaches_gain && can_teach && learns_gain && is_straight;
        let weight = if learns_gain && !is_straight { BETWEEN } else { 1.0 };
        self.has_taught |= teaches_bias;
        filter.course(&measured, [!teaches_bias, !teaches_gain], weight);
        filter.put::<LAG>(filter.get::<LAG>().max(least).min(most));
        filter.put::<GAIN>(filter.get::<GAIN>().clamp(-MAX_GAIN, MAX_GAIN));
        self.used = Some(arrived.tick);
        self.failing.keep(filter, &new);
        Ok(())
    }

    /// Returns whether a course has taught the bias since the last call.
    pub(crate) const fn take_has_taught(&mut self) -> bool {
        core::mem::replace(&mut self.has_taught, false)
    }

    /// Adds the variance of the bias's change with temperature to that of the bias kept for a return, (rad/s)^2.
    pub(crate) fn widen(&mut self, variance: f32) {
        self.failing.widen(variance);
    }

    /// Returns whether courses that contradict the bias have made it coarse since the last call.
    pub(crate) const fn take_became_coarse(&mut self) -> bool {
        core::mem::replace(&mut self.failing.became_coarse, false)
    }

    pub(crate) fn has_begun(&self) -> bool {
        self.used.is_some()
    }

    /// Drops the bias that is kept for a return: the start in motion has subtracted it from the readings.
    pub(crate) fn refer(&mut self) {
        self.failing.forget();
    }

    /// Returns whether the bias is known well enough to use the rate.
    pub(crate) fn is_usable(&self, filter: &Filter) -> bool {
        self.has_begun() && self.counters.used >= FEW && sqrt(filter.variance::<BIAS>()) <= COARSE_BIAS
    }

    /// Returns what courses have shown, without the gain.
    pub fn state(&self) -> CourseState {
        let Self { counters, refusal, failing, .. } = *self;
        CourseState { counters, refusal, is_contradicted: failing.contradicts(), ..CourseState::START }
    }
}

pub(crate) fn gain_knowledge(sigma: f32) -> Knowledge {
    match sigma {
        fine if fine <= FINE_GAIN => Knowledge::Fine,
        coarse if coarse <= COARSE_GAIN => Knowledge::Coarse,
        _ => Knowledge::Unknown,
    }
}
