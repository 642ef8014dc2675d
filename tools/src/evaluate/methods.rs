//! The compared methods of computing a yaw rate, with one set of names for the tables of drives and
//! for the paper's tables.

use super::fir::LowPass;
use gyronet::compensate::CompensateConfig;
use gyronet::sample::PERIOD_US;
use serde::ser::{Serialize, SerializeMap, Serializer};

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Gyro {
    Mems,
    Fog,
    Wheels,
    /// The gyro of another program, whose trajectory is given.
    Given,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Method {
    pub key: &'static str,
    pub name: &'static str,
    pub gyro: Gyro,
}

const fn mems(key: &'static str, name: &'static str) -> Method {
    Method { key, name, gyro: Gyro::Mems }
}

const fn fog(key: &'static str, name: &'static str) -> Method {
    Method { key, name, gyro: Gyro::Fog }
}

impl Method {
    /// Returns the method of another program. The name is leaked; a command line has only a few.
    pub fn given(name: &str) -> Self {
        let name = String::leak(name.to_owned());
        Self { key: name, name, gyro: Gyro::Given }
    }

    /// The positions of a GNSS receiver: a path, no rate.
    pub const GNSS: Self = Self { key: "gnss", name: "GNSS receiver", gyro: Gyro::Given };
    /// The inertial sensor's gyro without any correction.
    pub const RAW: Self = mems("raw", "raw gyro");
    /// The gyro less its mean over the first 3 s.
    pub const STATIC: Self = mems("static", "static initialisation");
    /// The pipeline without a network: static initialisation and zero-rate updates.
    pub const STATIC_ZERO_RATE: Self = mems("static_zero_rate", "static, zero-rate updates");
    /// Static initialisation and a low pass ([`crate::evaluate::fir`]) whose delay is compensated.
    pub const FIR: Self = mems("fir", "FIR low pass");
    /// Static initialisation, zero-rate updates and the same low pass.
    pub const FIR_ZERO_RATE: Self = mems("fir_zero_rate", "FIR, zero-rate updates");
    /// Static initialisation and the linear window ([`gyronet::model::weights::DEFAULT`]): the mean of both
    /// windows over each sample, which is known 110 ms later.
    pub const LINEAR: Self = mems("linear", "linear window");
    /// The same as [`Method::LINEAR`] with the paper's GyroNet in f32.
    pub const GYRONET_F32: Self = mems("gyronet_f32", "GyroNet, f32");
    /// The same as [`Method::LINEAR`] with the paper's GyroNet in integers.
    pub const GYRONET_INT: Self = mems("gyronet_int", "GyroNet, integer");
    /// The live rate, which the board sends at once: Bosch TX1.
    pub const LIVE: Self = mems("live", "gyronet, live rate");
    /// The delayed rate, which the board sends in its own yaw messages, some samples later.
    pub const DELAYED: Self = mems("default", "gyronet, delayed rate");
    /// A filter of heading, bias and gain by courses, as a user of a GNSS receiver would write it.
    pub const EKF: Self = mems("ekf", "EKF with the course");
    /// The delayed rate without a network, learnt from courses.
    pub const NO_MODEL: Self = mems("no_model", "gyronet without its model");
    /// The orientation filter VQF ([`crate::evaluate::vqf`]). On a drive it starts from static initialisation; in the
    /// paper's tables it replaces the vendor's filter and estimates the bias itself.
    pub const VQF: Self = mems("vqf", "VQF filter");
    /// VQF with wider limits of rest, for a vehicle that vibrates at standstill.
    pub const VQF_VEHICLE: Self = mems("vqf_vehicle", "VQF filter, vehicle's limits of rest");
    pub const VENDOR: Self = mems("vendor", "vendor's filter");
    /// GyroNet alone, integer, complete estimates.
    pub const GYRONET: Self = mems("gyronet", "GyroNet");
    /// GyroNet alone, live rate.
    pub const GYRONET_ONLINE: Self = mems("gyronet_online", "GyroNet, sent at once");
    /// GyroNet followed by zero-rate updates, delayed rate.
    pub const GYRONET_LOOP: Self = mems("gyronet_loop", "GyroNet with the bias loop");
    pub const FOG: Self = fog("fog", "FoG");
    /// The fibre-optic gyro less the Earth's rate at the latitude of the sequence.
    pub const FOG_EARTH: Self = fog("fog_earth", "FoG less Earth rate");
    /// The fibre-optic gyro as the board sends it by default: less the Earth's rate and the bias at standstills.
    pub const FOG_DEFAULT: Self = fog("fog_default", "FoG, no network");
    /// FoGNet on the rate of [`Method::GYRONET_LOOP`] instead of a fibre-optic gyro: the paper's future work. FoGNet
    /// was not trained on such rates.
    pub const PSEUDO_FOG: Self = mems("pseudo_fog", "FoGNet on GyroNet's rate");
    /// The yaw rate from the travel difference of the left and right wheels over the track.
    pub const WHEELS: Self = Self { key: "wheels", name: "wheels alone", gyro: Gyro::Wheels };
    /// The fibre-optic gyro and the wheels with four numbers fitted to training sequences.
    pub const FOG_WHEELS: Self = fog("fog_wheels", "FoG and wheels, fitted");
    /// FoGNet; the first minute is padded.
    pub const FOGNET: Self = fog("fognet", "FoGNet");
    /// FoGNet; the first minute is uncorrected.
    pub const FOGNET_NOPAD: Self = fog("fognet_nopad", "FoGNet, no padding");

    pub const ON_A_DRIVE: [Self; 11] = [
        Self::RAW,
        Self::STATIC,
        Self::STATIC_ZERO_RATE,
        Self::FIR,
        Self::FIR_ZERO_RATE,
        Self::VQF,
        Self::LINEAR,
        Self::GYRONET_F32,
        Self::GYRONET_INT,
        Self::LIVE,
        Self::DELAYED,
    ];

    pub const CLASSICAL: [Self; 6] =
        [Self::RAW, Self::STATIC, Self::STATIC_ZERO_RATE, Self::FIR, Self::FIR_ZERO_RATE, Self::VQF];

    /// How long after its sample the rate of a drive is known, ms.
    pub fn delay_ms(self) -> u64 {
        let CompensateConfig { stride, lag, .. } = CompensateConfig::DEFAULT;
        let samples = match self {
            Self::FIR | Self::FIR_ZERO_RATE => LowPass::chosen().delay(),
            Self::LINEAR | Self::GYRONET_F32 | Self::GYRONET_INT => stride.complete_after(),
            Self::DELAYED => lag.samples(),
            _ => 0,
        };
        samples as u64 * PERIOD_US / 1_000
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct PerMethod<T>([Option<T>; Method::ON_A_DRIVE.len()]);

impl<T> PerMethod<T> {
    pub fn of(values: [Option<T>; Method::ON_A_DRIVE.len()]) -> Self {
        Self(values)
    }

    pub fn new(of: impl FnMut(Method) -> Option<T>) -> Self {
        Self(Method::ON_A_DRIVE.map(of))
    }

    /// Returns the methods and their values in the order of the table.
    pub fn each(&self) -> impl Iterator<Item = (Method, &T)> {
        Method::ON_A_DRIVE
            .into_iter()
            .zip(&self.0)
            .filter_map(|(method, value)| Some((method, value.as_ref()?)))
    }

    pub fn values(&self) -> &[Option<T>; Method::ON_A_DRIVE.len()] {
        &self.0
    }

    /// The values in the order of [`Method::ON_A_DRIVE`], to change them.
    pub fn values_mut(&mut self) -> &mut [Option<T>; Method::ON_A_DRIVE.len()] {
        &mut self.0
    }

    pub fn get(&self, method: Method) -> Option<&T> {
        self.each().find(|(own, _)| *own == method).map(|(_, value)| value)
    }
}

impl<T> std::ops::Index<Method> for PerMethod<T> {
    type Output = T;

    fn index(&self, method: Method) -> &T {
        self.get(method).unwrap_or_else(|| panic!("{} was not run on the drive", method.key))
    }
}

impl<T: Serialize> Serialize for PerMethod<T> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut map = serializer.serialize_map(None)?;
        for (method, value) in self.each() {
            map.serialize_entry(method.key, value)?;
        }
        map.end()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn delays_are_those_of_the_pipeline() {
        let delays = Method::ON_A_DRIVE.map(Method::delay_ms);
        assert_eq!(delays, [0, 0, 0, 50, 50, 0, 110, 110, 110, 0, 70]);
    }
}
