//! A recording through the pipeline, as the board would run it.

use crate::candump::Log;
use crate::recording::Recording;
use crate::wheel_rates::WheelRates;
use gyronet::bias::StaticError;
use gyronet::can::DataFrame;
use gyronet::can::feeds::Feeds;
use gyronet::health::{Counters, Status};
use gyronet::model::WindowNetwork;
use gyronet::pipeline::{Output, Pipeline, PipelineConfig, YawRate};
use gyronet::units::{AngularRate, Micros, Yaw};
use gyronet::vehicle::VehicleSample;
use std::io::{self, Write};
use std::ops::Range;

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
    /// Its rate, as sent at once.
    pub prompt: YawRate,
    /// Its rate, as sent for navigation some samples later; `None` before static initialisation
    /// is over, and of the last samples, whose turn never came.
    pub navigation: Option<YawRate>,
    /// Gyro less static bias less the best estimate of the network, known some samples later;
    /// the prompt rate where no such came.
    pub settled: AngularRate,
    /// What the messages are made from that went out with this row.
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
    /// What the navigation rates still owe at the end.
    pub owed: Yaw,
    /// Events.
    pub counters: Counters,
}

impl Drive {
    /// Runs a recording; every window's estimate is delivered at once. `tick` is called once
    /// for each row. `wheels` stand in for the vehicle's bus.
    ///
    /// # Errors
    /// [`DriveError`], when static initialisation does not succeed at its first attempt.
    pub fn run(
        recording: &Recording,
        config: &PipelineConfig,
        mut wheels: Option<WheelRates>,
        network: &mut impl WindowNetwork,
        mut tick: impl FnMut(),
    ) -> Result<Self, DriveError> {
        let mut pipeline = Pipeline::new(*config);
        let mut steps: Vec<Step> = Vec::with_capacity(recording.rows.len());
        let mut start = None;
        for (index, row) in recording.rows.iter().enumerate() {
            tick();
            if let Some(wheels) = &mut wheels {
                pipeline.wheels(wheels.at(row));
            }
            // What has no place in time gives no frame; the pipeline has counted it.
            let Ok(output) = pipeline.process(row.sample) else { continue };
            if let Some(source) = output.refused {
                let path = recording.path.clone();
                return Err(DriveError::StartsMoving { path, line: row.line, source });
            }
            if let Some(window) = output.window {
                pipeline.deliver(window.end, network.estimate(&window.features));
            }
            let Output { prompt, navigation, settled, vehicle, .. } = output;
            if start.is_none() && prompt.status != Status::Init {
                start = Some(steps.len());
            }
            let (time, rate) = (row.sample.time, prompt.rate);
            steps.push(Step { row: index, time, prompt, navigation: None, settled: rate, vehicle });
            if navigation.status != Status::Init
                && let Some(step) = earlier(&mut steps, navigation.tick)
            {
                step.navigation = Some(navigation);
            }
            if let Some(settled) = settled
                && let Some(step) = earlier(&mut steps, settled.tick)
            {
                step.settled = AngularRate(settled.rate.0.saturating_sub(settled.correction.0));
            }
        }
        let gyro_bias = pipeline
            .gyro_bias()
            .ok_or_else(|| DriveError::NeverInitialised { path: recording.path.clone() })?;
        let start = start.unwrap_or(steps.len());
        Ok(Self { steps, start, gyro_bias, owed: pipeline.owed().navigation, counters: *pipeline.counters() })
    }

    /// The steps that have a navigation rate: from the end of static initialisation on.
    #[must_use]
    pub fn compared(&self) -> Range<usize> {
        let sent = self.steps[self.start..].iter().take_while(|step| step.navigation.is_some()).count();
        self.start..self.start + sent
    }

    /// The navigation rates of those.
    pub fn navigation(&self) -> impl Iterator<Item = YawRate> {
        self.steps[self.compared()].iter().filter_map(|step| step.navigation)
    }

    /// Gyro less static bias less the network's best estimate, of those.
    pub fn settled(&self) -> impl Iterator<Item = AngularRate> {
        self.steps[self.compared()].iter().map(|step| step.settled)
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
            .map(|status| (status, self.steps.iter().filter(|step| step.prompt.status == status).count()))
    }
}

/// The step of a sample, at most a few back.
fn earlier(steps: &mut [Step], tick: u32) -> Option<&mut Step> {
    steps.iter_mut().rev().find(|step| step.prompt.tick == tick)
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
        // Nothing ever moves here: zero-rate updates would take the correction back off.
        let config = PipelineConfig { zero_rate: None, ..PipelineConfig::DEFAULT };
        let drive = Drive::run(&recording, &config, None, &mut Constant, || ticks += 1).unwrap();
        assert_eq!((drive.steps.len(), drive.start, ticks), (1_000, 300, 1_000));
        assert_eq!(drive.gyro_bias[2], recording.rows[0].sample.angular_rate[2]);
        // Two estimates of 100 codes: all samples but the last, which no window has covered.
        let sent: i64 = drive.navigation().map(|rate| i64::from(rate.rate.0)).sum();
        assert_eq!((drive.compared(), sent), (300..993, -100 * 693));
        assert_eq!(drive.owed, Yaw(-100 * 7));
        let [(_, init), (_, degraded), (_, ready), (_, clipped)] = drive.status_counts();
        assert_eq!((init, clipped), (300, 0));
        assert_eq!(degraded + ready, 700);
        assert!(degraded < 20, "{degraded}");
    }

    #[test]
    fn a_gap_is_no_error() {
        let recording = recording(1_000, |_| 0.01, 700);
        let drive = Drive::run(&recording, &PipelineConfig::DEFAULT, None, &mut Constant, || {}).unwrap();
        assert_eq!((drive.counters.missing, recording.missing), (1, 1));
    }

    #[test]
    fn starting_in_a_turn_is_refused() {
        let recording = recording(1_000, |k| 0.001 * k as f64, usize::MAX);
        let error = Drive::run(&recording, &PipelineConfig::DEFAULT, None, &mut Constant, || {}).unwrap_err();
        assert!(matches!(error, DriveError::StartsMoving { line: 301, .. }), "{error:?}");
        assert!(error.to_string().starts_with("a.csv: starts moving: line 301: "), "{error}");
    }

    #[test]
    fn never_three_seconds_whole() {
        let recording = recording(400, |_| 0.01, 200);
        let error = Drive::run(&recording, &PipelineConfig::DEFAULT, None, &mut Constant, || {}).unwrap_err();
        assert_eq!(error, DriveError::NeverInitialised { path: "a.csv".into() });
    }
}
