//! Kinds of faults, and faults drawn from a seed.

use gyronet_tools::parts::Part;
use gyronet_tools::random::Random;

#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum Kind {
    /// Messages are lost.
    Drop,
    /// Messages are sent twice.
    Duplicate,
    /// One bit of a message is wrong.
    BitFlip,
    /// A series of bytes is replaced by noise, which does not stop at the end of a message.
    Burst,
    /// The end of a message is lost.
    Truncation,
    /// Later messages of a line overtake a message.
    Reordering,
    /// The line is silent for a while; then all its messages arrive at once, or are lost.
    Stall,
    /// The part's clock, and with it its sampling, is too fast or too slow.
    ClockDrift,
    /// The part's clock jumps.
    ClockJump,
    /// Readings do not change.
    Stuck,
    /// Readings are saturated.
    Saturation,
    /// A constant is added to a reading.
    BiasStep,
    /// The part sends a value that is not a valid number.
    NotANumber,
    /// Wheels spin, or are locked.
    WheelSlip,
    /// The speeds of wheels are swapped.
    SwappedWheels,
    /// The bus fails: no wheel speeds are received, or no frames are sent.
    CanLoss,
}

impl Kind {
    /// The fault damages bytes on a line rather than the measurements.
    pub const fn is_on_a_line(self) -> bool {
        use Kind::{BitFlip, Burst, CanLoss, Drop, Duplicate, Reordering, Stall, Truncation};
        matches!(self, Drop | Duplicate | BitFlip | Burst | Truncation | Reordering | Stall | CanLoss)
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Line {
    /// The inertial sensor's.
    Sensor,
    /// The fibre-optic gyro's.
    Gyro,
    /// Incoming wheel speeds, SLCAN.
    Wheels,
    /// Outgoing frames, SLCAN.
    Out,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Axes {
    All,
    Gyro,
    /// 0 to 2 are gyro x, y, z; 3 to 5 are accelerometer x, y, z.
    One(usize),
}

impl Axes {
    pub fn contains(self, axis: usize) -> bool {
        match self {
            Self::All => true,
            Self::Gyro => axis < 3,
            Self::One(one) => one == axis,
        }
    }
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Fault {
    pub kind: Kind,
    /// The line that a fault on a line affects.
    pub line: Line,
    /// First affected row of the drive.
    pub from: usize,
    pub rows: usize,
    /// Share of the messages that the fault hits.
    pub share: f64,
    /// Microseconds of a clock jump, ppm of a drift, rad/s or m/s^2 of a bias, bytes of a burst, messages that
    /// overtake a late one, factor on the wheels' speed.
    pub size: f64,
    pub axes: Axes,
    /// One of four forms of the same kind; the code that applies the fault says which.
    pub form: usize,
    /// The seed of everything that is drawn while the fault lasts.
    pub seed: u64,
}

/// The rows of a drive that a run covers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Span {
    pub from: usize,
    /// The row after the last one.
    pub to: usize,
    /// Rows before which no fault begins.
    pub healthy: usize,
}

impl Fault {
    pub fn draw(kind: Kind, part: Part, span: Span, draw: &mut Random) -> Self {
        let lines: &[Line] = match (kind, part) {
            (Kind::CanLoss, _) => &[Line::Wheels, Line::Out],
            // Every second fault is on the line of the part itself.
            (_, Part::Dsp1760) => &[Line::Gyro, Line::Gyro, Line::Sensor, Line::Wheels, Line::Out],
            _ => &[Line::Sensor, Line::Sensor, Line::Wheels, Line::Out],
        };
        let mut fault = Self {
            kind,
            line: draw.pick(lines),
            from: span.from + span.healthy + draw.below(100),
            rows: draw.log_between(1.0, 200.0) as usize,
            share: if draw.chance(0.3) { 1.0 } else { draw.log_between(0.02, 1.0) },
            size: 0.0,
            axes: draw.pick(&[Axes::One(2), Axes::One(2), Axes::Gyro, Axes::All]),
            form: draw.below(4),
            seed: draw.bits(),
        };
        let to_the_end = span.to - fault.from;
        match kind {
            Kind::Burst => fault.size = draw.log_between(2.0, 64.0).floor(),
            Kind::Reordering => fault.size = draw.log_between(1.0, 4.0).floor(),
            Kind::ClockDrift => {
                fault.rows = to_the_end;
                fault.size = draw.sign() * draw.log_between(10.0, 20_000.0);
            }
            Kind::ClockJump => {
                fault.rows = to_the_end;
                fault.size = draw.sign() * draw.log_between(1e3, 1e7);
            }
            Kind::Stuck | Kind::Saturation => {
                fault.rows = draw.log_between(1.0, 300.0) as usize;
                fault.axes = if draw.chance(0.5) { fault.axes } else { Axes::One(draw.below(6)) };
            }
            Kind::BiasStep => {
                fault.rows = to_the_end;
                fault.axes = Axes::One(if draw.chance(0.7) { 2 } else { draw.below(6) });
                let largest = if fault.axes.contains(3 + fault.form % 3) { 5.0 } else { 0.35 };
                fault.size = draw.sign() * draw.log_between(1e-5, largest);
            }
            Kind::NotANumber => fault.axes = Axes::One(draw.below(6)),
            Kind::WheelSlip => {
                fault.rows = draw.log_between(5.0, 300.0) as usize;
                fault.size = if draw.chance(0.5) { 0.0 } else { draw.log_between(1.1, 4.0) };
            }
            Kind::SwappedWheels => fault.rows = to_the_end,
            Kind::CanLoss => {
                fault.rows = draw.log_between(2.0, 300.0) as usize;
                fault.share = 1.0;
            }
            Kind::Drop | Kind::Duplicate | Kind::BitFlip | Kind::Truncation | Kind::Stall => {}
        }
        fault
    }

    pub fn holds(&self, row: usize) -> bool {
        (self.from..self.from + self.rows).contains(&row)
    }

    /// The messages of a stalled line are lost, and do not arrive late.
    pub fn is_lost(&self) -> bool {
        self.form.is_multiple_of(2)
    }

    /// Random numbers for the effects of the fault.
    pub fn draw_on(&self) -> Random {
        Random::new(self.seed, 0)
    }
}
