//! Runs the methods that the paper's tables compare: each computes from a sequence the angle turned in
//! every 10 ms.
//!
//! The paper's vendor filter runs inside the sensor and is not available. If the data have no vendor's heading,
//! [`Method::VQF`] replaces it: an orientation filter of the same kind (gyro integrated, levelled by the
//! accelerometer, bias learnt at rest; Laidig and Seel, VQF, Information Fusion 91, 2023), without a magnetometer. It
//! runs once with its published defaults, and once with rest thresholds that a standing vehicle with its engine
//! running stays below.

use super::given::Given;
use super::joint::Joint;
use crate::fog_replay;
use crate::sequence::{self, Sequence};
use crate::simulate::world::EARTH_RATE;
use gyronet::bias::{STATIC_SAMPLES, StaticConfig};
use gyronet::model::WindowNetwork;
use gyronet::model::fognet::{FogEstimate, MinuteNetwork};
use gyronet::model::fognet_blob::Training;
use gyronet::model::seconds::SecondsWindow;
use gyronet::pipeline::PipelineConfig;
use gyronet::sample::PERIOD_US;
use gyronet::units::AngularRate;
use gyronet_tools::drive::DT;
use gyronet_tools::drive::replay::{Replay, Step};
use gyronet_tools::evaluate::fir::LowPass;
use gyronet_tools::evaluate::methods::Method;
use gyronet_tools::evaluate::trajectory_error::Point;
use gyronet_tools::evaluate::vqf;

#[derive(Debug, Clone, PartialEq)]
pub struct Estimate {
    pub method: Method,
    /// Angle turned in each step, from the first compared step on, rad.
    pub turns: Vec<f64>,
    /// Source of the positions after these turns.
    pub places: Places,
}

#[derive(Debug, Clone, PartialEq)]
pub enum Places {
    /// Dead reckoning with the wheels' distances times a scale.
    Reckoned { scale: f64 },
    /// A given trajectory: the position after each turn, relative to that of the first step, m.
    Given(Vec<Point>),
}

impl Places {
    /// Dead reckoning with the unscaled distances.
    pub const RECKONED: Self = Self::Reckoned { scale: 1.0 };
}

#[derive(Debug, Clone, PartialEq, Default)]
pub struct Estimates {
    /// Index of the first compared step, after static initialisation.
    pub start: usize,
    pub methods: Vec<Estimate>,
    /// The methods whose given trajectory cannot be compared, with the reason.
    pub left_out: Vec<(Method, String)>,
    /// Text with the numbers of [`Method::FOG_WHEELS`] and the sequences that they were fitted to.
    pub fitted: Option<String>,
    /// The reasons why some methods could not be run.
    pub refused: Option<String>,
}

pub fn run(sequence: &Sequence, network: &mut impl WindowNetwork) -> Estimates {
    let start = (STATIC_SAMPLES as usize).min(sequence.steps.len());
    let mut estimates = Estimates { start, ..Estimates::default() };
    estimates.inertial(sequence, network);
    if sequence.simulated.is_none() {
        estimates.add(Method::VENDOR, rates(sequence.steps.iter().map(|step| step.vendor_yaw)));
    }
    let by_wheels = |step: &sequence::Step| (step.wheels[1] - step.wheels[0]) / sequence.wheel_base;
    estimates.add(Method::WHEELS, sequence.steps.iter().map(|step| by_wheels(step) / DT).collect());
    let fog: Vec<f64> = sequence.steps.iter().map(|step| step.fog / DT).collect();
    estimates.add(Method::FOG, fog.clone());
    let earth = EARTH_RATE * libm::sin(sequence.latitude_deg().to_radians());
    estimates.add(Method::FOG_EARTH, fog.iter().map(|rate| rate - earth).collect());
    let sent = fog_replay::run_board(sequence);
    estimates.add(Method::FOG_DEFAULT, sent.iter().map(|sent| sent.rate.rad_per_sec()).collect());
    estimates
}

impl Estimates {
    /// Adds the rates that the board sends, corrected by FoGNet with and without padding. Weights for another
    /// gyro are not run.
    pub fn add_fognet(&mut self, sequence: &Sequence, network: &mut impl MinuteNetwork, trained: Training) {
        let fits = fog_replay::check_weights(sequence, trained);
        if let Err(error) = &fits {
            let before = self.refused.take().map(|before| before + "; ").unwrap_or_default();
            self.refused = Some(format!("{before}FoGNet's weights were not run: {error}"));
        }
        let base = fog_replay::after_base(sequence);
        let mut whole = WholeMinutes(network);
        for method in [Method::FOGNET, Method::FOGNET_NOPAD] {
            let network: &mut dyn MinuteNetwork =
                if method == Method::FOGNET { &mut *whole.0 } else { &mut whole };
            let turns = match &fits {
                Ok(()) => fog_replay::run(&base, network).turns,
                Err(_) => base.steps.iter().map(|step| step.fog).collect(),
            };
            self.add(method, turns.iter().map(|turn| turn / DT).collect());
        }
    }

    /// Adds FoGNet on GyroNet's rate, if GyroNet was run.
    pub fn add_pseudo_fog(&mut self, sequence: &Sequence, network: &mut impl MinuteNetwork) {
        let looped = self.methods.iter().find(|estimate| estimate.method == Method::GYRONET_LOOP);
        let Some(looped) = looped else { return };
        let mut sequence = sequence.clone();
        for (step, turn) in sequence.steps.iter_mut().skip(self.start).zip(&looped.turns) {
            step.fog = *turn;
        }
        let drive = fog_replay::run(&sequence, network);
        self.push(Method::PSEUDO_FOG, drive.turns[self.start..].to_vec());
    }

    fn inertial(&mut self, sequence: &Sequence, network: &mut impl WindowNetwork) {
        let recording = sequence.recording();
        let gyro: Vec<f64> = sequence.steps.iter().map(|step| f64::from(step.angular_rate[2])).collect();
        let constant = |rate: f64| gyro.iter().map(|z| z - rate).collect::<Vec<f64>>();
        // This is the paper's network alone, without zero-rate updates.
        let config = PipelineConfig { zero_rate: None, ..PipelineConfig::DEFAULT };
        let drive = Replay::run(&recording, &config, None, network);
        let wheels = recording.wheels();
        let looped = Replay::run(&recording, &PipelineConfig::DEFAULT, wheels, network);
        self.add(Method::RAW, constant(0.0));
        match drive.and_then(|drive| Ok((drive, looped?))) {
            Ok((drive, looped)) => {
                let still = &gyro[..self.start];
                let bias = still.iter().sum::<f64>() / still.len().max(1) as f64;
                self.add(Method::STATIC, constant(bias));
                self.add(Method::FIR, LowPass::chosen().filter(&constant(bias)));
                self.add(Method::GYRONET, corrected(&drive, &gyro, |step| step.complete));
                self.add(Method::GYRONET_ONLINE, corrected(&drive, &gyro, |step| step.vehicle.live.rate));
                // The delayed rates of the drive's last steps have not been sent yet.
                let delayed = |step: &Step| step.delayed.map_or(step.complete, |sent| sent.rate);
                self.add(Method::GYRONET_LOOP, corrected(&looped, &gyro, delayed));
            }
            Err(error) => self.refused = Some(error.to_string()),
        }
        let samples = || {
            sequence
                .steps
                .iter()
                .map(|step| (step.angular_rate.map(f64::from), step.specific_force.map(f64::from)))
        };
        self.add(Method::VQF, vqf::rates(vqf::published(), samples()));
        let mut filter = vqf::published();
        // The thresholds are three times the spread that static initialisation allows, because VQF checks each sample.
        let StaticConfig { gyro_std, accel_std, .. } = StaticConfig::DEFAULT;
        let (gyro, accel) = (f64::from(gyro_std).to_degrees(), f64::from(accel_std));
        filter.set_rest_detection_thresholds(3.0 * gyro, 3.0 * accel);
        self.add(Method::VQF_VEHICLE, vqf::rates(filter, samples()));
    }

    fn add(&mut self, method: Method, rates: Vec<f64>) {
        self.push(method, rates[self.start..].iter().map(|rate| rate * DT).collect());
    }

    fn push(&mut self, method: Method, turns: Vec<f64>) {
        self.methods.push(Estimate { method, turns, places: Places::RECKONED });
    }

    pub fn add_joint(&mut self, sequence: &Sequence, joint: &Joint) {
        let (turns, places) = (joint.turns(sequence, self.start), Places::Reckoned { scale: joint.way });
        self.methods.push(Estimate { method: Method::FOG_WHEELS, turns, places });
        self.fitted = Some(joint.to_string());
    }

    /// Adds another program's trajectory, or the reason why it cannot be compared.
    pub fn add_given(&mut self, sequence: &Sequence, given: &Given) {
        let name = given.method.name;
        let is_taken = self.methods.iter().any(|own| own.method.key == name || own.method.name == name);
        match given.path(sequence, self.start) {
            _ if is_taken => self.left_out.push((given.method, "it has the name of another method".into())),
            Ok((turns, places)) => {
                self.methods.push(Estimate { method: given.method, turns, places: Places::Given(places) });
            }
            Err(error) => self.left_out.push((given.method, error.to_string())),
        }
    }
}

/// Returns one of the rates of each step. For a step without a sample this is the interpolated gyro minus the last
/// correction.
fn corrected(drive: &Replay, gyro: &[f64], which: impl Fn(&Step) -> AngularRate) -> Vec<f64> {
    let mut steps = drive.steps.iter().peekable();
    let mut taken_off = 0.0;
    let rate = |(k, gyro): (usize, &f64)| {
        // A sample has the time of its step.
        while let Some(step) = steps.next_if(|step| step.time.0 <= k as u64 * PERIOD_US) {
            taken_off = gyro - which(step).rad_per_sec();
        }
        gyro - taken_off
    };
    gyro.iter().enumerate().map(rate).collect()
}

/// Returns the rates of an unwrapped heading; zero in the first step.
fn rates(headings: impl Iterator<Item = f64>) -> Vec<f64> {
    let mut last = None;
    headings.map(|yaw| (yaw - last.replace(yaw).unwrap_or(yaw)) / DT).collect()
}

/// Corrects nothing before a window is a whole minute.
struct WholeMinutes<'n, N>(&'n mut N);

impl<N: MinuteNetwork> MinuteNetwork for WholeMinutes<'_, N> {
    fn estimate(&mut self, window: &SecondsWindow<'_>) -> FogEstimate {
        if window.is_whole() { self.0.estimate(window) } else { FogEstimate::NONE }
    }
}
