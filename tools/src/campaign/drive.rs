//! This module prepares the drives that faults are injected into, as readings of undamaged sensors, row by row.

use crate::drive::recording::Recording;
use crate::drive::wheel_frames::WheelFrames;
use gyronet::sample::{ImuSample, PERIOD_US, WHEELS};
use gyronet::units::{AngularRate, Micros};

/// Board time of the grid step before the first row, microseconds.
pub const START_US: u64 = 1_000_000;

/// Holds the undamaged measurements of one row.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reading {
    /// The sample of the part, stamped with the row's time by the board's clock.
    pub sample: ImuSample,
    /// The time at which its bytes arrive, microseconds of the board's clock.
    pub at: u64,
    /// The rates of a fibre-optic gyro beside the part, equal to the reference where there is one.
    pub fog: [AngularRate; 3],
    /// Says whether the fibre-optic gyro has no noise and repeats its readings.
    pub fog_stuck: bool,
    /// The error of the part's time stamp, microseconds.
    pub stamp_us: i64,
    /// The saturated axes: gyro, then accelerometer.
    pub saturated: [bool; 6],
    /// An axis that sends no valid number, and the form of the value that it sends instead.
    pub no_number: Option<(usize, usize)>,
    /// The speed of each wheel, km/h.
    pub wheels: [Option<f64>; WHEELS],
}

/// Holds a drive on a grid without gaps.
#[derive(Debug, Clone)]
pub struct Drive {
    /// The name in tables.
    pub name: String,
    /// The readings of undamaged sensors.
    pub readings: Vec<Reading>,
    /// The true yaw up to and including each row, rad.
    pub truth: Option<Vec<f64>>,
}

impl Drive {
    /// Converts a recording. Its time stamps are moved to the nearest grid step, because jitter is a fault and the
    /// campaign adds the faults.
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
