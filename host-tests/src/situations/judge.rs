//! The judgement of a ride: what the bus said, against the truth.
//!
//! | letter | what | promise |
//! |---|---|---|
//! | s | a second whose sets are all good | its yaw is off by at most four of the largest expected errors that it sent |
//! | y | a span between two good sets, with anything between them | its yaw is off by at most four times the sum, over its seconds, of the largest expected error that each sent, unless the count of gaps changes by a second later |
//! | d | the last minute before a slow status, between two good sets | its yaw is off by at most four times the doubt of the status, gaps or not |
//! | t | a status that says "stands" | the vehicle's speed over ground is below 0.3 m/s, but for half a second in all |
//! | g | the time in all | good for the share that the situation allows |
//! | m | the last seconds | good, or a fault, a contradiction or the state of the bias says why not |
//!
//! The board steps every millisecond and states a sample's age in half milliseconds, so the time of a sample is known
//! to 1.5 ms, and the yaw of a span to that time by the change of the rate. A [`Reference`] may be worse.

use super::receiver::{Receiver, Set, Slow};
use super::ride::Travelled;

pub const HEADING: &str = "situation                                        vehicle  seconds  good  in 1 sigma: straight, \
    turning  worst second    span  minute  what is wrong";
/// Expected errors by which yaw may be off.
const SIGMAS: f64 = 4.0;
/// Age of the newest sample in a set, s, and the time of a doubt, s.
const AGE: f64 = 0.2;
const MINUTE: f64 = 60.0;
/// Angle of a second in a turn, rad.
const TURNS: f64 = 0.03;
/// Lengths of the spans, s.
const SPANS: [f64; 5] = [2.0, 5.0, 15.0, 45.0, 135.0];
/// A span begins at every so many sets of 10 ms.
const EVERY: f64 = 0.25;
/// Seconds that may be off by chance: one in fifteen thousand.
const CHANCE: usize = 15_000;
/// Speed that is no standstill, m/s, and time for which it may count as one, s.
const MOVES: f64 = 0.3;
const MAY_STAND: f64 = 0.5;
/// Seconds at the end in which the state must have a reason.
const LAST: f64 = 5.0;

/// The errors of the truth, 1 sigma: of any difference of headings, rad, and with time, rad/s; and that of its times, s.
#[derive(Debug, Clone, Copy)]
pub struct Reference {
    pub noise: f64,
    pub drift: f64,
    pub timing: f64,
}

/// A simulation's truth: a sample's time is known to 1.5 ms.
pub const EXACT: Reference = Reference { noise: 0.0, drift: 0.0, timing: 1.5e-3 };

/// How many of the seconds looked at are inside one expected error.
#[derive(Debug, Clone, Copy, Default)]
pub struct Share {
    inside: usize,
    all: usize,
}

impl Share {
    fn add(&mut self, inside: bool) {
        self.inside += usize::from(inside);
        self.all += 1;
    }

    fn percent(&self) -> f64 {
        100.0 * self.inside as f64 / self.all.max(1) as f64
    }
}

/// The errors of a kind: how many are more than was allowed, and the worst one, over what was.
#[derive(Debug, Clone, Copy, Default)]
pub struct Errors {
    pub wrong: usize,
    pub ratio: f64,
    /// Its time, s; the error, rad.
    at: f64,
    error: f64,
}

impl Errors {
    fn add(&mut self, at: f64, error: f64, allowed: f64) {
        self.join(Self {
            wrong: usize::from(error.abs() > allowed),
            ratio: error.abs() / allowed,
            at,
            error,
        });
    }

    fn join(&mut self, other: Self) {
        let wrong = self.wrong + other.wrong;
        *self = Self { wrong, ..if other.ratio > self.ratio { other } else { *self } };
    }

    /// The worst one in sigma and deg, and its time, s.
    fn worst(self) -> (f64, f64, f64) {
        (SIGMAS * self.ratio, self.error.to_degrees(), self.at)
    }
}

#[derive(Debug, Clone, Default)]
pub struct Outcome {
    /// Seconds in all, and those good throughout.
    pub seconds: usize,
    pub good: usize,
    /// Least share of them that must be good.
    pub least: f64,
    /// Good seconds inside one expected error, straight on and in turns.
    pub inside: [Share; 2],
    /// Errors of good seconds, spans, and minutes.
    pub second: Errors,
    pub span: Errors,
    pub minute: Errors,
    /// Time for which a moving vehicle was said to stand, s.
    pub stood: f64,
    /// The last seconds are not good, and nothing says why.
    pub is_mute: bool,
}

impl Outcome {
    pub fn add(&mut self, other: &Self) {
        self.seconds += other.seconds;
        self.good += other.good;
        self.least = self.least.max(other.least);
        for (share, other) in self.inside.iter_mut().zip(other.inside) {
            share.inside += other.inside;
            share.all += other.all;
        }
        self.second.join(other.second);
        self.span.join(other.span);
        self.minute.join(other.minute);
        self.stood = self.stood.max(other.stood);
        self.is_mute |= other.is_mute;
    }

    /// The broken promises, each with a letter and in words.
    pub fn broken(&self) -> Vec<(char, String)> {
        let mut broken = Vec::new();
        let wrong = self.second.wrong;
        if wrong > self.good / CHANCE {
            let (sigma, error, at) = self.second.worst();
            let text = format!("{wrong} good seconds off, {sigma:.1} sigma ({error:.2} deg) at {at:.0} s");
            broken.push(('s', text));
        }
        if self.span.wrong > 0 {
            let (sigma, error, at) = self.span.worst();
            broken.push(('y', format!("yaw off by {error:.2} deg, {sigma:.1} sigma, from {at:.0} s")));
        }
        if self.minute.wrong > 0 {
            let (sigma, error, at) = self.minute.worst();
            let text = format!("a minute off by {error:.2} deg, {sigma:.1} of its doubt, at {at:.0} s");
            broken.push(('d', text));
        }
        if self.stood > MAY_STAND {
            broken.push(('t', format!("stands for {:.0} s of motion", self.stood)));
        }
        let share = self.good as f64 / self.seconds as f64;
        if share < self.least {
            broken.push(('g', format!("good for {:.0} % of the time", 100.0 * share)));
        }
        if self.is_mute {
            broken.push(('m', "not good at the end, without a reason".to_owned()));
        }
        broken
    }

    /// A line of the table; the worst errors are in sigma.
    pub fn line(&self, situation: &str, vehicle: &str) -> String {
        let broken: Vec<String> = self.broken().into_iter().map(|(_, text)| text).collect();
        let [straight, turning] = self.inside.map(|share| share.percent());
        let [second, span, minute] = [self.second, self.span, self.minute].map(|errors| errors.worst().0);
        format!(
            "{situation:48} {vehicle:7} {:8} {:3.0} % {straight:19.0} % {turning:6.0} % {second:13.1} {span:7.1} \
             {minute:7.1}  {}\n",
            self.seconds,
            100.0 * self.good as f64 / self.seconds as f64,
            broken.join("; "),
        )
    }
}

/// Judges what a receiver has collected from a start of the board to this time.
pub fn judge(received: &Receiver, truth: &Travelled, end: f64, reference: &Reference) -> Outcome {
    let sets = &received.sets;
    let mut outcome = Outcome::default();
    let errors: Vec<f64> = sets.iter().map(|set| set.yaw - truth.heading(set.sampled)).collect();
    let last_good = runs(sets);
    let slack = |from: &Set, to: &Set| {
        let Reference { noise, drift, timing } = reference;
        let change = (truth.rate(to.sampled) - truth.rate(from.sampled)).abs();
        timing * change + SIGMAS * (noise + drift * (to.sampled - from.sampled))
    };
    let mut next = f64::NEG_INFINITY;
    for (from, set) in sets.iter().enumerate().filter(|(_, set)| set.is_good()) {
        if set.sampled < next {
            continue;
        }
        next = set.sampled + EVERY;
        let to = sets.partition_point(|later| later.sampled < set.sampled + 1.0 - 1e-6);
        if to < sets.len() && last_good[from] >= to {
            let sigma = sets[from..=to].iter().filter_map(|set| set.sigma).fold(0.0, f64::max);
            let off = errors[to] - errors[from];
            let allowed = SIGMAS * sigma + slack(set, &sets[to]);
            outcome.second.add(set.sampled, off, allowed);
            outcome.good += 1;
            let turns = (truth.heading(set.sampled + 1.0) - truth.heading(set.sampled)).abs() > TURNS;
            // The expected error of a sample is that of the second that ends with it.
            let inside = sets[to].sigma.unwrap_or(sigma) + (allowed / SIGMAS - sigma);
            outcome.inside[usize::from(turns)].add(off.abs() <= inside);
        }
        for length in SPANS {
            let to = sets.partition_point(|later| later.sampled < set.sampled + length);
            let Some(end) = sets.get(to).filter(|end| end.is_good()) else { continue };
            let Some(seen) = between(&received.slow, set.sampled, end.sampled + 1.5) else { continue };
            if seen.windows(2).any(|pair| pair[0].gaps != pair[1].gaps) {
                continue;
            }
            let allowed = SIGMAS * sum_of_seconds(&sets[from..=to]) + slack(set, end);
            let off = errors[to] - errors[from];
            outcome.span.add(set.sampled, off, allowed);
        }
    }
    for slow in &received.slow {
        let Some(doubt) = slow.doubt else { continue };
        let to = sets.partition_point(|set| set.sampled <= slow.at - AGE);
        let from = sets.partition_point(|set| set.sampled < slow.at - AGE - MINUTE);
        let minute = sets.get(from..to).unwrap_or(&[]);
        let Some(from) = minute.iter().position(Set::is_good).map(|at| from + at) else { continue };
        if !sets[to - 1].is_good() {
            continue;
        }
        let allowed = SIGMAS * doubt + slack(&sets[from], &sets[to - 1]);
        let off = errors[to - 1] - errors[from];
        outcome.minute.add(slow.at, off, allowed);
    }
    // Four looks a second.
    outcome.good /= 4;
    outcome.second.wrong = outcome.second.wrong.div_ceil(4);
    for pair in received.slow.windows(2).filter(|pair| pair[0].stands && pair[1].stands) {
        let moving = truth.speed(pair[0].at).abs().min(truth.speed(pair[1].at).abs()) > MOVES;
        outcome.stood += if moving { pair[1].at - pair[0].at } else { 0.0 };
    }
    let end = end - LAST;
    let last: Vec<&Set> = sets.iter().filter(|set| set.sampled > end).collect();
    let explained = last.iter().any(|set| set.is_good() || set.faults != 0);
    outcome.is_mute = !explained
        && !received.slow.iter().any(|slow| slow.at > end && (slow.contradicted || slow.doubted_bias));
    outcome
}

/// The sum over seconds, back from the last set, of the largest expected error that each has sent, rad. Where none is sent,
/// nothing is allowed.
fn sum_of_seconds(sets: &[Set]) -> f64 {
    let (mut rest, mut sum) = (sets, 0.0);
    while let [_, .., last] = rest {
        let begin = rest.partition_point(|set| set.sampled < last.sampled - 1.0 + 1e-6);
        let (before, second) = rest.split_at(begin);
        sum += second.iter().filter_map(|set| set.sigma).fold(0.0, f64::max);
        rest = before;
    }
    sum
}

/// The last set of the good ones in a row from each set on.
fn runs(sets: &[Set]) -> Vec<usize> {
    let mut last = vec![0; sets.len()];
    for (at, set) in sets.iter().enumerate().rev() {
        let goes_on =
            sets.get(at + 1).is_some_and(|next| next.is_good() && next.sampled - set.sampled < 0.25);
        last[at] = if goes_on { last[at + 1] } else { at };
    }
    last
}

/// The statuses from the last one before a time to another time; `None` where there is none before.
fn between(slow: &[Slow], from: f64, to: f64) -> Option<&[Slow]> {
    let at = |time: f64| slow.partition_point(|slow| slow.at <= time);
    slow.get(at(from).checked_sub(1)?..at(to))
}
