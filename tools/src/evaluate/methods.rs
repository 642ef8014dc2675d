//! The ways of getting a yaw rate that are compared with each other: one list of names for the tables of drives and for
//! the paper's, and the rates of one drive by each of them.

use crate::drive::recording::Recording;
use crate::drive::replay::{Replay, ReplayError};
use crate::drive::wheel_frames::WheelFrames;
use crate::evaluate::fir;
use gyronet::compensate::{CompensateConfig, Mode};
use gyronet::model::WindowNetwork;
use gyronet::pipeline::PipelineConfig;
use gyronet::sample::ImuSample;
use serde::ser::{Serialize, SerializeMap, Serializer};
use std::time::{Duration, Instant};

/// The gyro that a method starts from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Gyro {
    /// The gyro of the inertial sensor.
    Mems,
    /// The fibre-optic gyro.
    Fog,
}

/// A way of getting a yaw rate.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Method {
    /// The name in JSON.
    pub key: &'static str,
    /// The name in tables.
    pub name: &'static str,
    /// The gyro that it starts from.
    pub gyro: Gyro,
}

const fn mems(key: &'static str, name: &'static str) -> Method {
    Method { key, name, gyro: Gyro::Mems }
}

const fn fog(key: &'static str, name: &'static str) -> Method {
    Method { key, name, gyro: Gyro::Fog }
}

impl Method {
    /// The inertial sensor's gyro as it is.
    pub const RAW: Self = mems("raw", "raw gyro");
    /// The gyro less its mean over the first 3 s.
    pub const STATIC: Self = mems("static", "static initialisation");
    /// The gyro through the paper's low-pass ([`crate::evaluate::fir`]).
    pub const FIR: Self = mems("fir", "FIR 10/15 Hz");
    /// Static initialisation and the newest output of a window every sample.
    pub const NEWEST: Self = mems("newest", "newest output");
    /// Static initialisation and the middle outputs of a window every five samples.
    pub const MIDDLE: Self = mems("middle", "middle outputs");
    /// Static initialisation and GyroNet in f32: the mean of both windows over each sample, which is known 110 ms
    /// later.
    pub const GYRONET_F32: Self = mems("gyronet_f32", "overlap f32");
    /// The same in integers.
    pub const GYRONET_INT: Self = mems("gyronet_int", "overlap integer");
    /// The linear window ([`gyronet::model::weights::LINEAR_WINDOW`]) in the place of GyroNet, the same way.
    pub const LINEAR: Self = mems("linear", "linear window");
    /// The linear window: the rate that the board would send at once.
    pub const LINEAR_PROMPT: Self = mems("linear_prompt", "linear, sent at once");
    /// The linear window: the rate that the board would send for navigation.
    pub const LINEAR_NAVIGATION: Self = mems("linear_default", "linear, for navigation");
    /// The rate that the board sends at once: Bosch TX1, VDC2.
    pub const PROMPT: Self = mems("prompt", "sent at once");
    /// The rate that the board sends in its own yaw messages, some samples later.
    pub const NAVIGATION: Self = mems("default", "sent for navigation");
    /// A well-known filter in the place of the vendor's.
    pub const VQF: Self = mems("vqf", "VQF filter");
    /// The same filter, with limits of rest that a shaking vehicle keeps.
    pub const VQF_VEHICLE: Self = mems("vqf_vehicle", "VQF filter, vehicle's limits of rest");
    /// The vendor's own heading.
    pub const VENDOR: Self = mems("vendor", "vendor's filter");
    /// GyroNet alone, integer, settled estimates.
    pub const GYRONET: Self = mems("gyronet", "GyroNet");
    /// GyroNet alone, the rate that is sent at once.
    pub const GYRONET_ONLINE: Self = mems("gyronet_online", "GyroNet, sent at once");
    /// GyroNet with zero-rate updates behind it: the rate that is sent for navigation.
    pub const GYRONET_LOOP: Self = mems("gyronet_loop", "GyroNet with the bias loop");
    /// The fibre-optic gyro as it is.
    pub const FOG: Self = fog("fog", "FoG");
    /// The fibre-optic gyro less the Earth's rate at the place's latitude.
    pub const FOG_EARTH: Self = fog("fog_earth", "FoG less Earth rate");
    /// The fibre-optic gyro as the board sends it by default: less the Earth's rate, and less the bias that it has shown
    /// at standstills.
    pub const FOG_DEFAULT: Self = fog("fog_default", "FoG, default lane");
    /// FoGNet on the rate of [`Method::GYRONET_LOOP`], in the place of a fibre-optic gyro: the paper's future work.
    /// FoGNet was not trained on such rates.
    pub const PSEUDO_FOG: Self = mems("pseudo_fog", "FoGNet on GyroNet's rate");
    /// FoGNet, its first minute padded.
    pub const FOGNET: Self = fog("fognet", "FoGNet");
    /// FoGNet, its first minute uncorrected.
    pub const FOGNET_NOPAD: Self = fog("fognet_nopad", "FoGNet, no padding");

    /// The methods of one drive, in the order of its table.
    pub const ON_A_DRIVE: [Self; 12] = [
        Self::RAW,
        Self::STATIC,
        Self::FIR,
        Self::NEWEST,
        Self::MIDDLE,
        Self::GYRONET_F32,
        Self::GYRONET_INT,
        Self::LINEAR,
        Self::LINEAR_PROMPT,
        Self::LINEAR_NAVIGATION,
        Self::PROMPT,
        Self::NAVIGATION,
    ];
}

/// A value for each method of a drive.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PerMethod<T>([T; Method::ON_A_DRIVE.len()]);

impl<T> PerMethod<T> {
    /// Computes a value for each method.
    pub fn new(of: impl FnMut(Method) -> T) -> Self {
        Self(Method::ON_A_DRIVE.map(of))
    }

    /// Returns the methods and their values in the order of the table.
    pub fn each(&self) -> impl Iterator<Item = (Method, &T)> {
        Method::ON_A_DRIVE.into_iter().zip(&self.0)
    }

    /// Converts every value.
    pub fn map<U>(&self, mut of: impl FnMut(&T) -> U) -> PerMethod<U> {
        PerMethod::new(|method| of(&self[method]))
    }
}

impl<T: Copy> PerMethod<Option<T>> {
    /// Returns all values, or `None` where one is missing.
    pub fn all(self) -> Option<PerMethod<T>> {
        let values: Option<Vec<T>> = self.0.into_iter().collect();
        values?.try_into().ok().map(PerMethod)
    }
}

impl<T> std::ops::Index<Method> for PerMethod<T> {
    type Output = T;

    fn index(&self, method: Method) -> &T {
        let at = Method::ON_A_DRIVE.iter().position(|own| *own == method);
        &self.0[at.unwrap_or_else(|| panic!("{} is no method of a drive", method.key))]
    }
}

impl<T: Serialize> Serialize for PerMethod<T> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut map = serializer.serialize_map(Some(Method::ON_A_DRIVE.len()))?;
        for (method, value) in self.each() {
            map.serialize_entry(method.key, value)?;
        }
        map.end()
    }
}

/// The default, with estimates chosen in this way.
#[must_use]
pub fn with_mode(mode: Mode) -> PipelineConfig {
    let compensate = CompensateConfig { mode, ..CompensateConfig::DEFAULT };
    PipelineConfig { compensate, ..PipelineConfig::DEFAULT }
}

/// Yaw rates of one drive by each method, from the first sample after static initialisation.
#[derive(Debug, Clone)]
pub struct Rates {
    /// Time of each sample since the recording's first, s.
    pub seconds: Vec<f64>,
    /// rad/s.
    pub rates: PerMethod<Vec<f64>>,
    /// The true yaw rate, rad/s; `None` where a sample has none.
    pub reference: Option<Vec<f64>>,
    /// The drive as the board would run it.
    pub drive: Replay,
    /// The run time on this machine.
    pub run_time: Duration,
}

/// Number of times that [`Rates::new`] goes through a recording.
pub const RUNS: usize = 5;

impl Rates {
    /// Runs every method. All networks go through the very same pipeline. `tick` is called
    /// [`RUNS`] times for each row.
    ///
    /// # Errors
    /// [`ReplayError`], when static initialisation does not succeed.
    pub fn new(
        recording: &Recording,
        float: &mut impl WindowNetwork,
        integer: &mut impl WindowNetwork,
        linear: &mut impl WindowNetwork,
        mut tick: impl FnMut(),
    ) -> Result<Self, ReplayError> {
        let start = Instant::now();
        let drive = Replay::run(
            recording,
            &PipelineConfig::DEFAULT,
            WheelFrames::new(recording),
            integer,
            &mut tick,
        )?;
        let run_time = start.elapsed();
        let float =
            Replay::run(recording, &PipelineConfig::DEFAULT, WheelFrames::new(recording), float, &mut tick)?;
        let linear =
            Replay::run(recording, &PipelineConfig::DEFAULT, WheelFrames::new(recording), linear, &mut tick)?;
        let newest = Replay::run(
            recording,
            &with_mode(Mode::Newest),
            WheelFrames::new(recording),
            integer,
            &mut tick,
        )?;
        let middle = Replay::run(
            recording,
            &with_mode(Mode::Middle),
            WheelFrames::new(recording),
            integer,
            &mut tick,
        )?;
        let compared = || drive.steps[drive.compared()].iter();
        let [.., bias] = drive.gyro_bias;
        let gyro = |row: usize| yaw_rate(&recording.rows[row].sample);
        // A filter starts with the recording.
        let raw: Vec<f64> = drive.steps.iter().map(|step| gyro(step.row)).collect();
        let filtered = fir::filter(&fir::Design::PAPER.taps(), &raw);
        let settled = |drive: &Replay| drive.settled().map(|rate| rate.rad_per_sec()).collect();
        let prompt = |drive: &Replay| {
            drive.steps[drive.compared()].iter().map(|step| step.vehicle.prompt.rate.rad_per_sec()).collect()
        };
        let navigation =
            |drive: &Replay| drive.navigation().map(|rate| rate.rate.rad_per_sec()).collect::<Vec<f64>>();
        let rates = PerMethod::new(|method| match method {
            Method::RAW => compared().map(|step| gyro(step.row)).collect(),
            Method::STATIC => compared().map(|step| gyro(step.row) - bias.rad_per_sec()).collect(),
            Method::FIR => filtered[drive.compared()].to_vec(),
            Method::NEWEST => settled(&newest),
            Method::MIDDLE => settled(&middle),
            Method::GYRONET_F32 => settled(&float),
            Method::GYRONET_INT => settled(&drive),
            Method::LINEAR => settled(&linear),
            Method::LINEAR_PROMPT => prompt(&linear),
            Method::LINEAR_NAVIGATION => navigation(&linear),
            Method::PROMPT => prompt(&drive),
            // Method::NAVIGATION, the last one.
            _ => navigation(&drive),
        });
        let first = recording.rows.first().map_or(0, |row| row.sample.time.0);
        let seconds = compared().map(|step| (step.time.0 - first) as f64 * 1e-6).collect();
        let reference = compared().map(|step| recording.rows[step.row].reference).collect();
        Ok(Self { seconds, rates, reference, drive, run_time })
    }
}

fn yaw_rate(sample: &ImuSample) -> f64 {
    let [.., z] = sample.angular_rate;
    z.rad_per_sec()
}
