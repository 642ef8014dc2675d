//! This module holds the estimate of a method on a sequence: turns, and where the places come from.

use crate::evaluate::methods::Method;
use crate::evaluate::trajectory_error::Point;

/// Holds the estimate of a method on a sequence.
#[derive(Debug, Clone, PartialEq)]
pub struct Estimate {
    /// The method.
    pub method: Method,
    /// The angle turned in each step, from the first that is compared, rad.
    pub turns: Vec<f64>,
    /// The places after them.
    pub places: Places,
    /// The run time on this machine, s, where it was measured.
    pub run_time: Option<f64>,
}

/// Says where the places of an estimate come from.
#[derive(Debug, Clone, PartialEq)]
pub enum Places {
    /// Dead reckoning with the wheels' ways, times a scale.
    Reckoned {
        /// The scale.
        scale: f64,
    },
    /// A trajectory that is given: the place after each turn, m from the first step's.
    Given(Vec<Point>),
}

impl Places {
    /// Dead reckoning with the ways as they are.
    pub const RECKONED: Self = Self::Reckoned { scale: 1.0 };
}
