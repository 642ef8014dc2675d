//! Runs a sequence through the coprocessor, to get the rates that the board sends, and through FoGNet, to correct the
//! turns of the sequence.

use crate::sequence::{Sequence, Step};
use gyronet::bias::Latitude;
use gyronet::coprocessor::{Clock, Config, Coprocessor, Sink, TimedFrame};
use gyronet::estimate::YawEstimate;
use gyronet::fog::{FogConfig, FogCorrector, FogErrors};
use gyronet::model::fognet::MinuteNetwork;
use gyronet::model::fognet_blob::{Gyro, Training};
use gyronet::model::seconds::FogFrame;
use gyronet::model::window::Features;
use gyronet::sample::{FogSample, ImuSample, PERIOD_US, RATE_HZ, Validity};
use gyronet::units::{Angle, AngularRate, Micros, SpecificForce, WheelSpeed};
use gyronet_tools::drive::DT;
use gyronet_tools::drive::wheel_frames;

/// Number of steps of static initialisation: 3 s.
const STATIC_STEPS: usize = 300;

#[derive(Debug, Clone, Default, PartialEq)]
pub struct FogReplay {
    /// Corrected turn of each step, rad.
    pub turns: Vec<f64>,
    pub windows: u64,
    /// Estimates that were rejected as implausible.
    pub implausible: u64,
}

pub fn run(sequence: &Sequence, network: &mut dyn MinuteNetwork) -> FogReplay {
    let inertial = features(sequence);
    let mut corrector = FogCorrector::START;
    let mut drive = FogReplay::default();
    for (step, inertial) in sequence.steps.iter().zip(inertial) {
        let wheels = step.wheels.map(|way| {
            let speed = way * f64::from(RATE_HZ) * f64::from(1u32 << WheelSpeed::FRACTION_BITS);
            // The cast saturates only beyond the speed of sound.
            WheelSpeed(speed.round() as i32)
        });
        let frame = FogFrame { turn: angle(step.fog), inertial: inertial.filter(|_| !step.imu_gap), wheels };
        let output = corrector.correct(&frame, network);
        drive.turns.push(output.turn.rad());
        drive.windows += u64::from(output.is_window);
        drive.implausible += u64::from(output.implausible);
    }
    drive
}

fn default_config(sequence: &Sequence) -> FogConfig {
    let latitude = Latitude::from_degrees(sequence.latitude_deg() as f32);
    FogConfig { errors: FogErrors::DSP1760, latitude, ..FogConfig::DEFAULT }
}

/// Checks that weights are for the gyro of a sequence. A simulated gyro has its device number as serial number; a
/// recorded gyro is assumed to have the serial number that the weights name. The error names both.
pub fn check_weights(sequence: &Sequence, trained: Training) -> Result<(), String> {
    let part = Gyro::Dsp1760;
    let serial = sequence.simulated.as_ref().map_or(trained.serial, |spec| spec.device as u32);
    if trained.gyro != part || trained.serial != 0 && trained.serial != serial {
        return Err(format!("trained for a {trained}, the sequence has a {part} number {serial}"));
    }
    Ok(())
}

/// Runs a sequence through the coprocessor, with wheel speeds in frames as the board receives them. Returns the rate
/// sent for each step (zero for the first, whose begin no sample marks).
pub fn run_board(sequence: &Sequence) -> Vec<YawEstimate> {
    let mut coprocessor = Coprocessor::new(Config {
        fog: default_config(sequence),
        wheels: Some(wheel_frames::receiver()),
        has_gyronet: false,
        clock: Clock::Sensor,
        ..Config::DEFAULT
    });
    let mut way = [0.0; 2];
    let mut sent = Rates(vec![YawEstimate::default(); sequence.steps.len()]);
    for (number, step) in sequence.steps.iter().enumerate() {
        let time = Micros((number as u64 + 1) * PERIOD_US);
        for (way, of_step) in way.iter_mut().zip(step.wheels) {
            *way += of_step;
        }
        if number % wheel_frames::FRAME_ROWS == 0 {
            let [left, right] = way.map(|way| Some(way.abs() / (wheel_frames::FRAME_ROWS as f64 * DT) * 3.6));
            way = [0.0; 2];
            if let Some(frame) = wheel_frames::frame([left, right, left, right]) {
                // A speed that does not fit a frame gives no frame, so the wheels are silent.
                let _ = coprocessor.can(&frame, time);
            }
        }
        if let Some([fx, fy, fz, rx, ry, rz]) = codes(step).filter(|_| !step.imu_gap) {
            let sample = ImuSample {
                time,
                specific_force: [fx, fy, fz].map(SpecificForce),
                angular_rate: [rx, ry, rz].map(AngularRate),
                temperature: None,
                validity: Validity::Good,
            };
            // Times ascend, so no sample is refused.
            let _ = coprocessor.imu(sample, time, &mut ());
        }
        let increment = [None, None, Some(angle(step.fog))];
        let sample = FogSample { time, span: PERIOD_US as u32, lost: 0, increment, temperature: None };
        let _ = coprocessor.fog(sample, time, &mut sent);
    }
    sent.0
}

struct Rates(Vec<YawEstimate>);

impl Sink for Rates {
    const TAKES_FRAMES: bool = false;

    fn frame(&mut self, _frame: TimedFrame) {}

    fn fog_rate(&mut self, rate: &YawEstimate) {
        // Grid step 1 is that of the first row.
        let place = (rate.tick as usize).checked_sub(1).and_then(|row| self.0.get_mut(row));
        place.into_iter().for_each(|place| *place = *rate);
    }
}

/// Returns the sequence with the Earth's rate and the bias subtracted from the gyro, as the board computes it and
/// FoGNet receives it.
pub fn after_base(sequence: &Sequence) -> Sequence {
    let sent = run_board(sequence);
    let mut corrected = sequence.clone();
    for (step, sent) in corrected.steps.iter_mut().zip(sent) {
        step.fog = sent.rate.rad_per_sec() * DT;
    }
    corrected
}

/// Returns the inertial sensor's reading in codes; `None` if it is beyond the range of all parts.
fn codes(step: &Step) -> Option<Features> {
    let [fx, fy, fz] = step.specific_force.map(|f| SpecificForce::from_metre_per_sec2(f).ok());
    let [rx, ry, rz] = step.angular_rate.map(|rate| AngularRate::from_rad_per_sec(rate).ok());
    Some([fx?.0, fy?.0, fz?.0, rx?.0, ry?.0, rz?.0])
}

/// Returns the inertial sensor's features of each step, with the gyro's mean over the first 3 s subtracted; `None`
/// for a reading beyond the range of all parts.
fn features(sequence: &Sequence) -> Vec<Option<Features>> {
    let mut features: Vec<Option<Features>> = sequence.steps.iter().map(codes).collect();
    let first = || features.iter().take(STATIC_STEPS).flatten();
    let count = first().count().max(1) as i64;
    let bias: [i64; 3] = std::array::from_fn(|axis| {
        first().map(|features| i64::from(features[3 + axis])).sum::<i64>() / count
    });
    for features in features.iter_mut().flatten() {
        for (rate, bias) in features[3..].iter_mut().zip(bias) {
            *rate = (i64::from(*rate) - bias).clamp(i32::MIN.into(), i32::MAX.into()) as i32;
        }
    }
    features
}

/// Returns the nearest code of an angle in rad; an f64 has more bits than the gyro.
fn angle(rad: f64) -> Angle {
    Angle((rad * f64::from(Angle::PER_RAD)).round() as i64)
}
