//! This module lists the faults that the board cannot detect, each with a bound of its effect.

use super::fault::{Axes, Fault, Kind, Line};
use crate::parts::Part;
use crate::parts::icm42688::WRAP_US;

/// Describes a fault that may go undetected.
#[derive(Debug, Clone, Copy)]
pub struct Exception {
    /// The name in tables.
    pub name: &'static str,
    /// The reason why the fault is not detected, and the bound of its effect.
    pub why: &'static str,
    /// Returns the largest yaw that a fault may move in a second, rad; `None` if the exception does not cover the
    /// fault.
    bound: fn(&Fault, Part) -> Option<f64>,
}

/// A second fault of another kind may change the windows, and thereby the yaw by this, rad.
const MARGIN: f64 = 5e-4;
/// Upper limit of the drives' yaw rate, with a margin, rad/s.
const FASTEST: f64 = 0.7;

/// Lists the exceptions.
pub const EXCEPTIONS: &[Exception] = &[
    Exception {
        name: "bias step of the gyro about z",
        why: "one gyro cannot tell a bias from a turn; at standstill the wheels contradict a step above 0.3 deg/s, and \
              zero-rate updates absorb a smaller one; bound 2.5 times the step",
        bound: |fault, _| {
            (fault.kind == Kind::BiasStep && fault.axes == Axes::One(2))
                .then(|| 2.5 * fault.size.abs() + MARGIN)
        },
    },
    Exception {
        name: "bias step of another axis",
        why: "the network reacts to all six axes with a correction of at most 3 deg/s; bound 0.053 rad",
        bound: |fault, _| (fault.kind == Kind::BiasStep && fault.axes != Axes::One(2)).then_some(0.053),
    },
    Exception {
        name: "clock drift",
        why: "the pipeline integrates with the part's clock alone; bound 0.7 rad/s times the drift",
        bound: |fault, _| {
            (fault.kind == Kind::ClockDrift).then(|| FASTEST * fault.size.abs() * 1e-6 + MARGIN)
        },
    },
    Exception {
        name: "clock jump of less than a sample",
        why: "so small a jump may be jitter, until it has lasted for a second: sent values are older by as much; \
              bound 0.7 rad/s times the jump",
        bound: |fault, part| {
            // An ICM's stamps wrap: a jump by nearly a full wrap is a small jump.
            let wraps = if part == Part::Icm42688 { WRAP_US } else { f64::INFINITY };
            let turns = (fault.size / wraps).round();
            let jump = if turns == 0.0 { fault.size } else { fault.size - turns * wraps };
            (fault.kind == Kind::ClockJump && jump.abs() < 1e4).then(|| FASTEST * jump.abs() * 1e-6 + MARGIN)
        },
    },
    Exception {
        name: "readings stuck for less than 70 ms",
        why: "coarse readings repeat by chance; bound 0.06 s of 0.1 rad/s of vibration",
        bound: |fault, _| (fault.kind == Kind::Stuck && fault.rows <= 7).then_some(6e-3),
    },
    Exception {
        name: "one axis stuck in the first 0.3 s",
        why: "an axis whose readings often repeat, as those of a coarse part at rest, counts as stuck only after 0.3 s",
        bound: |fault, _| (fault.kind == Kind::Stuck && matches!(fault.axes, Axes::One(_))).then_some(0.06),
    },
    Exception {
        name: "a wrong reading with a right checksum",
        why: "an ICM-42688-P has no checksum and an MTi one of 8 bits; a plausible change, up to 1 rad/s in 10 ms, passes",
        bound: |fault, part| {
            let weak = matches!(part, Part::Icm42688 | Part::Xsens);
            let damaged = matches!(fault.kind, Kind::BitFlip | Kind::Burst | Kind::Truncation);
            (weak && damaged && fault.line == Line::Sensor).then_some(0.05)
        },
    },
    Exception {
        name: "messages a few milliseconds late",
        why: "standstill is detected a sample or two sooner or later, and the rate is zero from then on",
        bound: |fault, _| {
            let late = matches!(fault.kind, Kind::Reordering | Kind::Stall) || fault.line == Line::Wheels;
            (fault.kind.is_on_a_line() && late).then_some(1e-3)
        },
    },
    Exception {
        name: "wheels that turn while the vehicle stands",
        why: "the rate is then not held at zero, and has the error of a moving vehicle's rate",
        bound: |fault, _| (fault.kind == Kind::WheelSlip && fault.size > 0.0).then_some(1e-3),
    },
    Exception {
        name: "wheels locked in a turn of less than 0.3 deg/s",
        why: "so slow a turn may be bias; the angle held at zero is added when the wheels turn again",
        bound: |fault, _| (fault.kind == Kind::WheelSlip && fault.size == 0.0).then_some(6e-3),
    },
];

/// Returns the exception that covers the yaw moved by a run's faults. The errors of two faults add up: if no single
/// exception covers them, their bounds are added, and the exception with the larger bound is returned.
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
