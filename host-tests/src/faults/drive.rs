//! A drive as readings of undamaged sensors, row by row, on a grid without gaps.

use gyronet::sample::{ImuSample, PERIOD_US, WHEELS};
use gyronet::units::{AngularRate, Micros};
use gyronet_tools::drive::recording::Recording;
use gyronet_tools::drive::wheel_frames::WheelFrames;

/// Board time of the grid step before the first row, microseconds.
pub const START_US: u64 = 1_000_000;
/// The parts' clocks are ahead of the board's clock by this, microseconds.
const PART_EPOCH_US: u64 = 77_000_000;

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reading {
    /// Stamped with the row's time by the board's clock.
    pub sample: ImuSample,
    /// The time at which its bytes arrive, microseconds of the board's clock.
    pub at: u64,
    /// The rates of a fibre-optic gyro beside the part, equal to the reference where there is one.
    pub fog: [AngularRate; 3],
    /// The fibre-optic gyro has no noise and repeats its readings.
    pub fog_stuck: bool,
    /// What the part's clock shows when the board's starts, microseconds.
    pub epoch_us: u64,
    /// The error of the part's time stamp, microseconds.
    pub stamp_us: i64,
    /// Gyro, then accelerometer.
    pub saturated: [bool; 6],
    /// An axis that sends no valid number, and the form of the value that it sends instead.
    pub no_number: Option<(usize, usize)>,
    /// Speeds in km/h.
    pub wheels: [Option<f64>; WHEELS],
}

impl Reading {
    pub fn new(sample: ImuSample, wheels: [Option<f64>; WHEELS]) -> Self {
        let (at, fog) = (sample.time.0, sample.angular_rate);
        let (saturated, no_number) = ([false; 6], None);
        let epoch_us = PART_EPOCH_US;
        Self { sample, at, fog, fog_stuck: false, epoch_us, stamp_us: 0, saturated, no_number, wheels }
    }
}

#[derive(Debug, Clone)]
pub struct Drive {
    pub name: String,
    pub readings: Vec<Reading>,
    /// The true yaw up to and including each row, rad.
    pub truth: Option<Vec<f64>>,
}

impl Drive {
    /// Moves the time stamps of a recording to the nearest grid step, because jitter is a fault too.
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
            let mut reading = Reading::new(ImuSample { time: Micros(at), ..row.sample }, wheels);
            let reference = row.reference.and_then(|rate| AngularRate::from_rad_per_sec(rate as f32).ok());
            reading.fog[2] = reference.unwrap_or(reading.fog[2]);
            readings.push(reading);
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
