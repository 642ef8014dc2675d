//! Simulated sequences in the layout of KAIST Complex Urban, with an exactly known
//! truth: the car of [`gyronet_tools::simulate`] drives through a town with a fibre-optic gyro ([`fog`]) and wheels
//! (`odometer`). [`vehicles`] lists every parameter with its source.
//!
//! A sequence is completely determined by its [`Spec`]. The run's seed determines route, road, traffic, tyres, noise
//! and the biases at power-on. The device's seed determines the scale and misalignment of the sensors, and the
//! constant bias of the fibre-optic gyro. Sequences of one data set share a device, as the paper's do. The file
//! [`MARKER`] beside the data says that they are simulated, and holds the specification.

mod delay;
pub mod fog;
mod kaist;
mod odometer;
mod town;
pub mod vehicles;
pub mod world;

use self::fog::Fog;
use self::odometer::Odometer;
use self::town::Town;
use self::world::{Truth, World};
use gyronet::sample::RATE_HZ;
use gyronet_tools::random::Random;
use gyronet_tools::simulate::mems::Mems;
use gyronet_tools::simulate::purpose::Purpose;
use serde::{Deserialize, Serialize};
use std::io;
use std::path::Path;

/// Name of the file that marks a sequence's folder as simulated.
pub const MARKER: &str = "simulated.json";

/// The specification of a sequence, which is written to [`MARKER`].
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Spec {
    /// Name of the sequence and of its folder.
    pub name: String,
    /// Length, s.
    pub seconds: u32,
    /// Seed of the sensors.
    pub device: u64,
    /// Seed of everything else.
    pub run: u64,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum Set {
    /// Eight sequences, as the paper's urban06 to 13.
    Train,
    /// Four more sequences of the same devices, as the paper's urban14 to 17.
    Test,
    /// Four sequences of other devices of the same kind.
    Transfer,
}

/// A sequence of a set lasts this long, s.
pub const SECONDS: u32 = 20 * 60;

impl Set {
    /// Returns the specifications of the set's sequences. No run is in two sets.
    pub fn specs(self) -> Vec<Spec> {
        let (word, count, device, first) = match self {
            Self::Train => ("train", 8u64, 1, 101),
            Self::Test => ("test", 4, 1, 201),
            Self::Transfer => ("transfer", 4, 2, 301),
        };
        let name = |k| format!("{word}{:02}", k + 1);
        let spec = |k| Spec { name: name(k), seconds: SECONDS, device, run: first + k };
        (0..count).map(spec).collect()
    }
}

struct Drive {
    world: World,
    mems: Mems,
    fog: Fog,
    odometer: Odometer,
    magnetometer: Random,
    ticks: usize,
}

impl Drive {
    fn new(spec: &Spec) -> Self {
        let way = Town::new(spec.run);
        let heading = Purpose::Stamps.stream(spec.run).between(0.0, std::f64::consts::TAU);
        Self {
            world: World::new(way, heading, spec.run),
            mems: Mems::of_device(&vehicles::MEMS, spec.device, spec.run),
            fog: Fog::of_device(&vehicles::FOG, spec.device, spec.run),
            odometer: Odometer::new(spec.run),
            magnetometer: Purpose::Magnetometer.stream(spec.run),
            ticks: (spec.seconds * RATE_HZ) as usize,
        }
    }

    /// Returns specific force and angular rate as the inertial sensor reports them.
    fn imu(&mut self, truth: &Truth) -> ([f64; 3], [f64; 3]) {
        let force = gyronet_tools::simulate::add(truth.motion.specific_force, truth.shake.specific_force);
        let rate = gyronet_tools::simulate::add(truth.inertial_rate, truth.shake.angular_rate);
        self.mems.measure(self.mems.tilt(force), self.mems.tilt(rate))
    }

    /// Returns the reading of a magnetometer, with noise, in a field given in the world's axes.
    fn magnetic(&mut self, truth: &Truth, field: [f64; 3], noise: f64) -> [f64; 3] {
        let seen = truth.in_vehicle(field);
        let normals = self.magnetometer.normals();
        std::array::from_fn(|axis| seen[axis] + noise * normals[axis])
    }
}

pub fn write(spec: &Spec, folder: &Path) -> io::Result<()> {
    std::fs::create_dir_all(folder)?;
    std::fs::write(folder.join(MARKER), serde_json::to_string_pretty(spec)? + "\n")?;
    kaist::write(spec, Drive::new(spec), folder)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sets_share_devices_and_no_run() {
        let all: Vec<Spec> =
            [Set::Train, Set::Test, Set::Transfer].iter().flat_map(|set| set.specs()).collect();
        let mut runs: Vec<u64> = all.iter().map(|spec| spec.run).collect();
        runs.sort_unstable();
        runs.dedup();
        assert_eq!((all.len(), runs.len()), (16, 16));
        assert!(all[..12].iter().all(|spec| spec.device == 1));
        assert!(all[12..].iter().all(|spec| spec.device == 2));
    }
}
