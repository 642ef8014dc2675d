//! The cost of a method, its multiplications and its delay, from its structure.

use super::fir::LowPass;
use super::methods::Method;
use super::vqf;
use gyronet::compensate::CompensateConfig;
use gyronet::model::blob::Shape;
use gyronet::model::window::{FEATURES, WINDOW};
use gyronet::sample::PERIOD_US;
use serde::Serialize;

/// The cost of one sample, without the work that is done once a second at standstill.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Cost {
    pub multiplications_per_sample: f64,
    pub delay_ms: u64,
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Shapes {
    /// The model of the rates that are sent.
    pub sent: Shape,
    /// The paper's GyroNet in f32 and in integers, if they run.
    pub paper: Option<[Shape; 2]>,
}

const LINEAR: Shape = Shape { units: 0, linear: true };

impl Cost {
    /// Returns the cost of a method of [`Method::ON_A_DRIVE`]; `None` if it does not run.
    pub fn new(method: Method, shapes: &Shapes) -> Option<Self> {
        let CompensateConfig { stride, lag, .. } = CompensateConfig::DEFAULT;
        let low_pass = LowPass::chosen();
        let windows = |shape| multiplications(shape) as f64 / f64::from(stride.samples());
        let complete = stride.complete_after();
        let (multiplications_per_sample, samples) = match method {
            Method::FIR | Method::FIR_ZERO_RATE => (low_pass.multiplications() as f64, low_pass.delay()),
            Method::VQF => (vqf::MULTIPLICATIONS as f64, 0),
            Method::LINEAR => (windows(LINEAR), complete),
            Method::GYRONET_F32 => (windows(shapes.paper?[0]), complete),
            Method::GYRONET_INT => (windows(shapes.paper?[1]), complete),
            Method::DELAYED => (windows(shapes.sent), lag.samples()),
            // The other methods only subtract a bias from the gyro.
            _ => (0.0, 0),
        };
        Some(Self { multiplications_per_sample, delay_ms: samples as u64 * PERIOD_US / 1_000 })
    }
}

/// Returns the multiply-accumulates of one window: the linear part, the gates of two Bi-LSTMs, and the layer on top.
pub fn multiplications(Shape { units, linear }: Shape) -> usize {
    let units = usize::from(units);
    let layer = |inputs: usize| 2 * 4 * units * (inputs + units);
    let step = layer(FEATURES) + layer(2 * units) + 2 * units;
    WINDOW * (step + if linear { WINDOW * FEATURES } else { 0 })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn multiplications_follow_from_the_shape() {
        assert_eq!(multiplications(LINEAR), 600);
        // Two directions, four gates of 6 + 60 and of 120 + 60 inputs, 120 on top.
        let step = 2 * (4 * 60 * 66) + 2 * (4 * 60 * 180) + 120;
        assert_eq!(multiplications(Shape::PAPER), 10 * step);
        assert_eq!(multiplications(Shape::LARGEST), 10 * step + 600);
    }

    #[test]
    fn delays_are_those_of_the_pipeline() {
        let shape = Shape::PAPER;
        let shapes = Shapes { sent: shape, paper: Some([shape; 2]) };
        let delays = Method::ON_A_DRIVE.map(|method| Cost::new(method, &shapes).unwrap().delay_ms);
        assert_eq!(delays, [0, 0, 0, 50, 50, 0, 110, 110, 110, 0, 70]);
    }
}
