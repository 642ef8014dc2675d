//! Adds the errors of the MEMS sensor: bias random walk, white noise, scale error, misalignment.
//!
//! The model is the paper's sensor model (equations 1 and 2) with scale error, misalignment and, if configured, the
//! gyro's sensitivity to specific force.

use super::DT;
use super::car::turned_in;
use super::purpose::Purpose;
use crate::random::Random;

/// Holds the sizes of the errors. Those marked sigma are drawn for each seed and axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Config {
    /// White noise, rad/s/sqrt(Hz): that of the Xsens MTi of the KAIST drives in OpenVINS
    /// (`config/kaist/kalibr_imu_chain.yaml`).
    pub gyro_noise: f64,
    /// Bias random walk, rad/s^2/sqrt(Hz): the same file. It is 16 deg/h over a minute, the class of about 10 deg/h
    /// that the paper names for MEMS (section III-C).
    pub gyro_walk: f64,
    /// White noise, m/s^2/sqrt(Hz): the same file.
    pub accel_noise: f64,
    /// Bias random walk, m/s^3/sqrt(Hz): the same file.
    pub accel_walk: f64,
    /// Bias at power-on, sigma, rad/s: the recordings' part shows 0.004 to 0.018.
    pub gyro_bias: f64,
    /// Bias at power-on, sigma, m/s^2: a few milli-g, common for MEMS.
    pub accel_bias: f64,
    /// Scale error, sigma: the recordings' part is off by 0.001 against their reference.
    pub scale: f64,
    /// Misalignment of each axis, sigma, rad: 0.05 deg, the class of a factory-calibrated part.
    pub misalignment: f64,
    /// Sensitivity of a gyro axis to specific force, sigma for each pair of axes, rad/s per m/s^2.
    pub gyro_per_force: f64,
    /// Pitch and roll of the part's mounting, rad.
    pub mount: [f64; 2],
}

impl Config {
    pub const DEFAULT: Self = Self {
        gyro_noise: 1.7453e-4,
        gyro_walk: 1e-5,
        accel_noise: 5.886e-3,
        accel_walk: 1e-4,
        gyro_bias: 0.008,
        accel_bias: 0.03,
        scale: 0.001,
        misalignment: 0.000_87,
        gyro_per_force: 0.0,
        mount: [0.0; 2],
    };
}

/// The three axes of a gyro or accelerometer, with their errors.
#[derive(Debug, Clone, Copy)]
struct Triad {
    /// The matrix from a vector to the readings of the axes.
    matrix: [[f64; 3]; 3],
    bias: [f64; 3],
    /// Standard deviations per sample of the noise and of the bias random walk.
    noise: f64,
    walk: f64,
}

/// Draws the matrix of scale and misalignment that three axes apply to a vector.
pub fn axes(scale: f64, misalignment: f64, random: &mut Random) -> [[f64; 3]; 3] {
    std::array::from_fn(|row| {
        std::array::from_fn(|column| {
            let deviation = random.normal();
            if row == column { 1.0 + scale * deviation } else { misalignment * deviation }
        })
    })
}

/// Returns a vector as three axes measure it.
pub fn seen(matrix: &[[f64; 3]; 3], vector: [f64; 3]) -> [f64; 3] {
    matrix.map(|row| row.iter().zip(vector).map(|(m, v)| m * v).sum())
}

impl Triad {
    fn new(matrix: [[f64; 3]; 3], noise: f64, walk: f64, bias: f64, random: &mut Random) -> Self {
        let bias = random.normals().map(|n| bias * n);
        // The density is integrated over the 50 Hz bandwidth of 100 samples a second.
        Self { matrix, bias, noise: noise / DT.sqrt(), walk: walk * DT.sqrt() }
    }

    fn measure(&mut self, truth: [f64; 3], random: &mut Random) -> [f64; 3] {
        let (noise, walk) = (random.normals(), random.normals());
        let seen = seen(&self.matrix, truth);
        std::array::from_fn(|axis| {
            self.bias[axis] += self.walk * walk[axis];
            seen[axis] + self.bias[axis] + self.noise * noise[axis]
        })
    }
}

#[derive(Debug, Clone)]
pub struct Mems {
    random: Random,
    gyro: Triad,
    accel: Triad,
    /// Sensitivity of the gyro to specific force, rad/s per m/s^2.
    gyro_of_force: [[f64; 3]; 3],
    mount: [f64; 2],
}

impl Mems {
    pub fn new(config: &Config, seed: u64) -> Self {
        Self::of(config, None, Purpose::Mems.stream(seed))
    }

    /// Creates the part of a device seed in one run: scale, misalignment and the gyro's sensitivity to force come
    /// from the device, bias at power-on and noise from the run.
    pub fn of_device(config: &Config, device: u64, run: u64) -> Self {
        Self::of(config, Some(Purpose::Device.stream(device)), Purpose::Mems.stream(run))
    }

    fn of(config: &Config, mut fixed: Option<Random>, mut random: Random) -> Self {
        let mut triad = |noise, walk, bias| {
            let fixed = fixed.as_mut().unwrap_or(&mut random);
            let matrix = axes(config.scale, config.misalignment, fixed);
            Triad::new(matrix, noise, walk, bias, &mut random)
        };
        let gyro = triad(config.gyro_noise, config.gyro_walk, config.gyro_bias);
        let accel = triad(config.accel_noise, config.accel_walk, config.accel_bias);
        let gyro_of_force = fixed.map_or([[0.0; 3]; 3], |mut fixed| {
            std::array::from_fn(|_| fixed.normals().map(|n| config.gyro_per_force * n))
        });
        Self { random, gyro, accel, gyro_of_force, mount: config.mount }
    }

    /// Converts a vector from the car's axes to the part's nominal axes.
    pub fn tilt(&self, vector: [f64; 3]) -> [f64; 3] {
        let [pitch, roll] = self.mount;
        turned_in(vector, pitch, roll)
    }

    /// Returns specific force and angular rate as the part reports them.
    pub fn measure(&mut self, force: [f64; 3], rate: [f64; 3]) -> ([f64; 3], [f64; 3]) {
        let of_force = seen(&self.gyro_of_force, force);
        let rate = std::array::from_fn(|axis| rate[axis] + of_force[axis]);
        (self.accel.measure(force, &mut self.random), self.gyro.measure(rate, &mut self.random))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn noise_and_bias_are_as_configured() {
        let config = Config { gyro_walk: 0.0, ..Config::DEFAULT };
        let mut biases = Vec::new();
        for seed in 0..200 {
            let mut mems = Mems::new(&config, seed);
            let rates: Vec<f64> = (0..1_000).map(|_| mems.measure([0.0; 3], [0.0; 3]).1[2]).collect();
            let mean = rates.iter().sum::<f64>() / 1_000.0;
            let variance = rates.iter().map(|r| (r - mean) * (r - mean)).sum::<f64>() / 1_000.0;
            assert!((variance.sqrt() / 1.7453e-3 - 1.0).abs() < 0.12);
            biases.push(mean);
        }
        let rms = (biases.iter().map(|b| b * b).sum::<f64>() / 200.0).sqrt();
        assert!((rms / config.gyro_bias - 1.0).abs() < 0.2, "{rms}");
    }

    #[test]
    fn a_part_without_errors_reads_the_truth() {
        let nothing = Config {
            gyro_noise: 0.0,
            gyro_walk: 0.0,
            accel_noise: 0.0,
            accel_walk: 0.0,
            gyro_bias: 0.0,
            accel_bias: 0.0,
            scale: 0.0,
            misalignment: 0.0,
            gyro_per_force: 0.0,
            mount: [0.0; 2],
        };
        let mut mems = Mems::new(&nothing, 5);
        let truth = ([0.5, -1.0, 9.8], [0.01, 0.02, 0.3]);
        assert_eq!(mems.measure(mems.tilt(truth.0), mems.tilt(truth.1)), truth);
    }
}
