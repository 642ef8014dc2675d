//! The ways of getting a yaw rate that are compared with each other.

use crate::drive::recording::Recording;
use crate::drive::replay::{Drive, DriveError};
use crate::drive::wheel_frames::WheelFrames;
use crate::evaluate::fir;
use gyronet::compensate::{CompensateConfig, Mode};
use gyronet::model::WindowNetwork;
use gyronet::pipeline::PipelineConfig;
use gyronet::sample::ImuSample;
use serde::ser::{Serialize, SerializeMap, Serializer};
use std::time::{Duration, Instant};

/// One way.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Method {
    /// The gyro as it is.
    Raw,
    /// The gyro less its mean over the first 3 s.
    Static,
    /// The gyro through a low-pass ([`crate::evaluate::fir`]).
    Fir,
    /// Static initialisation and the newest output of a window every sample.
    Newest,
    /// Static initialisation and the middle outputs of a window every five samples.
    Middle,
    /// Static initialisation and GyroNet in f32: the mean of both windows over each sample,
    /// which is known 110 ms later.
    GyronetF32,
    /// The same in integers.
    GyronetInt,
    /// What the board sends at once: Bosch TX1, VDC2.
    Prompt,
    /// What the board sends in its own yaw messages, some samples later.
    Default,
}

impl Method {
    /// In the order of the table.
    pub const ALL: [Self; 9] = [
        Self::Raw,
        Self::Static,
        Self::Fir,
        Self::Newest,
        Self::Middle,
        Self::GyronetF32,
        Self::GyronetInt,
        Self::Prompt,
        Self::Default,
    ];

    /// For people.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Raw => "raw gyro",
            Self::Static => "static initialisation",
            Self::Fir => "FIR 10/15 Hz",
            Self::Newest => "newest output",
            Self::Middle => "middle outputs",
            Self::GyronetF32 => "overlap f32",
            Self::GyronetInt => "overlap integer",
            Self::Prompt => "sent at once",
            Self::Default => "sent for navigation",
        }
    }

    /// For programs.
    #[must_use]
    pub fn key(self) -> &'static str {
        match self {
            Self::Raw => "raw",
            Self::Static => "static",
            Self::Fir => "fir",
            Self::Newest => "newest",
            Self::Middle => "middle",
            Self::GyronetF32 => "gyronet_f32",
            Self::GyronetInt => "gyronet_int",
            Self::Prompt => "prompt",
            Self::Default => "default",
        }
    }
}

/// One thing for each method.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PerMethod<T>([T; Method::ALL.len()]);

impl<T> PerMethod<T> {
    /// One for each.
    pub fn new(of: impl FnMut(Method) -> T) -> Self {
        Self(Method::ALL.map(of))
    }

    /// In the order of the table.
    pub fn each(&self) -> impl Iterator<Item = (Method, &T)> {
        Method::ALL.into_iter().zip(&self.0)
    }

    /// The same of every method.
    pub fn map<U>(&self, mut of: impl FnMut(&T) -> U) -> PerMethod<U> {
        PerMethod::new(|method| of(&self[method]))
    }
}

impl<T: Copy> PerMethod<Option<T>> {
    /// All, or nothing where one is missing.
    pub fn all(self) -> Option<PerMethod<T>> {
        let values: Option<Vec<T>> = self.0.into_iter().collect();
        values?.try_into().ok().map(PerMethod)
    }
}

impl<T> std::ops::Index<Method> for PerMethod<T> {
    type Output = T;

    fn index(&self, method: Method) -> &T {
        // The order of `ALL` is that of the variants.
        &self.0[method as usize]
    }
}

impl<T: Serialize> Serialize for PerMethod<T> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut map = serializer.serialize_map(Some(Method::ALL.len()))?;
        for (method, value) in self.each() {
            map.serialize_entry(method.key(), value)?;
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
    pub drive: Drive,
    /// What that run took on this machine.
    pub run_time: Duration,
}

/// How often [`Rates::new`] goes through a recording.
pub const RUNS: usize = 4;

impl Rates {
    /// Runs every method. All networks go through the very same pipeline. `tick` is called
    /// [`RUNS`] times for each row.
    ///
    /// # Errors
    /// [`DriveError`], when static initialisation does not succeed.
    pub fn new(
        recording: &Recording,
        float: &mut impl WindowNetwork,
        integer: &mut impl WindowNetwork,
        mut tick: impl FnMut(),
    ) -> Result<Self, DriveError> {
        let start = Instant::now();
        let drive =
            Drive::run(recording, &PipelineConfig::DEFAULT, WheelFrames::new(recording), integer, &mut tick)?;
        let run_time = start.elapsed();
        let float =
            Drive::run(recording, &PipelineConfig::DEFAULT, WheelFrames::new(recording), float, &mut tick)?;
        let newest =
            Drive::run(recording, &with_mode(Mode::Newest), WheelFrames::new(recording), integer, &mut tick)?;
        let middle =
            Drive::run(recording, &with_mode(Mode::Middle), WheelFrames::new(recording), integer, &mut tick)?;
        let compared = || drive.steps[drive.compared()].iter();
        let [.., bias] = drive.gyro_bias;
        let gyro = |row: usize| yaw_rate(&recording.rows[row].sample);
        // A filter starts with the recording.
        let raw: Vec<f64> = drive.steps.iter().map(|step| gyro(step.row)).collect();
        let filtered = fir::filter(&fir::Design::PAPER.taps(), &raw);
        let settled = |drive: &Drive| drive.settled().map(|rate| rate.rad_per_sec()).collect();
        let rates = PerMethod::new(|method| match method {
            Method::Raw => compared().map(|step| gyro(step.row)).collect(),
            Method::Static => compared().map(|step| gyro(step.row) - bias.rad_per_sec()).collect(),
            Method::Fir => filtered[drive.compared()].to_vec(),
            Method::Newest => settled(&newest),
            Method::Middle => settled(&middle),
            Method::GyronetF32 => settled(&float),
            Method::GyronetInt => settled(&drive),
            Method::Prompt => compared().map(|step| step.vehicle.prompt.rate.rad_per_sec()).collect(),
            Method::Default => drive.navigation().map(|rate| rate.rate.rad_per_sec()).collect(),
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
