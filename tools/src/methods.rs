//! The ways of getting a yaw rate that are compared with each other.

use crate::drive::{Drive, DriveError, Step};
use crate::fir;
use crate::recording::Recording;
use gyronet::model::WindowNetwork;
use gyronet::sample::ImuSample;
use serde::Serialize;

/// One thing for each method.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct PerMethod<T> {
    /// The gyro as it is.
    pub raw: T,
    /// The gyro less its mean over the first 3 s.
    #[serde(rename = "static")]
    pub static_init: T,
    /// The gyro through a low-pass ([`crate::fir`]).
    pub fir: T,
    /// Static initialisation and GyroNet in f32: the mean of both windows over each sample,
    /// which is known 110 ms later.
    pub gyronet_f32: T,
    /// The same in integers.
    pub gyronet_int: T,
    /// What the board sends at once, with the integer network.
    pub default: T,
}

/// Names of the methods, for people.
pub const NAMES: PerMethod<&str> = PerMethod {
    raw: "raw gyro",
    static_init: "static initialisation",
    fir: "FIR 10/15 Hz",
    gyronet_f32: "GyroNet f32",
    gyronet_int: "GyroNet integer",
    default: "sent on CAN at once",
};

impl<T> PerMethod<T> {
    /// In the order of the table.
    pub fn each(&self) -> [&T; 6] {
        [&self.raw, &self.static_init, &self.fir, &self.gyronet_f32, &self.gyronet_int, &self.default]
    }

    /// From the order of the table.
    pub fn from_each([raw, static_init, fir, gyronet_f32, gyronet_int, default]: [T; 6]) -> Self {
        Self { raw, static_init, fir, gyronet_f32, gyronet_int, default }
    }

    /// The same of every method.
    pub fn map<U>(&self, of: impl FnMut(&T) -> U) -> PerMethod<U> {
        PerMethod::from_each(self.each().map(of))
    }
}

impl<T> PerMethod<Option<T>> {
    /// All, or nothing where one is missing.
    pub fn all(self) -> Option<PerMethod<T>> {
        let Self { raw, static_init, fir, gyronet_f32, gyronet_int, default } = self;
        Some(PerMethod {
            raw: raw?,
            static_init: static_init?,
            fir: fir?,
            gyronet_f32: gyronet_f32?,
            gyronet_int: gyronet_int?,
            default: default?,
        })
    }
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
}

impl Rates {
    /// Runs every method. Both networks go through the very same pipeline. `tick` is called
    /// twice for each row.
    ///
    /// # Errors
    /// [`DriveError`], when static initialisation does not succeed.
    pub fn new(
        recording: &Recording,
        float: &mut impl WindowNetwork,
        integer: &mut impl WindowNetwork,
        mut tick: impl FnMut(),
    ) -> Result<Self, DriveError> {
        let drive = Drive::run(recording, integer, &mut tick)?;
        let float = Drive::run(recording, float, &mut tick)?;
        let rows = || drive.steps.iter().map(|step| &recording.rows[step.row]);
        let [.., bias] = drive.gyro_bias;
        let raw: Vec<f64> = rows().map(|row| yaw_rate(&row.sample)).collect();
        let from_start = |rates: &[f64]| rates[drive.start..].to_vec();
        let settled = |drive: &Drive| {
            let rate = |step: &Step| yaw_rate(&recording.rows[step.row].sample) - bias.rad_per_sec();
            let steps = drive.steps[drive.start..].iter();
            steps.map(|step| rate(step) - step.settled.rad_per_sec()).collect()
        };
        let rates = PerMethod {
            raw: from_start(&raw),
            static_init: raw[drive.start..].iter().map(|rate| rate - bias.rad_per_sec()).collect(),
            fir: from_start(&fir::filter(&fir::Design::PAPER.taps(), &raw)),
            gyronet_f32: settled(&float),
            gyronet_int: settled(&drive),
            default: drive.steps[drive.start..].iter().map(|s| s.yaw_rate.rate.rad_per_sec()).collect(),
        };
        let first = recording.rows.first().map_or(0, |row| row.sample.time.0);
        let seconds = drive.steps[drive.start..].iter().map(|s| (s.time.0 - first) as f64 * 1e-6).collect();
        let reference = rows().skip(drive.start).map(|row| row.reference).collect();
        Ok(Self { seconds, rates, reference, drive })
    }
}

fn yaw_rate(sample: &ImuSample) -> f64 {
    let [.., z] = sample.angular_rate;
    z.rad_per_sec()
}
