//! How far yaw may move in a second by faults that the board cannot detect.

use super::fault::{Axes, Fault, Kind, Line};
use gyronet_tools::parts::Part;
use gyronet_tools::parts::icm42688::WRAP_US;

/// A second fault of another kind may change the windows, and thereby the yaw by this, rad.
const MARGIN: f64 = 5e-4;
/// Upper limit of the drives' yaw rate, with a margin, rad/s.
const FASTEST: f64 = 0.7;

/// The sum of the faults' bounds, rad; `None` if all of them must be detected.
pub fn undetectable(faults: &[Fault], part: Part) -> Option<f64> {
    faults.iter().filter_map(|fault| bound(fault, part)).reduce(|one, other| one + other)
}

/// The bound of one fault, rad, with the reason why nothing detects it.
fn bound(fault: &Fault, part: Part) -> Option<f64> {
    let size = fault.size.abs();
    let of_kind = match fault.kind {
        // One gyro cannot tell a bias from a turn. At standstill the wheels contradict a step above 0.3 deg/s, and
        // zero-rate updates absorb a smaller one.
        Kind::BiasStep if fault.axes == Axes::One(2) => Some(2.5 * size + MARGIN),
        // The network reacts to all six axes with a correction of at most 3 deg/s.
        Kind::BiasStep => Some(0.053),
        // The pipeline integrates with the part's clock alone.
        Kind::ClockDrift => Some(FASTEST * size * 1e-6 + MARGIN),
        // A jump of less than a sample may be jitter, until it has lasted for a second.
        Kind::ClockJump => {
            // An ICM's stamps wrap: a jump by nearly a full wrap is a small jump.
            let turns = if part == Part::Icm42688 { (fault.size / WRAP_US).round() } else { 0.0 };
            let jump = (fault.size - turns * WRAP_US).abs();
            (jump < 1e4).then_some(FASTEST * jump * 1e-6 + MARGIN)
        }
        // An axis whose readings often repeat, as those of a coarse part at rest, counts as stuck after 0.3 s.
        Kind::Stuck if matches!(fault.axes, Axes::One(_)) => Some(0.06),
        // Coarse readings repeat by chance: 0.06 s of 0.1 rad/s of vibration.
        Kind::Stuck if fault.rows <= 7 => Some(6e-3),
        // An ICM-42688-P has no checksum and an MTi one of 8 bits: a plausible change, up to 1 rad/s in 10 ms, passes.
        Kind::BitFlip | Kind::Burst | Kind::Truncation if fault.line == Line::Sensor => {
            matches!(part, Part::Icm42688 | Part::Xsens).then_some(0.05)
        }
        // The rate is then not held at zero, and has the error of a moving vehicle's rate.
        Kind::WheelSlip if fault.size > 0.0 => Some(1e-3),
        // So slow a turn, less than 0.3 deg/s, may be bias; the angle held at zero is added when the wheels turn again.
        Kind::WheelSlip => Some(6e-3),
        _ => None,
    };
    // Standstill is detected a sample or two sooner or later, and the rate is zero from then on.
    let late = matches!(fault.kind, Kind::Reordering | Kind::Stall) || fault.line == Line::Wheels;
    of_kind.or((fault.kind.is_on_a_line() && late).then_some(1e-3))
}
