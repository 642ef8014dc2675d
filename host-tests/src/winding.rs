//! A vehicle that is on a winding road, with turns both ways, from the start on: its inertial samples, whose bias and gain
//! nobody knows, and its course by a GNSS receiver, as frames of NMEA 2000.

use crate::gnss::Pvt;
use crate::noise::Noise;
use crate::synthetic::{force, rate, turning};
use crate::wire;
use gyronet::can::DataFrame;
use gyronet::sample::ImuSample;
use std::f64::consts::TAU;

/// Bias of the gyro, rad/s, and the share by which it reads too much.
pub const BIAS: f64 = 0.004;
pub const GAIN: f64 = 0.008;
/// Sigma of a course, rad, and its age, samples.
const NOISE: f64 = 0.01;
const LATENCY: usize = 40;

/// Yaw rate of the road, rad/s.
pub fn road(second: f64) -> f64 {
    0.15 * (TAU * second / 23.0).sin() + 0.1 * (TAU * second / 61.0).sin()
}

#[derive(Debug)]
pub struct Winding {
    noise: Noise,
    receiver: Noise,
    /// Heading with each sample, rad to the left.
    pub headings: Vec<f64>,
}

impl Winding {
    pub fn new(seed: u64) -> Self {
        Self { noise: Noise::new(seed), receiver: Noise::new(!seed), headings: Vec::new() }
    }

    /// Drives on for 10 ms.
    pub fn sample(&mut self) -> ImuSample {
        let tick = self.headings.len();
        let yaw_rate = road(tick as f64 * 0.01);
        self.headings.push(self.headings.last().unwrap_or(&1.0) + yaw_rate * 0.01);
        let mut noisy = |size: f64| size * self.noise.normal();
        let mut sample = turning(tick as u64, rate((1.0 + GAIN) * yaw_rate + BIAS + noisy(0.002)));
        sample.specific_force.iter_mut().for_each(|axis| axis.0 += force(noisy(0.3)).0);
        sample.angular_rate.iter_mut().take(2).for_each(|axis| *axis = rate(noisy(0.01)));
        sample
    }

    /// Direction of travel by the receiver, rad clockwise from north.
    pub fn direction(&mut self) -> f64 {
        let heading = self.headings[self.headings.len().saturating_sub(1 + LATENCY)];
        (-(heading + NOISE * self.receiver.normal())).rem_euclid(TAU)
    }

    pub fn course(&mut self) -> DataFrame {
        wire::course([Some(self.direction() as f32), Some(15.0)], 0)
    }

    /// The same by a receiver on a line of its own.
    pub fn pvt(&mut self) -> Pvt {
        let course = (self.direction().to_degrees() * 1e5) as i32;
        Pvt { course, speed: 15_000, course_sigma: 60_000, ..Pvt::GOOD }
    }
}
