//! Fault injection: drives become bytes on the board's lines, faults damage them, and a receiver judges the frames.
//!
//! A [`drive::Drive`] is encoded as the bytes that a [`Part`] and the vehicle's wheels would send. Faults disturb the
//! measurements ([`motion`]) or damage the messages of a line ([`line::Damaged`]). The [`board::Board`] runs the
//! product's coprocessor, and a [`receiver::Receiver`] reads its frames as an ECU would.
//!
//! | word | meaning |
//! |---|---|
//! | reported | a receiver of our own messages (with a fibre-optic gyro, of that gyro's messages) detects the fault: by quality, fault bits, E2E, or silence of 35 ms |
//! | marked good | a complete set of messages with quality good and no fault bit |
//! | moved | difference of the yaw turned in a second that is all marked good from that of the same second of the undamaged drive, by the accumulated yaw on the bus |
//! | limit | the expected error (1 sigma) sent with the last set of that second, but at most [`judge::Limits::moved`] |
//! | undetected | yaw moved by more than the limit before any report of the fault |
//! | harmless | the fault was not reported, and yaw did not move by more than the limit |
//! | bounded | undetected, but nothing can detect it, and yaw moved by no more than [`bounds`] says |

pub mod board;
pub mod bounds;
pub mod drive;
mod encode;
pub mod fault;
pub mod input;
pub mod judge;
pub mod line;
pub mod motion;
pub mod networks;
pub mod receiver;
pub mod report;
pub mod scene;
pub mod soak;

use crate::parallel;
use bounds::undetectable;
use clap::ValueEnum;
use drive::Drive;
use fault::{Fault, Kind, Span};
use gyronet_tools::parts::Part;
use gyronet_tools::random::Random;
use judge::Outcome;
use networks::Networks;
use scene::{STATE_EVERY, Scene};
use std::panic::{AssertUnwindSafe, catch_unwind};

/// A small campaign has this many runs: twelve of each kind alone, and 128 pairs.
pub const QUICK: usize = 320;
/// A run has at most this many rows: 8 s.
const ROWS: usize = 800;
/// A run has [`AFTER`] rows after its faults are over, or [`WITH`] rows with faults that last to the end.
const AFTER: usize = 350;
const WITH: usize = 400;
/// A fault begins after at least this many rows, so that a good second comes first.
const HEALTHY: usize = 101;
/// In a run that starts with static initialisation, a fault begins after at least this many rows.
const HEALTHY_AT_START: usize = 20;
/// One run in this many starts at the beginning of its drive.
const START_EVERY: u64 = 8;
/// [`SINGLE`] of [`OF`] runs have one fault, the others have two.
const OF: usize = 5;
const SINGLE: usize = 3;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Plan {
    pub runs: usize,
    /// The same seed gives the same runs.
    pub seed: u64,
    pub threads: usize,
}

/// One run of a drive with one or two faults.
#[derive(Debug, Clone)]
pub struct Run {
    pub number: usize,
    pub drive: String,
    pub part: Part,
    pub faults: Vec<Fault>,
    /// The outcome, or the message of a panic.
    pub outcome: Result<Outcome, String>,
}

impl Run {
    /// The fault went undetected, but nothing can detect it and yaw moved by no more than its bound.
    pub fn is_bounded(&self) -> bool {
        let bound = undetectable(&self.faults, self.part);
        let undetected = self.outcome.as_ref().ok().filter(|outcome| outcome.is_undetected());
        undetected.zip(bound).is_some_and(|(outcome, bound)| outcome.moved <= bound)
    }

    /// The run panicked, or a fault went undetected beyond its bound.
    pub fn is_failure(&self) -> bool {
        self.outcome.as_ref().map_or(true, Outcome::is_undetected) && !self.is_bounded()
    }
}

/// Runs every drive with every part, undamaged.
pub fn scenes(drives: &[Drive], threads: usize) -> Vec<Scene<'_>> {
    let of: Vec<(&Drive, Part)> =
        drives.iter().flat_map(|drive| Part::ALL.map(|part| (drive, part))).collect();
    on_threads(threads, of.len(), |networks, n| Scene::new(of[n].0, of[n].1, networks))
}

pub fn run(plan: Plan, scenes: &[Scene<'_>]) -> Vec<Run> {
    on_threads(plan.threads, plan.runs, |networks, number| one(plan.seed, number, scenes, networks))
}

fn one(seed: u64, number: usize, scenes: &[Scene<'_>], networks: &mut Networks) -> Run {
    let mut draw = Random::new(seed, number as u64);
    let at = draw.below(scenes.len());
    let scene = &scenes[at];
    let last_state = scene.rows().saturating_sub(ROWS) / STATE_EVERY;
    let at_start = draw.bits().is_multiple_of(START_EVERY);
    let (state, healthy) =
        if at_start { (0, HEALTHY_AT_START) } else { (1 + draw.below(last_state), HEALTHY) };
    let from = (state * STATE_EVERY).min(last_state * STATE_EVERY);
    let mut span = Span { from, to: (from + ROWS).min(scene.rows()), healthy };
    let all = Kind::value_variants();
    let mut kinds = vec![all[number / OF % all.len()]];
    if number % OF >= SINGLE {
        kinds.push(draw.pick(all));
    }
    let faults: Vec<Fault> =
        kinds.iter().map(|kind| Fault::draw(*kind, scene.part, span, &mut draw)).collect();
    if !at_start {
        let to = |fault: &Fault| {
            let end = fault.from + fault.rows;
            if end < span.to { end + AFTER } else { fault.from + WITH }
        };
        span.to = faults.iter().map(to).max().unwrap_or(span.to).min(span.to);
    }
    let outcome = catch_unwind(AssertUnwindSafe(|| scene.run(span, &faults, networks)));
    let outcome = outcome.map_err(|panic| {
        let text = panic.downcast_ref::<String>().cloned();
        text.or_else(|| panic.downcast_ref::<&str>().map(|text| (*text).to_owned())).unwrap_or_default()
    });
    Run { number, drive: scene.drive.name.clone(), part: scene.part, faults, outcome }
}

/// Computes `count` results on several threads, each with its own networks, and returns them in order.
fn on_threads<T: Send>(
    threads: usize,
    count: usize,
    make: impl Fn(&mut Networks, usize) -> T + Sync,
) -> Vec<T> {
    let numbers: Vec<usize> = (0..threads.max(1)).collect();
    let mut columns = parallel::map(&numbers, |first| {
        let mut networks = Networks::default();
        let own = (*first..count).step_by(numbers.len());
        own.map(|n| make(&mut networks, n)).collect::<Vec<T>>().into_iter()
    });
    (0..count).filter_map(|n| columns[n % numbers.len()].next()).collect()
}
