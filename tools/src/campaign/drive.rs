//! Drives to do faults to: what undamaged sensors say, row by row.

use crate::drive::recording::Recording;
use crate::drive::wheel_frames::WheelFrames;
use gyronet::sample::{ImuSample, PERIOD_US, WHEELS};
use gyronet::units::{AngularRate, Micros};

/// Board time of the step before the first row, microseconds.
pub const START_US: u64 = 1_000_000;

/// What is measured in one row.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reading {
    /// What the part measures; its time is the row's by the board's clock.
    pub sample: ImuSample,
    /// When its bytes come, microseconds of the board's clock.
    pub at: u64,
    /// What a fibre-optic gyro beside the part measures: the reference where there is one.
    pub fog: [AngularRate; 3],
    /// The fibre-optic gyro repeats itself: it has no noise.
    pub fog_stuck: bool,
    /// What the part's time stamp is off by, microseconds.
    pub stamp_us: i64,
    /// Axes beyond the range: gyro, accelerometer.
    pub saturated: [bool; 6],
    /// An axis without a number, and the form of it.
    pub no_number: Option<(usize, usize)>,
    /// Speed of each wheel, km/h.
    pub wheels: [Option<f64>; WHEELS],
}

/// A drive on a whole grid.
#[derive(Debug, Clone)]
pub struct Drive {
    /// For tables.
    pub name: String,
    /// What undamaged sensors say.
    pub readings: Vec<Reading>,
    /// The true yaw turned up to and with each row, rad.
    pub truth: Option<Vec<f64>>,
}

impl Drive {
    /// From a recording. Its time stamps go to the nearest grid step: jitter is a fault, and those
    /// come from the campaign.
    #[must_use]
    pub fn new(recording: &Recording) -> Self {
        let mut readings = Vec::with_capacity(recording.rows.len());
        let (mut at, mut last) = (START_US, None);
        let mut frames = WheelFrames::new(recording);
        for row in &recording.rows {
            let time = row.sample.time.0;
            let steps = last.map_or(1, |last| (time - last + PERIOD_US / 2) / PERIOD_US);
            at += steps.max(1) * PERIOD_US;
            last = Some(time);
            let wheels = frames.as_mut().map_or([None; WHEELS], |frames| frames.speeds(row));
            let sample = ImuSample { time: Micros(at), ..row.sample };
            let mut fog = sample.angular_rate;
            if let Some(reference) =
                row.reference.and_then(|rate| AngularRate::from_rad_per_sec(rate as f32).ok())
            {
                fog[2] = reference;
            }
            readings.push(Reading {
                sample,
                at,
                fog,
                fog_stuck: false,
                stamp_us: 0,
                saturated: [false; 6],
                no_number: None,
                wheels,
            });
        }
        let rates: Option<Vec<f64>> = recording.rows.iter().map(|row| row.reference).collect();
        let truth = rates.map(|rates| {
            let turned = rates.iter().scan(0.0, |yaw, rate| {
                *yaw += rate * PERIOD_US as f64 * 1e-6;
                Some(*yaw)
            });
            turned.collect()
        });
        Self { name: recording.name().to_owned(), readings, truth }
    }
}
