//! This module runs a recorded drive through the coprocessor. The board runs the same code, so the frames are those
//! that the board would send.

use crate::drive::candump::Log;
use crate::drive::recording::Recording;
use crate::drive::wheel_frames::{self, WheelFrames};
use gyronet::bias::StaticError;
use gyronet::coprocessor::{Clock, Config, Coprocessor, TimedFrame};
use gyronet::estimate::{VehicleSample, YawEstimate};
use gyronet::health::{Counters, Status};
use gyronet::model::WindowNetwork;
use gyronet::pipeline::PipelineConfig;
use gyronet::sample::Standstill;
use gyronet::units::{AngularRate, Micros, Yaw};
use std::io::{self, Write};
use std::ops::Range;

/// Period at which the replayed board polls its inputs, microseconds.
const LOOK_US: u64 = 1_000;
/// Longest part of a gap in which the board's messages about a silent sensor are replayed, microseconds; the rest of
/// the gap is skipped.
const SILENCE_US: u64 = 60_000_000;

/// The reason why a recording cannot be replayed.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ReplayError {
    /// The vehicle does not stand still during static initialisation.
    #[error("{path}: starts moving: line {line}: {source}")]
    StartsMoving {
        /// The recording.
        path: String,
        /// The line at which the three seconds ended.
        line: u64,
        /// The check that failed.
        source: StaticError,
    },
    /// The recording has no three seconds without a gap.
    #[error("{path}: never holds 3 s without a gap, so static initialisation cannot finish")]
    NeverInitialised {
        /// The recording.
        path: String,
    },
}

/// The results of one row.
#[derive(Debug, Clone, PartialEq)]
pub struct Step {
    /// Index of the row in the recording.
    pub row: usize,
    /// The sample's time stamp.
    pub time: Micros,
    /// Whether the vehicle stands, by its wheels.
    pub standstill: Standstill,
    /// The estimates that were sent with this row.
    pub vehicle: VehicleSample,
    /// The navigation rate of this row's sample, which is sent some samples later; `None` during static
    /// initialisation and for the last samples of the drive.
    pub navigation: Option<YawEstimate>,
    /// The gyro less static bias less the network's settled estimate, which is known some samples later; the prompt
    /// rate if there is no settled estimate.
    pub settled: AngularRate,
    /// The frames that were sent with this row, and those sent while the sensor was silent after it.
    pub frames: Vec<TimedFrame>,
}

/// A drive with its corrected yaw rates.
#[derive(Debug, Clone)]
pub struct Replay {
    /// One step for each row that has a place on the grid.
    pub steps: Vec<Step>,
    /// The first step after static initialisation.
    pub start: usize,
    /// The gyro's static bias.
    pub gyro_bias: [AngularRate; 3],
    /// The carry of the navigation rates at the end: yaw that has not been sent yet.
    pub owed: Yaw,
    /// The event counters of the pipeline.
    pub counters: Counters,
    /// Number of messages that reported "failed" because a value did not fit its signal.
    pub out_of_range: u32,
}

impl Replay {
    /// Replays a recording; the estimate of each window is delivered without delay. `tick` is called for each row.
    /// `wheels` replaces the vehicle's bus.
    ///
    /// # Errors
    /// [`ReplayError`], if static initialisation does not succeed at its first attempt.
    pub fn run(
        recording: &Recording,
        config: &PipelineConfig,
        mut wheels: Option<WheelFrames>,
        network: &mut impl WindowNetwork,
        mut tick: impl FnMut(),
    ) -> Result<Self, ReplayError> {
        let mut coprocessor = Coprocessor::new(Config {
            pipeline: *config,
            wheels: wheels.as_ref().map(|_| wheel_frames::receiver()),
            clock: Clock::Sensor,
            ..Config::DEFAULT
        });
        let mut steps: Vec<Step> = Vec::with_capacity(recording.rows.len());
        let (mut start, mut now) = (None, Micros(0));
        for (index, row) in recording.rows.iter().enumerate() {
            tick();
            let time = row.sample.time;
            if let Some(last) = steps.last_mut() {
                let until = time.0.min(now.0 + SILENCE_US);
                for look in (now.0 + LOOK_US..until).step_by(LOOK_US as usize) {
                    // Time advances to this row; messages about a silent sensor precede the messages of this row.
                    let _ = coprocessor.poll(Micros(look), &mut |frame: TimedFrame| last.frames.push(frame));
                }
            }
            now = now.max(time);
            if let Some(frame) = wheels.as_mut().and_then(|wheels| wheels.next(row)) {
                // A speed that does not fit the frame is counted as not valid.
                let _ = coprocessor.can(&frame, now);
            }
            // A row whose time stamp does not fit the grid gives no frame and is counted.
            let mut frames = Vec::new();
            let sent = coprocessor.imu(row.sample, now, &mut |frame: TimedFrame| frames.push(frame));
            let Ok(observation) = sent else { continue };
            if let Some(source) = observation.refused {
                let path = recording.path.clone();
                return Err(ReplayError::StartsMoving { path, line: row.line, source });
            }
            if let Some(window) = coprocessor.window() {
                let estimate = network.estimate(&window.features);
                coprocessor.deliver(window.end, estimate).expect("the window that is due");
            }
            let vehicle = observation.vehicle;
            if start.is_none() && vehicle.prompt.status != Status::Init {
                start = Some(steps.len());
            }
            let settled = vehicle.prompt.rate;
            let standstill = observation.wheels.standstill;
            steps.push(Step { row: index, time, standstill, vehicle, navigation: None, settled, frames });
            if vehicle.navigation.status != Status::Init
                && let Some(step) = earlier(&mut steps, vehicle.navigation.tick)
            {
                step.navigation = Some(vehicle.navigation);
            }
            if let Some(settled) = observation.settled
                && let Some(step) = earlier(&mut steps, settled.tick)
            {
                step.settled = AngularRate(settled.rate.0.saturating_sub(settled.correction.0));
            }
        }
        let pipeline = coprocessor.pipeline();
        let gyro_bias = pipeline
            .gyro_bias()
            .ok_or_else(|| ReplayError::NeverInitialised { path: recording.path.clone() })?;
        let start = start.unwrap_or(steps.len());
        let (owed, counters) = (pipeline.owed().navigation, *pipeline.counters());
        let out_of_range = coprocessor.input_counters().out_of_range;
        Ok(Self { steps, start, gyro_bias, owed, counters, out_of_range })
    }

    /// Returns the range of the steps that have a navigation rate: from the end of static initialisation on.
    #[must_use]
    pub fn compared(&self) -> Range<usize> {
        let sent = self.steps[self.start..].iter().take_while(|step| step.navigation.is_some()).count();
        self.start..self.start + sent
    }

    /// Returns the navigation rates of the compared steps.
    pub fn navigation(&self) -> impl Iterator<Item = YawEstimate> {
        self.steps[self.compared()].iter().filter_map(|step| step.navigation)
    }

    /// Returns the settled rates of the compared steps ([`Step::settled`]).
    pub fn settled(&self) -> impl Iterator<Item = AngularRate> {
        self.steps[self.compared()].iter().map(|step| step.settled)
    }

    /// Returns the frames of the whole drive.
    pub fn frames(&self) -> impl Iterator<Item = &TimedFrame> {
        self.steps.iter().flat_map(|step| &step.frames)
    }

    /// Writes the frames of the whole drive as a candump log, and returns their number.
    ///
    /// # Errors
    /// The writer's error.
    pub fn log(&self, out: impl Write) -> io::Result<u64> {
        let mut log = Log::new(out);
        for TimedFrame { frame, time } in self.frames() {
            log.frame(*time, frame)?;
        }
        log.finish()
    }

    /// Returns the number of steps with each status.
    #[must_use]
    pub fn status_counts(&self) -> [(Status, usize); 4] {
        [Status::Init, Status::Degraded, Status::Ready, Status::Clipped].map(|status| {
            (status, self.steps.iter().filter(|step| step.vehicle.prompt.status == status).count())
        })
    }
}

/// Returns the step of a recent sample.
fn earlier(steps: &mut [Step], tick: u32) -> Option<&mut Step> {
    steps.iter_mut().rev().find(|step| step.vehicle.prompt.tick == tick)
}

#[cfg(test)]
mod tests {
    use super::*;
    use gyronet::model::window::{Features, WINDOW};
    use gyronet::model::{Estimate, SCALE_MIN};
    use std::fmt::Write;

    /// A network that always estimates a gyro error of 100 codes.
    struct Constant;

    impl WindowNetwork for Constant {
        fn estimate(&mut self, _window: &[Features; WINDOW]) -> Estimate {
            Estimate { corrections: [AngularRate(100); WINDOW], scale: SCALE_MIN, ..Estimate::NONE }
        }
    }

    fn recording(rows: usize, yaw_rate: impl Fn(usize) -> f64, gap_at: usize) -> Recording {
        let mut text = String::from("t_s,acc_x,acc_y,acc_z,gyr_x,gyr_y,gyr_z\n");
        for k in 0..rows {
            let time = 0.01 * (k + usize::from(k >= gap_at)) as f64;
            // Every axis varies as a sensor's does, with mean zero over three rows: equal readings count as stuck.
            let noise = ((k % 3) as f64 - 1.0) / 8_192.0;
            let yaw_rate = yaw_rate(k) + noise;
            writeln!(text, "{time:.2},{noise},{noise},{},{noise},{noise},{yaw_rate}", 9.8 + 10.0 * noise)
                .unwrap();
        }
        Recording::parse("a.csv", text.as_bytes()).unwrap()
    }

    #[test]
    fn the_first_three_seconds_initialise() {
        let recording = recording(1_000, |_| 0.01, usize::MAX);
        let mut ticks = 0;
        // The vehicle never moves, so zero-rate updates would undo the correction.
        let config = PipelineConfig { zero_rate: None, ..PipelineConfig::DEFAULT };
        let drive = Replay::run(&recording, &config, None, &mut Constant, || ticks += 1).unwrap();
        assert_eq!((drive.steps.len(), drive.start, ticks), (1_000, 300, 1_000));
        assert_eq!(drive.gyro_bias[2], recording.rows[1].sample.angular_rate[2]);
        // The constant part of the corrections is removed.
        let sent: i64 = drive.navigation().map(|rate| i64::from(rate.rate.0)).sum();
        assert_eq!((drive.compared(), sent), (300..993, 0));
        // What remains is the variation of the last seven samples.
        assert_eq!(drive.owed, Yaw(-(1 << 14)));
        let [(_, init), (_, degraded), (_, ready), (_, clipped)] = drive.status_counts();
        assert_eq!((init, clipped), (300, 0));
        assert_eq!(degraded + ready, 700);
        assert!(degraded < 20, "{degraded}");
    }

    #[test]
    fn a_gap_is_no_error() {
        let recording = recording(1_000, |_| 0.01, 700);
        let drive = Replay::run(&recording, &PipelineConfig::DEFAULT, None, &mut Constant, || {}).unwrap();
        assert_eq!((drive.counters.missing, recording.missing), (1, 1));
    }

    #[test]
    fn silence_in_a_gap_is_reported_as_the_board_does() {
        // Row 700 arrives 100 ms after row 699: message sets without a rate from 25 ms after the last sample on,
        // every 10 ms.
        let mut recording = recording(1_000, |_| 0.01, usize::MAX);
        for row in &mut recording.rows[700..] {
            row.sample.time.0 += 90_000;
        }
        let drive = Replay::run(&recording, &PipelineConfig::DEFAULT, None, &mut Constant, || {}).unwrap();
        let frames = |row: usize| drive.steps[row].frames.len();
        let set = frames(600);
        let sets = frames(699) / set;
        assert!((8..=9).contains(&sets) && frames(699).is_multiple_of(set), "{sets} sets");
        assert!(drive.steps.iter().enumerate().all(|(row, _)| row == 699 || frames(row) == set));
    }

    #[test]
    fn starting_in_a_turn_is_refused() {
        let recording = recording(1_000, |k| 0.001 * k as f64, usize::MAX);
        let error =
            Replay::run(&recording, &PipelineConfig::DEFAULT, None, &mut Constant, || {}).unwrap_err();
        assert!(matches!(error, ReplayError::StartsMoving { line: 301, .. }), "{error:?}");
        assert!(error.to_string().starts_with("a.csv: starts moving: line 301: "), "{error}");
    }

    #[test]
    fn never_three_seconds_whole() {
        let recording = recording(400, |_| 0.01, 200);
        let error =
            Replay::run(&recording, &PipelineConfig::DEFAULT, None, &mut Constant, || {}).unwrap_err();
        assert_eq!(error, ReplayError::NeverInitialised { path: "a.csv".into() });
    }
}
