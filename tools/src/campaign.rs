//! These modules inject faults: drives become bytes on the board's lines, faults damage them, and a receiver judges the
//! board's messages.
//!
//! A [`drive::Drive`] is encoded as the bytes that a [`Part`] and the vehicle's wheels would send. Faults disturb the
//! measurements ([`motion`]) or damage bytes on a line ([`wire`]). The [`board::Board`] runs the library's components
//! in the order of the image and converts the bytes to CAN frames. A [`receiver::Receiver`] reads these as an ECU
//! would. The judgement uses only the bytes of these frames, as a vehicle would.
//!
//! | word | meaning |
//! |---|---|
//! | reported | a receiver of our own messages (with a fibre-optic gyro, of that gyro's messages) detects the fault: by quality, fault bits, E2E, or silence of 35 ms |
//! | marked good | a complete set of messages with quality good and no fault bit |
//! | moved | difference of the yaw turned in a second that is all marked good from that of the same second of the undamaged drive, by the accumulated yaw on the bus |
//! | limit | the expected error (1 sigma) sent with the last set of that second, but at most [`judge::Limits::moved`] |
//! | undetected | yaw moved by more than the limit before any report of the fault |
//! | harmless | the fault was not reported, and yaw did not move by more than the limit |
//! | error | difference of the yaw turned in a good second from the drive's reference; without faults it is the error of the method |
//! | recovery | from the end of the fault to the last report |
//!
//! From 0.2 s after the last report on, the error of a good second is compared with that of the same undamaged
//! second. The yaw itself is not compared there: the network's windows then begin at another sample, and two equally
//! good estimates need not be equal.

pub mod board;
pub mod drive;
mod encode;
pub mod exceptions;
pub mod fault;
pub mod input;
pub mod judge;
pub mod motion;
pub mod networks;
pub mod plot;
pub mod receiver;
pub mod report;
pub mod scene;
pub mod soak;
pub mod weight_upsets;
pub mod wire;

use crate::parts::Part;
use crate::random::Random;
use drive::Drive;
use exceptions::{Exception, excepted};
use fault::{Fault, Kind, Span};
use gyronet::model::Blob;
use judge::Outcome;
use networks::Integer;
use scene::{STATE_EVERY, Scene};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

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

/// Describes the size of a campaign.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Plan {
    /// Number of runs.
    pub runs: usize,
    /// Seed of the runs; the same seed gives the same runs.
    pub seed: u64,
    /// Number of threads.
    pub threads: usize,
}

/// Holds one run of a drive with faults.
#[derive(Debug, Clone)]
pub struct Run {
    /// Index of the run in the campaign.
    pub number: usize,
    /// Name of the drive.
    pub drive: String,
    /// The sensor whose bytes the drive is encoded as.
    pub part: Part,
    /// The one or two faults.
    pub faults: Vec<Fault>,
    /// The outcome, or the message of a panic.
    pub outcome: Result<Outcome, String>,
}

impl Run {
    /// Returns the outcome, unless the run panicked.
    #[must_use]
    pub fn outcome(&self) -> Option<&Outcome> {
        self.outcome.as_ref().ok()
    }

    /// Returns the exception that allows the fault to go undetected.
    #[must_use]
    pub fn exception(&self) -> Option<&'static Exception> {
        let outcome = self.outcome().filter(|outcome| outcome.is_undetected())?;
        excepted(&self.faults, self.part, outcome.moved)
    }

    /// Returns whether the run panicked, or a fault went undetected that is not on the list.
    #[must_use]
    pub fn is_failure(&self) -> bool {
        self.outcome().is_none_or(|outcome| outcome.is_undetected() && self.exception().is_none())
    }
}

/// Runs every drive with every part, undamaged.
#[must_use]
pub fn scenes<'d>(
    drives: &'d [Drive],
    blob: &Blob<'_>,
    threads: usize,
    tick: impl Fn() + Sync,
) -> Vec<Scene<'d>> {
    let of: Vec<(&Drive, Part)> =
        drives.iter().flat_map(|drive| Part::ALL.map(|part| (drive, part))).collect();
    on_threads(
        threads,
        of.len(),
        || Integer::new(*blob),
        |networks, n| {
            let (drive, part) = of[n];
            let scene = Scene::new(drive, part, networks);
            tick();
            scene
        },
    )
}

/// Runs the plan and returns the runs in order; `tick` is called after each run.
#[must_use]
pub fn run(plan: Plan, scenes: &[Scene<'_>], blob: &Blob<'_>, tick: impl Fn() + Sync) -> Vec<Run> {
    on_threads(
        plan.threads,
        plan.runs,
        || Integer::new(*blob),
        |networks, number| {
            let run = one(plan.seed, number, scenes, networks);
            tick();
            run
        },
    )
}

fn one(seed: u64, number: usize, scenes: &[Scene<'_>], networks: &mut Integer<'_>) -> Run {
    let mut draw = Random::new(seed, number as u64);
    let at = draw.below(scenes.len());
    let scene = &scenes[at];
    let last_state = scene.rows().saturating_sub(ROWS) / STATE_EVERY;
    let at_start = draw.bits().is_multiple_of(START_EVERY);
    let (state, healthy) =
        if at_start { (0, HEALTHY_AT_START) } else { (1 + draw.below(last_state), HEALTHY) };
    let from = (state * STATE_EVERY).min(last_state * STATE_EVERY);
    let mut span = Span { from, to: (from + ROWS).min(scene.rows()), healthy };
    let kind = Kind::ALL[number / OF % Kind::ALL.len()];
    let mut kinds = vec![kind];
    if number % OF >= SINGLE {
        kinds.push(draw.pick(&Kind::ALL));
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

/// Computes `count` results on several threads, each with its own tool, and returns them in order.
fn on_threads<W, T: Send>(
    threads: usize,
    count: usize,
    tool: impl Fn() -> W + Sync,
    make: impl Fn(&mut W, usize) -> T + Sync,
) -> Vec<T> {
    let (next, done) = (AtomicUsize::new(0), Mutex::new(Vec::with_capacity(count)));
    std::thread::scope(|scope| {
        for _ in 0..threads.max(1) {
            scope.spawn(|| {
                let (mut tool, mut own) = (tool(), Vec::new());
                loop {
                    let n = next.fetch_add(1, Ordering::Relaxed);
                    if n >= count {
                        break;
                    }
                    own.push((n, make(&mut tool, n)));
                }
                // If a thread panicked, `scope` panics too, so the poisoned data are not used.
                done.lock().unwrap_or_else(std::sync::PoisonError::into_inner).append(&mut own);
            });
        }
    });
    let mut done = done.into_inner().unwrap_or_else(std::sync::PoisonError::into_inner);
    done.sort_by_key(|(n, _)| *n);
    done.into_iter().map(|(_, thing)| thing).collect()
}
