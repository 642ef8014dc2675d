//! Trips on which the sensor warms up: its bias follows the temperature, and differs from device to device.
//!
//! | what | value | source |
//! |---|---|---|
//! | gyro bias of a device at 25 deg C | 0.25 deg/s, sigma | assumed |
//! | gyro bias by temperature | 0.005 deg/s per kelvin, sigma; over 30 K it bends by 0.03 deg/s, sigma | ICM-42688-P, DS-000347, table 1; the bend is assumed |
//! | gyro bias at power-on | 0.02 deg/s, sigma | assumed |
//! | town | the sensor warms up by 15 K with a time constant of 10 min, from 5 to 25 deg C | assumed |
//! | motorway | 10 K in half an hour, and a drift of 0.01 deg/s per hour from another cause | assumed |

use super::mems;
use super::purpose::Purpose;

const DEG: f64 = std::f64::consts::PI / 180.0;
/// A car that has been faster than this is on the motorway, m/s.
const FASTER_THAN_IN_TOWN: f64 = 18.0;

#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum Trip {
    /// Streets with stops.
    Town,
    /// Some minutes of streets, then a motorway without a stop.
    Motorway,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Config {
    pub trip: Trip,
    /// Seed of the errors that all trips of a device share.
    pub device: u64,
}

/// The sizes of the other errors: the warming replaces the bias at power-on and its random walk.
pub const PART: mems::Config = mems::Config { gyro_bias: 0.0, gyro_walk: 0.0, ..mems::Config::DEFAULT };

#[derive(Debug, Clone)]
pub struct Warming {
    trip: Trip,
    /// Bias of each axis at 25 deg C, rad/s, and its changes per kelvin and per square kelvin.
    bias: [[f64; 3]; 3],
    power_on: [f64; 3],
    cold: f64,
    /// Drift on the motorway, rad/s^2.
    drift: f64,
    on_motorway_from: Option<f64>,
}

impl Warming {
    pub fn new(config: &Config, run: u64) -> Self {
        let mut device = Purpose::DeviceWarming.stream(config.device);
        let mut axis = || [0.25 * DEG, 0.005 * DEG, 0.03 * DEG / 900.0].map(|sigma| sigma * device.normal());
        let bias = [axis(), axis(), axis()];
        let mut run = Purpose::Warming.stream(run);
        Self {
            trip: config.trip,
            bias,
            power_on: run.normals().map(|normal| 0.02 * DEG * normal),
            cold: run.between(5.0, 25.0),
            drift: 0.01 * DEG / 3600.0 * run.sign(),
            on_motorway_from: None,
        }
    }

    /// The temperature, deg C, and the bias of each axis, rad/s.
    pub fn step(&mut self, seconds: f64, speed: f64) -> (f64, [f64; 3]) {
        if speed > FASTER_THAN_IN_TOWN {
            self.on_motorway_from.get_or_insert(seconds);
        }
        let on_motorway = self.on_motorway_from.map_or(0.0, |from| seconds - from);
        let celsius = self.cold
            + match self.trip {
                Trip::Town => 15.0 * (1.0 - libm::exp(-seconds / 600.0)),
                Trip::Motorway => 10.0 * on_motorway / 1800.0,
            };
        let warmer = celsius - 25.0;
        let bias = std::array::from_fn(|axis| {
            let [fixed, slope, bend] = self.bias[axis];
            let by_temperature = fixed + slope * warmer + bend * warmer * warmer;
            by_temperature + self.power_on[axis] + self.drift * on_motorway
        });
        (celsius, bias)
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Config as Simulated, Simulation};
    use super::*;

    #[test]
    fn the_motorway_has_no_stop_and_warms_the_sensor_by_ten_kelvin() {
        let warming = Some(Config { trip: Trip::Motorway, device: 3 });
        let samples: Vec<_> =
            Simulation::new(&Simulated { warming, ..Simulated::DEFAULT }).take(220_000).collect();
        let begin = samples.iter().position(|sample| sample.speed > 20.0).unwrap();
        assert!((15_000..40_000).contains(&begin), "{begin}");
        let celsius = |row: usize| samples[row].celsius.unwrap();
        assert!((celsius(begin + 180_000) - celsius(begin) - 10.0).abs() < 0.1);
        assert!(samples[begin..].iter().all(|sample| (20.0..37.0).contains(&sample.speed)));
        assert!(samples[begin..].iter().all(|sample| sample.reference[2].abs() < 0.06));
        let stood = samples[..begin].iter().filter(|sample| sample.speed == 0.0).count();
        assert!(stood > 1_500, "{stood}");
    }
}
