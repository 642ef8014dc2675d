//! Compensates wheels and fibre-optic gyro together, which the paper names as future work. It fits four
//! numbers to the truth of training sequences by least squares over spans of 10 s.
//!
//! The turn is the sum of a share of the gyro's turn, a share of the difference of the wheels' distances (which
//! contains the wheel base and the diameters), and a constant rate (which contains the Earth's rate and the gyro's
//! bias). The distance is that of the wheels times a scale. The fit shows how much of a network's gain four numbers
//! achieve.

use crate::sequence::{Sequence, Step};
use gyronet_tools::calibrate::NormalEquations;
use gyronet_tools::drive::DT;
use std::fmt;

/// Number of steps in a span of the fit: 10 s, in which the accumulated errors exceed an encoder's resolution.
const SPAN: usize = 1_000;

#[derive(Debug, Clone, PartialEq, Default)]
pub struct Fit {
    turns: NormalEquations,
    way_squared: f64,
    way_true: f64,
    names: Vec<String>,
}

impl Fit {
    pub fn add(&mut self, sequence: &Sequence) {
        let turns = sequence.turns();
        for (k, steps) in sequence.steps.chunks_exact(SPAN).enumerate() {
            let sums = std::array::from_fn(|input| steps.iter().map(|step| inputs(step)[input]).sum());
            self.turns.add(sums, turns[k * SPAN..][..SPAN].iter().sum(), 1.0);
            // The first step of a span begins in the previous span.
            let way = steps[1..].iter().map(way).sum::<f64>();
            let along: f64 = steps.windows(2).map(|pair| along(&pair[0], &pair[1])).sum();
            self.way_squared += way * way;
            self.way_true += way * along;
        }
        self.names.push(sequence.name.clone());
    }

    /// Returns the numbers with the least squared errors; `None` if the sequences turn or move too little for a fit.
    pub fn solve(&self) -> Option<Joint> {
        let [Some(gyro), Some(difference), Some(constant)] = self.turns.solve() else { return None };
        let way = self.way_true / self.way_squared;
        let is_finite = [gyro, difference, constant, way].iter().all(|number| number.is_finite());
        is_finite.then(|| Joint { gyro, difference, constant, way, names: self.names.clone() })
    }
}

#[derive(Debug, Clone, PartialEq)]
pub struct Joint {
    /// Share of the gyro's turn.
    pub gyro: f64,
    /// Turn for each metre that the right wheel goes farther than the left, rad/m.
    pub difference: f64,
    /// Constant rate, rad/s.
    pub constant: f64,
    /// Scale of the wheels' distance.
    pub way: f64,
    /// Names of the sequences that the numbers were fitted to.
    pub names: Vec<String>,
}

impl Joint {
    pub fn turns(&self, sequence: &Sequence, start: usize) -> Vec<f64> {
        let turn = |step| {
            let [gyro, difference, constant] = inputs(step);
            self.gyro * gyro + self.difference * difference + self.constant * constant
        };
        sequence.steps[start..].iter().map(turn).collect()
    }
}

impl fmt::Display for Joint {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "FoG and wheels are fitted on {}: {:.6} of the FoG's turn, {:.4} mrad for each metre of the wheels' difference, \
             {:.6} mrad/s, {:.6} of the distance.",
            self.names.join(", "),
            self.gyro,
            1e3 * self.difference,
            1e3 * self.constant,
            self.way
        )
    }
}

/// Returns the inputs of the fit for a step: the gyro's turn, the difference of the wheels' distances, and the time.
fn inputs(step: &Step) -> [f64; 3] {
    [step.fog, step.wheels[1] - step.wheels[0], DT]
}

fn way(step: &Step) -> f64 {
    (step.wheels[0] + step.wheels[1]) / 2.0
}

/// Returns the true distance of a step along its heading, which the noise of the true positions does not lengthen.
fn along(before: &Step, after: &Step) -> f64 {
    let (sin, cos) = libm::sincos((before.yaw + after.yaw) / 2.0);
    let [x, y] = [0, 1].map(|axis| after.position[axis] - before.position[axis]);
    x * cos + y * sin
}
