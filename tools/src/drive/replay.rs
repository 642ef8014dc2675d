//! A recorded drive on the board, step by step ([`Steps`]) or as a whole ([`Replay`]).

pub use crate::board::Step;

use crate::board::{Board, Uncorrected};
use crate::drive::error::{DataError, DataFault};
use crate::drive::stream::{Drive, Recording, Rows};
use crate::drive::wheel_frames::WheelFrames;
use gyronet::coprocessor::Config;
use gyronet::estimate::YawEstimate;
use gyronet::model::WindowNetwork;
use gyronet::pipeline::PipelineConfig;
use gyronet::units::{AngularRate, Yaw};
use std::ops::Range;

pub struct Steps<'d, N> {
    path: &'d str,
    rows: std::iter::Fuse<Rows<'d>>,
    board: Board<N>,
}

impl<'d, N: WindowNetwork> Steps<'d, N> {
    pub fn new(drive: &'d Drive<'_>, board: Board<N>) -> Result<Self, DataError> {
        Ok(Self { path: &drive.path, rows: drive.rows()?.fuse(), board })
    }

    pub fn board(&self) -> &Board<N> {
        &self.board
    }
}

impl<N: WindowNetwork> Iterator for Steps<'_, N> {
    type Item = Result<Step, DataError>;

    fn next(&mut self) -> Option<Self::Item> {
        loop {
            let Some(row) = self.rows.next() else { return self.board.end().map(Ok) };
            let step = row.and_then(|row| {
                let fault = |source| DataFault::StartsMoving { line: row.line, source };
                self.board.row(&row).map_err(|source| DataError::of(self.path, fault(source)))
            });
            if let Some(step) = step.transpose() {
                return Some(step);
            }
        }
    }
}

/// Replays the beginning of a drive until static initialisation has finished, and returns the gyro's bias.
pub fn initialise(drive: &Drive<'_>) -> Result<[AngularRate; 3], DataError> {
    let mut steps = Steps::new(drive, Board::new(Config::DEFAULT, drive.wheels(), Uncorrected))?;
    loop {
        let ended = steps.next().transpose()?.is_none();
        match steps.board.coprocessor().pipeline().gyro_bias() {
            Some(bias) => return Ok(bias),
            None if ended => return Err(DataError::of(&drive.path, DataFault::NeverInitialised)),
            None => {}
        }
    }
}

#[derive(Debug, Clone)]
pub struct Replay {
    /// One step for each row that has a place on the grid.
    pub steps: Vec<Step>,
    /// The first step after static initialisation.
    pub start: usize,
    pub gyro_bias: [AngularRate; 3],
    /// The yaw that the delayed rates have not sent yet at the end.
    pub pending: Yaw,
}

impl Replay {
    /// Replays a recording; the estimate of each window is delivered without delay. `wheels` replaces the vehicle's bus.
    pub fn run(
        recording: &Recording,
        config: &PipelineConfig,
        wheels: Option<WheelFrames>,
        network: &mut impl WindowNetwork,
    ) -> Result<Self, DataError> {
        let config = Config { pipeline: *config, ..Config::DEFAULT };
        let drive = Drive::from(recording);
        let mut replayed = Steps::new(&drive, Board::new(config, wheels, network))?;
        let steps = replayed.by_ref().collect::<Result<Vec<Step>, _>>()?;
        let pipeline = replayed.board.coprocessor().pipeline();
        let gyro_bias = pipeline
            .gyro_bias()
            .ok_or_else(|| DataError::of(&recording.path, DataFault::NeverInitialised))?;
        let start = steps.iter().position(|step| step.is_initialised).unwrap_or(steps.len());
        Ok(Self { steps, start, gyro_bias, pending: pipeline.pending() })
    }

    /// Returns the range of the steps that have a delayed rate: from the end of static initialisation on.
    pub fn compared(&self) -> Range<usize> {
        let compared = self.steps.iter().filter(|step| step.is_compared).count();
        self.start..self.start + compared
    }

    pub fn delayed(&self) -> impl Iterator<Item = YawEstimate> {
        self.steps[self.compared()].iter().filter_map(|step| step.delayed)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use gyronet::health::Status;
    use gyronet::model::Estimate;
    use gyronet::model::window::{Features, WINDOW};
    use std::fmt::Write;

    /// A network that always estimates a gyro error of 100 codes.
    struct Constant;

    impl WindowNetwork for Constant {
        fn estimate(&mut self, _window: &[Features; WINDOW]) -> Estimate {
            Estimate { corrections: [AngularRate(100); WINDOW], ..Estimate::NONE }
        }
    }

    fn recording(rows: usize, yaw_rate: impl Fn(usize) -> f64) -> Recording {
        let mut text = String::from("t_s,acc_x,acc_y,acc_z,gyr_x,gyr_y,gyr_z\n");
        for k in 0..rows {
            let time = 0.01 * k as f64;
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
        let recording = recording(1_000, |_| 0.01);
        // The vehicle never moves, so zero-rate updates would undo the correction.
        let config = PipelineConfig { zero_rate: None, ..PipelineConfig::DEFAULT };
        let drive = Replay::run(&recording, &config, None, &mut Constant).unwrap();
        assert_eq!((drive.steps.len(), drive.start), (1_000, 300));
        assert_eq!(drive.gyro_bias[2], recording.rows[1].sample.angular_rate[2]);
        // The constant part of the corrections is removed.
        let sent: i64 = drive.delayed().map(|rate| i64::from(rate.rate.0)).sum();
        assert_eq!((drive.compared(), sent), (300..993, 0));
        // What remains is the variation of the last seven samples.
        assert_eq!(drive.pending, Yaw(-(1 << 14)));
        let count = |status| drive.steps.iter().filter(|step| step.vehicle.live.status == status).count();
        assert_eq!((count(Status::Init), count(Status::Clipped)), (300, 0));
        let degraded = count(Status::Degraded);
        assert_eq!(degraded + count(Status::Ready), 700);
        assert!(degraded < 20, "{degraded}");
    }

    #[test]
    fn silence_in_a_gap_is_reported_as_the_board_does() {
        // Row 700 arrives 100 ms after row 699: message sets without a rate from 25 ms after the last sample on,
        // every 10 ms.
        let mut recording = recording(1_000, |_| 0.01);
        for row in &mut recording.rows[700..] {
            row.sample.time.0 += 90_000;
        }
        let drive = Replay::run(&recording, &PipelineConfig::DEFAULT, None, &mut Constant).unwrap();
        let frames = |row: usize| drive.steps[row].frames.len();
        let set = frames(600);
        let sets = frames(699) / set;
        assert!((8..=9).contains(&sets) && frames(699).is_multiple_of(set), "{sets} sets");
        assert!(drive.steps.iter().enumerate().all(|(row, _)| row == 699 || frames(row) == set));
    }

    #[test]
    fn starting_in_a_turn_is_refused() {
        let recording = recording(1_000, |k| 0.001 * k as f64);
        let error = Replay::run(&recording, &PipelineConfig::DEFAULT, None, &mut Constant).unwrap_err();
        assert!(
            matches!(error, DataError { fault: DataFault::StartsMoving { line: 301, .. }, .. }),
            "{error:?}"
        );
        assert!(error.to_string().starts_with("a.csv: starts moving: line 301: "), "{error}");
    }

    #[test]
    fn never_three_seconds_whole() {
        let mut recording = recording(400, |_| 0.01);
        recording.rows.drain(200..230);
        let error = Replay::run(&recording, &PipelineConfig::DEFAULT, None, &mut Constant).unwrap_err();
        assert!(matches!(error, DataError { fault: DataFault::NeverInitialised, .. }), "{error:?}");
    }
}
