//! This module lists the kinds of faults and draws faults from a seed.

use crate::parts::Part;
use crate::random::Random;
use serde::Serialize;

/// Names a kind of fault.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Kind {
    /// Messages are lost.
    Drop,
    /// Messages are sent twice.
    Duplicate,
    /// One bit of a message is wrong.
    BitFlip,
    /// A series of bytes is replaced by noise.
    Burst,
    /// The end of a message is lost.
    Truncation,
    /// A message overtakes those before it.
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
    /// All kinds.
    pub const ALL: [Self; 16] = [
        Self::Drop,
        Self::Duplicate,
        Self::BitFlip,
        Self::Burst,
        Self::Truncation,
        Self::Reordering,
        Self::Stall,
        Self::ClockDrift,
        Self::ClockJump,
        Self::Stuck,
        Self::Saturation,
        Self::BiasStep,
        Self::NotANumber,
        Self::WheelSlip,
        Self::SwappedWheels,
        Self::CanLoss,
    ];

    /// Returns the name in tables.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Drop => "drop",
            Self::Duplicate => "duplicate",
            Self::BitFlip => "bit flip",
            Self::Burst => "burst",
            Self::Truncation => "truncation",
            Self::Reordering => "reordering",
            Self::Stall => "stall",
            Self::ClockDrift => "clock drift",
            Self::ClockJump => "clock jump",
            Self::Stuck => "stuck value",
            Self::Saturation => "saturation",
            Self::BiasStep => "bias step",
            Self::NotANumber => "not a number",
            Self::WheelSlip => "wheel slip",
            Self::SwappedWheels => "swapped wheels",
            Self::CanLoss => "CAN loss",
        }
    }

    /// Returns whether the fault damages bytes on a line rather than the measurements.
    #[must_use]
    pub const fn is_on_a_line(self) -> bool {
        matches!(
            self,
            Self::Drop
                | Self::Duplicate
                | Self::BitFlip
                | Self::Burst
                | Self::Truncation
                | Self::Reordering
                | Self::Stall
                | Self::CanLoss
        )
    }
}

/// Names a line that carries bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Line {
    /// The line of the inertial sensor.
    Sensor,
    /// The line of the fibre-optic gyro.
    Gyro,
    /// The line of the incoming wheel speeds, SLCAN.
    Wheels,
    /// The line of the outgoing frames, SLCAN.
    Out,
}

/// Names the axes that a fault affects.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Axes {
    /// All six axes.
    All,
    /// The three axes of the gyro.
    Gyro,
    /// One axis: 0 to 2 are gyro x, y, z; 3 to 5 are accelerometer x, y, z.
    One(usize),
}

impl Axes {
    /// Returns whether gyro axis 0 to 2 or accelerometer axis 3 to 5 is among them.
    #[must_use]
    pub fn contains(self, axis: usize) -> bool {
        match self {
            Self::All => true,
            Self::Gyro => axis < 3,
            Self::One(one) => one == axis,
        }
    }
}

/// Describes a fault.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Fault {
    /// The kind of fault.
    pub kind: Kind,
    /// The line that the fault affects, for a fault on a line.
    pub line: Line,
    /// First affected row of the drive.
    pub from: usize,
    /// Number of affected rows.
    pub rows: usize,
    /// Share of the messages that the fault hits.
    pub share: f64,
    /// Size of the fault: microseconds of a clock jump, ppm of a drift, rad/s or m/s^2 of a bias, bytes of a burst,
    /// places of a reordering, factor on the wheels' speed.
    pub size: f64,
    /// The affected axes of the sensor.
    pub axes: Axes,
    /// One of four forms of the same kind; the code that applies the fault says which.
    pub form: usize,
    /// The seed of everything that is drawn while the fault lasts.
    pub seed: u64,
}

/// Holds the rows of a drive that a run covers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct Span {
    /// First row.
    pub from: usize,
    /// The row after the last one.
    pub to: usize,
    /// Rows before which no fault begins.
    pub healthy: usize,
}

impl Fault {
    /// Draws a fault of a kind.
    #[must_use]
    pub fn draw(kind: Kind, part: Part, span: Span, draw: &mut Random) -> Self {
        let lines: &[Line] = match (kind, part) {
            (Kind::CanLoss, _) => &[Line::Wheels, Line::Out],
            // The campaign is mainly about the part's own messages: every second fault is on its line.
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

    /// Returns whether the fault is present in a row.
    #[must_use]
    pub fn holds(&self, row: usize) -> bool {
        (self.from..self.from + self.rows).contains(&row)
    }

    /// Returns the stream of random numbers for the effects of the fault.
    #[must_use]
    pub fn draw_on(&self) -> Random {
        Random::new(self.seed, 0)
    }
}

impl std::fmt::Display for Fault {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { kind, line, from, rows, share, size, axes, form, .. } = self;
        write!(f, "{}", kind.name())?;
        if kind.is_on_a_line() {
            write!(f, " on line {line:?}, {:.0} % of the messages", 100.0 * share)?;
        } else {
            write!(f, " of {axes:?}")?;
        }
        write!(f, ", size {size:.3e}, form {form}, rows {from} to {}", from + rows)
    }
}
