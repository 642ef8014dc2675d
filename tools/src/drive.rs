//! A recording through the pipeline, as the board would run it.

use crate::candump::Log;
use crate::recording::Recording;
use gyronet::bias::StaticError;
use gyronet::can::DataFrame;
use gyronet::can::feeds::Feeds;
use gyronet::health::{Counters, Status};
use gyronet::model::WindowNetwork;
use gyronet::pipeline::{Output, Pipeline, PipelineConfig, YawRate};
use gyronet::units::{AngularRate, Micros};
use gyronet::vehicle::VehicleSample;
use std::io::{self, Write};

/// Why a recording gives no corrected rate.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum DriveError {
    /// The vehicle does not stand still when static initialisation needs it to.
    #[error("{path}: starts moving: line {line}: {source}")]
    StartsMoving {
        /// The recording.
        path: String,
        /// The line with which the three seconds were over.
        line: u64,
        /// What gave it away.
        source: StaticError,
    },
    /// The recording ends before three seconds without a gap were seen.
    #[error("{path}: never holds 3 s without a gap, so static initialisation cannot finish")]
    NeverInitialised {
        /// The recording.
        path: String,
    },
}

/// What went out for one row.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Step {
    /// Index of the row in the recording.
    pub row: usize,
    /// The sample's time stamp.
    pub time: Micros,
    /// The corrected yaw rate.
    pub yaw_rate: YawRate,
    /// The best estimate of the correction, known some samples later; the one that went out
    /// where none came (after the last window, before a gap).
    pub settled: AngularRate,
    /// What the messages are made from.
    pub vehicle: VehicleSample,
}

/// A drive with its corrected yaw rate.
#[derive(Debug, Clone)]
pub struct Drive {
    /// One for each row that found its place in time.
    pub steps: Vec<Step>,
    /// The first step after static initialisation.
    pub start: usize,
    /// The gyro's static bias.
    pub gyro_bias: [AngularRate; 3],
    /// Events.
    pub counters: Counters,
}

impl Drive {
    /// Runs a recording; every window's estimate is delivered at once. `tick` is called once
    /// for each row.
    ///
    /// # Errors
    /// [`DriveError`], when static initialisation does not succeed at its first attempt.
    pub fn run(
        recording: &Recording,
        network: &mut impl WindowNetwork,
        mut tick: impl FnMut(),
    ) -> Result<Self, DriveError> {
        let mut pipeline = Pipeline::new(PipelineConfig::DEFAULT);
        let mut steps = Vec::with_capacity(recording.rows.len());
        let mut start = None;
        for (index, row) in recording.rows.iter().enumerate() {
            tick();
            // What has no place in time gives no frame; the pipeline has counted it.
            let Ok(output) = pipeline.process(row.sample) else { continue };
            if let Some(source) = output.refused {
                let path = recording.path.clone();
                return Err(DriveError::StartsMoving { path, line: row.line, source });
            }
            if let Some(window) = output.window {
                pipeline.deliver(window.end, network.estimate(&window.features));
            }
            if start.is_none() && output.yaw_rate.status != Status::Init {
                start = Some(steps.len());
            }
            let Output { yaw_rate, vehicle, .. } = output;
            let (time, settled) = (row.sample.time, yaw_rate.correction);
            steps.push(Step { row: index, time, yaw_rate, settled, vehicle });
            if let Some(settled) = output.settled {
                // It is at most a few steps back.
                let step = steps.iter_mut().rev().find(|step| step.yaw_rate.tick == settled.tick);
                step.into_iter().for_each(|step| step.settled = settled.correction);
            }
        }
        let gyro_bias = pipeline
            .gyro_bias()
            .ok_or_else(|| DriveError::NeverInitialised { path: recording.path.clone() })?;
        let start = start.unwrap_or(steps.len());
        Ok(Self { steps, start, gyro_bias, counters: *pipeline.counters() })
    }

    /// Writes the messages of the whole drive as a candump log, and says how many they are.
    ///
    /// # Errors
    /// What the writer says.
    pub fn log(&self, feeds: &mut Feeds, out: impl Write) -> io::Result<u64> {
        let mut log = Log::new(out);
        for step in &self.steps {
            for frame in feeds.process::<DataFrame>(&step.vehicle) {
                log.frame(step.time, &frame)?;
            }
        }
        log.finish()
    }

    /// How many steps had each status.
    #[must_use]
    pub fn status_counts(&self) -> [(Status, usize); 4] {
        [Status::Init, Status::Degraded, Status::Ready, Status::Clipped]
            .map(|status| (status, self.steps.iter().filter(|step| step.yaw_rate.status == status).count()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use gyronet::model::{Estimate, SCALE_MIN};
    use gyronet::window::{Features, WINDOW};
    use std::fmt::Write;

    /// Says that the gyro is always off by 100 codes.
    struct Constant;

    impl WindowNetwork for Constant {
        fn estimate(&mut self, _window: &[Features; WINDOW]) -> Estimate {
            Estimate { corrections: [AngularRate(100); WINDOW], scale: SCALE_MIN, clamped_inputs: 0 }
        }
    }

    fn recording(rows: usize, yaw_rate: impl Fn(usize) -> f64, gap_at: usize) -> Recording {
        let mut text = String::from("t_s,acc_x,acc_y,acc_z,gyr_x,gyr_y,gyr_z\n");
        for k in 0..rows {
            let time = 0.01 * (k + usize::from(k >= gap_at)) as f64;
            writeln!(text, "{time:.2},0,0,9.8,0,0,{}", yaw_rate(k)).unwrap();
        }
        Recording::parse("a.csv", text.as_bytes()).unwrap()
    }

    #[test]
    fn the_first_three_seconds_initialise() {
        let recording = recording(1_000, |_| 0.01, usize::MAX);
        let mut ticks = 0;
        let drive = Drive::run(&recording, &mut Constant, || ticks += 1).unwrap();
        assert_eq!((drive.steps.len(), drive.start, ticks), (1_000, 300, 1_000));
        assert_eq!(drive.gyro_bias[2], recording.rows[0].sample.angular_rate[2]);
        // Two estimates of 100 codes: what all samples owe is paid by the end.
        let owed: i64 = drive.steps[300..].iter().map(|step| i64::from(step.yaw_rate.rate.0)).sum();
        assert_eq!(owed, -100 * 700);
        let [(_, init), (_, degraded), (_, ready), (_, clipped)] = drive.status_counts();
        assert_eq!((init, clipped), (300, 0));
        assert_eq!(degraded + ready, 700);
        assert!(degraded < 20, "{degraded}");
    }

    #[test]
    fn a_gap_is_no_error() {
        let recording = recording(1_000, |_| 0.01, 700);
        let drive = Drive::run(&recording, &mut Constant, || {}).unwrap();
        assert_eq!((drive.counters.missing, recording.missing), (1, 1));
    }

    #[test]
    fn starting_in_a_turn_is_refused() {
        let recording = recording(1_000, |k| 0.001 * k as f64, usize::MAX);
        let error = Drive::run(&recording, &mut Constant, || {}).unwrap_err();
        assert!(matches!(error, DriveError::StartsMoving { line: 301, .. }), "{error:?}");
        assert!(error.to_string().starts_with("a.csv: starts moving: line 301: "), "{error}");
    }

    #[test]
    fn never_three_seconds_whole() {
        let recording = recording(400, |_| 0.01, 200);
        let error = Drive::run(&recording, &mut Constant, || {}).unwrap_err();
        assert_eq!(error, DriveError::NeverInitialised { path: "a.csv".into() });
    }
}
