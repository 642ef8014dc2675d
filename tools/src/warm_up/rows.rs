//! This module runs the simulated drives through the board's code and compares the headings.

use super::drive::{Device, Drive, MOTORWAY_FROM_S, Trip, simulate};
use super::rear_wheels::{Second, biases};
use crate::drive::DT;
use crate::drive::replay::{Replay, ReplayError};
use crate::drive::wheel_frames::WheelFrames;
use gyronet::bias::BiasCurve;
use gyronet::health::Status;
use gyronet::model::WindowNetwork;
use gyronet::pipeline::PipelineConfig;
use gyronet::sample::{RATE_HZ, WheelSample};
use gyronet::service::Learner;
use gyronet::store::{Calibration, Configuration, Learned};
use serde::Serialize;

const SECOND: usize = RATE_HZ as usize;
/// Number of trips in town, on different days, before the motorway.
const DAYS: u64 = 6;

/// The heading error of one method after half an hour on the motorway, deg.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Row {
    /// The name of the method.
    pub name: &'static str,
    /// The error of each device.
    pub error_deg: Vec<f64>,
    /// RMS of the errors.
    pub rms_deg: f64,
    /// The RMS over that of static initialisation with zero-rate updates.
    pub ratio: f64,
}

/// The state of the board in one second of the motorway drive.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct State {
    /// Time since the start, s.
    pub seconds: f64,
    /// Temperature of the sensor, deg C.
    pub celsius: f64,
    /// True bias, deg/s.
    pub true_bias: f64,
    /// Bias that the board subtracts with the curve, deg/s.
    pub curve_bias: f64,
    /// Bias that the board subtracts without the curve, deg/s.
    pub static_bias: f64,
    /// Expected error of the rate with the curve, deg/s.
    pub curve_sigma: f64,
    /// Expected error of the rate without the curve, deg/s.
    pub static_sigma: f64,
    /// Heading error with the curve, deg.
    pub curve_error: f64,
    /// Heading error without the curve, deg.
    pub static_error: f64,
}

/// The results of the measurement.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Outcome {
    /// One row for each method.
    pub rows: Vec<Row>,
    /// Share of the motorway minutes in which the mean rate error is at most its sigma, with the curve and without.
    pub inside_one_sigma: [f64; 2],
    /// The states of the first device on the motorway, one per second.
    pub states: Vec<State>,
}

const NAMES: [&str; 5] = ["static", "static_zero_rate", "rear_wheels", "default", "default_rear_wheels"];

/// Simulates a number of devices with the seeds from `seed` on; `tick` is called for each drive.
///
/// # Errors
/// [`ReplayError`], if a simulated drive does not begin at rest.
pub fn run(
    devices: u64,
    seed: u64,
    network: &mut impl WindowNetwork,
    mut tick: impl FnMut(),
) -> Result<Outcome, ReplayError> {
    let mut errors = vec![Vec::new(); NAMES.len()];
    let (mut inside, mut states) = ([0.0; 2], Vec::new());
    for number in seed..seed + devices {
        let device = Device::new(number);
        let mut learned = Learned::NOTHING;
        for day in 0..DAYS {
            let drive = simulate(&device, Trip::Town, day);
            let replay = Board::of(&learned).run(&drive, network)?;
            learn(&drive, &replay, &mut learned);
            tick();
        }
        let drive = simulate(&device, Trip::Motorway, DAYS);
        let with = Board::of(&learned).run(&drive, network)?;
        let without = Board::of(&Learned::NOTHING).run(&drive, network)?;
        tick();
        let still = static_errors(&drive);
        let zero_rate = drive_errors(&drive, &without);
        let curve = drive_errors(&drive, &with);
        let wheels = wheel_errors(&drive, None);
        let both = wheel_errors(&drive, Some(&learned.bias_curve));
        for (all, error) in errors.iter_mut().zip([&still, &zero_rate, &wheels, &curve, &both]) {
            all.push(error.last().copied().unwrap_or(f64::NAN).to_degrees());
        }
        let found = seconds_of(&drive, [&with, &without], [&curve, &zero_rate]);
        for (share, off) in inside.iter_mut().zip(shares_inside(&found)) {
            *share += off / devices as f64;
        }
        if states.is_empty() {
            states = found;
        }
    }
    let rms = |errors: &[f64]| (errors.iter().map(|e| e * e).sum::<f64>() / errors.len() as f64).sqrt();
    let reference = rms(&errors[1]);
    let rows = NAMES.into_iter().zip(errors).map(|(name, error_deg)| {
        let rms_deg = rms(&error_deg);
        Row { name, error_deg, rms_deg, ratio: rms_deg / reference }
    });
    Ok(Outcome { rows: rows.collect(), inside_one_sigma: inside, states })
}

/// The pipeline configuration of a board that has learnt a bias curve, or none.
struct Board(PipelineConfig);

impl Board {
    fn of(learned: &Learned) -> Self {
        Self(Configuration::DEFAULT.pipeline(&Calibration::NONE, learned, 0))
    }

    fn run(&self, drive: &Drive, network: &mut impl WindowNetwork) -> Result<Replay, ReplayError> {
        let wheels = WheelFrames::new(&drive.recording);
        Replay::run(&drive.recording, &self.0, wheels, network, || {})
    }
}

/// Feeds a drive to the board's learner.
fn learn(drive: &Drive, replay: &Replay, learned: &mut Learned) {
    let mut learner = Learner::new();
    let limits = Configuration::DEFAULT.static_init;
    for step in &replay.steps {
        let sample = drive.recording.rows[step.row].sample;
        learner.observe(Some(&sample), &WheelSample::without_speeds(step.standstill), &limits, learned);
    }
}

/// Returns the heading error at the end of each second on the motorway, rad.
fn sums(drive: &Drive, rate: impl Fn(usize) -> f64) -> Vec<f64> {
    let first = (MOTORWAY_FROM_S / DT) as usize;
    let rows = first..drive.recording.rows.len();
    let mut sum = 0.0;
    let all: Vec<f64> = rows
        .map(|row| {
            sum += (rate(row) - drive.yaw_rate[row]) * DT;
            sum
        })
        .collect();
    all.into_iter().skip(SECOND - 1).step_by(SECOND).collect()
}

fn gyro(drive: &Drive, row: usize) -> f64 {
    drive.recording.rows[row].sample.angular_rate[2].rad_per_sec()
}

/// Returns the heading errors of the gyro less its mean over the first three seconds.
fn static_errors(drive: &Drive) -> Vec<f64> {
    let bias = (0..3 * SECOND).map(|row| gyro(drive, row)).sum::<f64>() / (3 * SECOND) as f64;
    sums(drive, |row| gyro(drive, row) - bias)
}

/// Returns the heading errors of the navigation rate.
fn drive_errors(drive: &Drive, replay: &Replay) -> Vec<f64> {
    let mut rates: Vec<f64> = drive.yaw_rate.clone();
    for step in &replay.steps {
        if let Some(navigation) = step.navigation.filter(|sent| sent.status != Status::Init) {
            rates[step.row] = navigation.rate.rad_per_sec();
        }
    }
    sums(drive, |row| rates[row])
}

/// Returns the heading errors of the gyro less the bias of the rear wheels' filter. With a curve, the gyro is
/// corrected by the curve first.
fn wheel_errors(drive: &Drive, curve: Option<&BiasCurve>) -> Vec<f64> {
    let celsius = |row: usize| {
        drive.recording.rows[row].sample.temperature.map_or(0.0, |code| f64::from(code.0) / 100.0)
    };
    let by_curve = |row: usize| {
        let bias = curve.and_then(|curve| curve.at(celsius(row) as f32));
        bias.map_or(0.0, |bias| bias.gyro_bias[2].rad_per_sec())
    };
    let corrected: Vec<f64> =
        (0..drive.recording.rows.len()).map(|row| gyro(drive, row) - by_curve(row)).collect();
    let first = corrected[..3 * SECOND].iter().sum::<f64>() / (3 * SECOND) as f64;
    let mut frames = WheelFrames::new(&drive.recording);
    let seconds: Vec<Second> = (0..corrected.len() / SECOND)
        .map(|second| {
            let rows = second * SECOND..(second + 1) * SECOND;
            let mean = |of: &mut dyn FnMut(usize) -> f64| rows.clone().map(of).sum::<f64>() / SECOND as f64;
            let mut wheels = [0.0; 2];
            for row in rows.clone() {
                let speeds = frames.as_mut().map(|frames| frames.speeds(&drive.recording.rows[row]));
                for (sum, speed) in wheels.iter_mut().zip(speeds.iter().flat_map(|speeds| &speeds[2..])) {
                    // Round as on the bus, to 0.01 km/h.
                    *sum += (100.0 * speed.unwrap_or(0.0)).round() / 360.0 / SECOND as f64;
                }
            }
            Second {
                gyro: mean(&mut |row| corrected[row] - first),
                wheels,
                stands: wheels == [0.0; 2],
                warmer: if curve.is_some() { 0.0 } else { celsius(second * SECOND) - celsius(0) },
            }
        })
        .collect();
    let biases = biases(&seconds);
    sums(drive, |row| {
        let known = biases.get((row / SECOND).saturating_sub(1)).copied().unwrap_or(0.0);
        corrected[row] - first - known
    })
}

/// Returns the states on the motorway, one per second.
fn seconds_of(drive: &Drive, replays: [&Replay; 2], errors: [&Vec<f64>; 2]) -> Vec<State> {
    let first = MOTORWAY_FROM_S as usize;
    let biases = replays.map(|replay| {
        let mut biases = vec![[0.0; 2]; drive.recording.rows.len()];
        for step in &replay.steps {
            let Some(sent) = step.navigation else { continue };
            let gyro = gyro(drive, step.row);
            let sigma = sent.sigma.map_or(f64::NAN, |sigma| sigma.rad_per_sec());
            biases[step.row] = [gyro - sent.rate.rad_per_sec(), sigma];
        }
        biases
    });
    let mean = |of: &dyn Fn(usize) -> f64, second: usize| {
        let rows = second * SECOND..(second + 1) * SECOND;
        rows.map(of).sum::<f64>() / SECOND as f64
    };
    let state = |(at, (curve_error, static_error)): (usize, (&f64, &f64))| {
        let second = first + at;
        let of = |replay: usize, part: usize| mean(&|row| biases[replay][row][part], second).to_degrees();
        let celsius = drive.recording.rows[second * SECOND].sample.temperature;
        State {
            seconds: second as f64,
            celsius: celsius.map_or(f64::NAN, |code| f64::from(code.0) / 100.0),
            true_bias: mean(&|row| drive.yaw_bias[row], second).to_degrees(),
            curve_bias: of(0, 0),
            static_bias: of(1, 0),
            curve_sigma: of(0, 1),
            static_sigma: of(1, 1),
            curve_error: curve_error.to_degrees(),
            static_error: static_error.to_degrees(),
        }
    };
    errors[0].iter().zip(errors[1]).enumerate().map(state).collect()
}

/// Returns the shares of the minutes in which the rate's mean error is at most the sigma at the end of the minute.
fn shares_inside(states: &[State]) -> [f64; 2] {
    let minutes = states.chunks_exact(60);
    let count = minutes.len().max(1) as f64;
    let share = |of: &dyn Fn(&State) -> (f64, f64)| {
        let inside = |minute: &&[State]| {
            let (first, _) = of(&minute[0]);
            let (last, sigma) = of(&minute[59]);
            ((last - first) / 59.0).abs() <= sigma
        };
        states.chunks_exact(60).filter(inside).count() as f64 / count
    };
    [
        share(&|state| (state.curve_error, state.curve_sigma)),
        share(&|state| (state.static_error, state.static_sigma)),
    ]
}
