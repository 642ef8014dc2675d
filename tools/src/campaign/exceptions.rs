//! This module lists the faults that nothing on the board can detect, each with a bound of its effect.

use super::fault::{Axes, Fault, Kind, Line};
use crate::parts::Part;
use crate::parts::icm42688::WRAP_US;

/// Describes a fault that may go undetected.
#[derive(Debug, Clone, Copy)]
pub struct Exception {
    /// The name in tables.
    pub name: &'static str,
    /// The reason why nothing detects it, and what bounds it.
    pub why: &'static str,
    /// The most that a fault of this kind may move yaw in a second, rad; `None` where it is not
    /// of this kind.
    bound: fn(&Fault, Part) -> Option<f64>,
}

/// A fault of another kind beside it may change the windows, and with them the yaw by this, rad.
const MARGIN: f64 = 5e-4;
/// The drives turn no faster than this, rad/s, with a margin.
const FASTEST: f64 = 0.7;

/// Lists the exceptions.
pub const EXCEPTIONS: &[Exception] = &[
    Exception {
        name: "bias step of the gyro about z",
        why: "one gyro cannot tell a bias from a turn; at standstill the wheels contradict one above 0.3 deg/s, and \
              the zero-rate updates take a smaller one; bound 2.5 times the step",
        bound: |fault, _| {
            (fault.kind == Kind::BiasStep && fault.axes == Axes::One(2))
                .then(|| 2.5 * fault.size.abs() + MARGIN)
        },
    },
    Exception {
        name: "bias step of another axis",
        why: "the network sees all six axes and answers with a correction, of at most 3 deg/s; bound 0.053 rad",
        bound: |fault, _| (fault.kind == Kind::BiasStep && fault.axes != Axes::One(2)).then_some(0.053),
    },
    Exception {
        name: "clock drift",
        why: "the part's clock is the only one that the pipeline integrates by; bound 0.7 rad/s times the drift",
        bound: |fault, _| {
            (fault.kind == Kind::ClockDrift).then(|| FASTEST * fault.size.abs() * 1e-6 + MARGIN)
        },
    },
    Exception {
        name: "clock jump of less than a sample",
        why: "a stamp that is so much earlier may be jitter: what is sent is as much older, until a second of it \
              shows; bound 0.7 rad/s times the jump",
        bound: |fault, part| {
            // An ICM's stamps wrap: a jump by nearly a whole wrap is a small one.
            let wraps = if part == Part::Icm42688 { WRAP_US } else { f64::INFINITY };
            let turns = (fault.size / wraps).round();
            let jump = if turns == 0.0 { fault.size } else { fault.size - turns * wraps };
            (fault.kind == Kind::ClockJump && jump.abs() < 1e4).then(|| FASTEST * jump.abs() * 1e-6 + MARGIN)
        },
    },
    Exception {
        name: "readings stuck for less than 70 ms",
        why: "coarse readings repeat themselves by chance; bound 0.06 s of 0.1 rad/s of vibration",
        bound: |fault, _| (fault.kind == Kind::Stuck && fault.rows <= 7).then_some(6e-3),
    },
    Exception {
        name: "one axis stuck in the first 0.3 s",
        why: "an axis that often repeats itself, as a coarse part at rest, is stuck after 0.3 s only",
        bound: |fault, _| (fault.kind == Kind::Stuck && matches!(fault.axes, Axes::One(_))).then_some(0.06),
    },
    Exception {
        name: "a wrong reading with a right checksum",
        why: "an ICM-42688-P has none and an MTi one of 8 bits; what a vehicle can do in 10 ms, 1 rad/s, passes",
        bound: |fault, part| {
            let weak = matches!(part, Part::Icm42688 | Part::Xsens);
            let damaged = matches!(fault.kind, Kind::BitFlip | Kind::Burst | Kind::Truncation);
            (weak && damaged && fault.line == Line::Sensor).then_some(0.05)
        },
    },
    Exception {
        name: "messages a few milliseconds late",
        why: "the vehicle is known to stand a sample or two sooner or later, and its rate zero from there on",
        bound: |fault, _| {
            let late = matches!(fault.kind, Kind::Reordering | Kind::Stall) || fault.line == Line::Wheels;
            (fault.kind.is_on_a_line() && late).then_some(1e-3)
        },
    },
    Exception {
        name: "wheels that turn while the vehicle stands",
        why: "the rate is then not held at zero, and off by what a moving vehicle's is",
        bound: |fault, _| (fault.kind == Kind::WheelSlip && fault.size > 0.0).then_some(1e-3),
    },
    Exception {
        name: "wheels locked in a turn of less than 0.3 deg/s",
        why: "so slow a turn may be bias; what was held at zero is given back when the wheels turn again",
        bound: |fault, _| (fault.kind == Kind::WheelSlip && fault.size == 0.0).then_some(6e-3),
    },
];

/// Returns the exception that covers the yaw moved by a run's faults. Errors of a pair add up: if no exception alone
/// covers it, its faults may move yaw by the sum of their bounds, and the wider one's name is given.
#[must_use]
pub fn excepted(faults: &[Fault], part: Part, moved: f64) -> Option<&'static Exception> {
    let covers = |exception: &&Exception| {
        let bounds: Vec<f64> = faults.iter().filter_map(|fault| (exception.bound)(fault, part)).collect();
        !bounds.is_empty() && moved <= bounds.iter().sum()
    };
    EXCEPTIONS.iter().find(covers).or_else(|| {
        let wider = |one: &(_, f64), other: &(_, f64)| one.1.total_cmp(&other.1);
        let widest = |fault| {
            let bounds = EXCEPTIONS.iter().filter_map(|named| Some((named, (named.bound)(fault, part)?)));
            bounds.max_by(wider)
        };
        let named: Vec<(&Exception, f64)> = faults.iter().filter_map(widest).collect();
        let bound: f64 = named.iter().map(|(_, bound)| bound).sum();
        let (exception, _) = named.into_iter().max_by(wider)?;
        (moved <= bound).then_some(exception)
    })
}
