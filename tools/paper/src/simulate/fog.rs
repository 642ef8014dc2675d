//! Simulates a fibre-optic gyro with angle random walk, bias random walk, scale error and misalignment.

use gyronet_tools::random::Random;
use gyronet_tools::simulate::mems::{axes, seen};
use gyronet_tools::simulate::purpose::Purpose;

/// Holds the sizes of the gyro's errors. Those marked sigma are drawn for each device or run, and axis.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Config {
    /// Angle random walk, rad/sqrt(s).
    pub angle_walk: f64,
    /// Bias of the device, sigma, rad/s.
    pub device_bias: f64,
    /// Additional bias of one run, sigma, rad/s.
    pub run_bias: f64,
    /// Bias random walk, rad/s/sqrt(s).
    pub bias_walk: f64,
    /// Scale error of the device, sigma.
    pub scale: f64,
    /// Misalignment of each axis of the device, sigma, rad.
    pub misalignment: f64,
}

/// Simulates a gyro with the errors of its device and run.
#[derive(Debug, Clone)]
pub struct Fog {
    config: Config,
    random: Random,
    matrix: [[f64; 3]; 3],
    bias: [f64; 3],
}

impl Fog {
    /// Creates the gyro with the seed `device`, in the run with the seed `run`.
    pub fn of_device(config: &Config, device: u64, run: u64) -> Self {
        // This stream differs from that of the MEMS part with the same device seed.
        let mut fixed = Purpose::Fog.stream(device);
        let mut random = Purpose::Fog.stream(run);
        let matrix = axes(config.scale, config.misalignment, &mut fixed);
        let device_bias = fixed.normals();
        let run_bias = random.normals();
        let bias = std::array::from_fn(|axis| {
            config.device_bias * device_bias[axis] + config.run_bias * run_bias[axis]
        });
        Self { config: *config, random, matrix, bias }
    }

    /// Returns the measured turn, rad, of a motion at this rate for this many seconds.
    pub fn increment(&mut self, rate: [f64; 3], seconds: f64) -> [f64; 3] {
        let seen = seen(&self.matrix, rate);
        let (noise, root) = (self.random.normals(), seconds.sqrt());
        std::array::from_fn(|axis| {
            (seen[axis] + self.bias[axis]) * seconds + self.config.angle_walk * root * noise[axis]
        })
    }

    /// Advances the bias by this many seconds; once per several increments is enough.
    pub fn wander(&mut self, seconds: f64) {
        let walk = self.random.normals();
        for (bias, walk) in self.bias.iter_mut().zip(walk) {
            *bias += self.config.bias_walk * seconds.sqrt() * walk;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn walks_as_configured() {
        let config = Config { angle_walk: 3.5e-6, ..Config::default() };
        let squares: f64 = (0..200)
            .map(|run| {
                let mut fog = Fog::of_device(&config, 1, run);
                let angle: f64 = (0..1_000).map(|_| fog.increment([0.0; 3], 1e-3)[2]).sum();
                angle * angle
            })
            .sum();
        let rms = (squares / 200.0).sqrt();
        assert!((rms / 3.5e-6 - 1.0).abs() < 0.15, "after one second: {rms}");
    }

    #[test]
    fn the_device_stays_and_the_run_changes() {
        let config = Config { device_bias: 1e-6, scale: 1e-4, ..Config::default() };
        let turned = |device, run| Fog::of_device(&config, device, run).increment([0.0, 0.0, 1.0], 1.0);
        assert_eq!(turned(1, 1), turned(1, 2));
        assert_ne!(turned(1, 1), turned(2, 1));
        let run_bias = Config { run_bias: 1e-6, ..config };
        let turned = |run| Fog::of_device(&run_bias, 1, run).increment([0.0; 3], 1.0);
        assert_ne!(turned(1), turned(2));
    }
}
