//! Defines the estimate of a method on a sequence: the turns, and the source of the positions.

use gyronet_tools::evaluate::methods::Method;
use gyronet_tools::evaluate::trajectory_error::Point;

#[derive(Debug, Clone, PartialEq)]
pub struct Estimate {
    pub method: Method,
    /// Angle turned in each step, from the first compared step on, rad.
    pub turns: Vec<f64>,
    /// Source of the positions after these turns.
    pub places: Places,
}

#[derive(Debug, Clone, PartialEq)]
pub enum Places {
    /// Dead reckoning with the wheels' distances times a scale.
    Reckoned { scale: f64 },
    /// A given trajectory: the position after each turn, relative to that of the first step, m.
    Given(Vec<Point>),
}

impl Places {
    /// Dead reckoning with the unscaled distances.
    pub const RECKONED: Self = Self::Reckoned { scale: 1.0 };
}
