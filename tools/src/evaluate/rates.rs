//! This module computes the yaw rates of one drive with each method, from the same samples and in the same pipeline.

use crate::drive::recording::{Recording, Row};
use crate::drive::replay::{Replay, ReplayError};
use crate::drive::wheel_frames::WheelFrames;
use crate::evaluate::ablation::{Uncorrected, with_lag};
use crate::evaluate::cost::{Cost, Shapes};
use crate::evaluate::fir::LowPass;
use crate::evaluate::heading_error::Reference;
use crate::evaluate::methods::{Method, PerMethod};
use crate::evaluate::{rest, vqf};
use gyronet::compensate::Lag;
use gyronet::model::blob::Shape;
use gyronet::model::window::{Features, WINDOW};
use gyronet::model::{Estimate, WindowNetwork};
use gyronet::pipeline::PipelineConfig;
use std::borrow::Cow;
use std::time::{Duration, Instant};

/// A network of any kind and its shape.
pub struct Network<'a> {
    run: &'a mut (dyn WindowNetwork + Send),
    shape: Shape,
}

impl<'a> Network<'a> {
    /// Creates a network from an implementation and its shape.
    pub fn new(run: &'a mut (dyn WindowNetwork + Send), shape: Shape) -> Self {
        Self { run, shape }
    }
}

impl WindowNetwork for Network<'_> {
    fn estimate(&mut self, window: &[Features; WINDOW]) -> Estimate {
        self.run.estimate(window)
    }
}

/// The networks that the methods run.
pub struct Networks<'a> {
    /// GyroNet in f32.
    pub float: Network<'a>,
    /// GyroNet in integers.
    pub integer: Network<'a>,
    /// The model of the default weights, whose linear part corrects the rate.
    pub default: Network<'a>,
    /// The model of the rates that are sent, if it is not the default.
    pub sent: Option<Network<'a>>,
}

/// The yaw rates of one drive with each method, from the first sample after static initialisation.
#[derive(Debug, Clone)]
pub struct Rates {
    /// Time of each sample since the first sample of the recording, s.
    pub seconds: Vec<f64>,
    /// The rates by each method, rad/s.
    pub rates: PerMethod<Vec<f64>>,
    /// The cost of each method.
    pub costs: PerMethod<Cost>,
    /// The reference of the drive.
    pub reference: Option<Reference>,
    /// Whether the drive begins in motion, so that a simulated standstill was inserted before it.
    pub simulated_rest: bool,
    /// The drive as the board would run it.
    pub drive: Replay,
    /// The run time of [`Rates::drive`] on this machine.
    pub run_time: Duration,
}

/// Most replays of a recording by [`Rates::new`] that call `tick`.
pub const RUNS: usize = 4;

impl Rates {
    /// Runs every method. All networks run in the same pipeline; the pipeline without a network is
    /// [`Method::STATIC_ZERO_RATE`]. `tick` is called for each row of each run but the f32 network's, which has a thread of
    /// its own.
    ///
    /// # Errors
    /// [`ReplayError`], if static initialisation fails and there is no course with which to simulate a standstill.
    pub fn new(
        recording: &Recording,
        networks: &mut Networks<'_>,
        mut tick: impl FnMut(),
    ) -> Result<Self, ReplayError> {
        let at_once = with_lag(PipelineConfig::DEFAULT, Lag::NONE);
        let wheels = WheelFrames::new(recording);
        let run = Replay::run(recording, &at_once, wheels.clone(), &mut Uncorrected, &mut tick);
        let (recording, zero_rate, simulated_rest) = match run {
            Ok(zero_rate) => (Cow::Borrowed(recording), zero_rate, false),
            Err(error) => {
                let rested = rest::before(recording).ok_or(error)?;
                let run = Replay::run(&rested, &at_once, wheels.clone(), &mut Uncorrected, &mut tick)?;
                (Cow::Owned(rested), run, true)
            }
        };
        let run = |network: &mut Network<'_>, tick: &mut dyn FnMut()| {
            Replay::run(&recording, &PipelineConfig::DEFAULT, wheels.clone(), network, tick)
        };
        // The f32 network takes longer than all others together.
        let (float, integer, default, sent) = std::thread::scope(|scope| {
            let float = scope.spawn(|| run(&mut networks.float, &mut || {}));
            let mut timed = |network: &mut Network<'_>| {
                let start = Instant::now();
                run(network, &mut tick).map(|drive| (drive, start.elapsed()))
            };
            let integer = timed(&mut networks.integer);
            let default = timed(&mut networks.default);
            let sent = networks.sent.as_mut().map(timed);
            (float.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic)), integer, default, sent)
        });
        let (float, (integer, _), default) = (float?, integer?, default?);
        let settled = |drive: &Replay| drive.settled().map(|rate| rate.rad_per_sec()).collect::<Vec<f64>>();
        let linear = settled(&default.0);
        let shapes = Shapes {
            float: networks.float.shape,
            integer: networks.integer.shape,
            sent: networks.sent.as_ref().unwrap_or(&networks.default).shape,
        };
        let (drive, run_time) = sent.transpose()?.unwrap_or(default);

        let compared = || drive.steps[drive.compared()].iter();
        let row = |row: usize| &recording.rows[row];
        let [.., bias] = drive.gyro_bias.map(|bias| bias.rad_per_sec());
        // The filters run from the start of the recording.
        let raw: Vec<f64> = drive.steps.iter().map(|step| gyro(row(step.row))[2]).collect();
        let still: Vec<f64> = raw.iter().map(|rate| rate - bias).collect();
        let updated: Vec<f64> = zero_rate
            .steps
            .iter()
            .zip(&still)
            // The static rate is used before the first navigation rate and after the last one.
            .map(|(step, still)| step.navigation.map_or(*still, |sent| sent.rate.rad_per_sec()))
            .collect();
        let rates = PerMethod::new(|method| match method {
            Method::RAW => raw[drive.compared()].to_vec(),
            Method::STATIC => still[drive.compared()].to_vec(),
            Method::STATIC_ZERO_RATE => updated[drive.compared()].to_vec(),
            Method::FIR => LowPass::chosen().filter(&still)[drive.compared()].to_vec(),
            Method::FIR_ZERO_RATE => LowPass::chosen().filter(&updated)[drive.compared()].to_vec(),
            Method::VQF => {
                let samples = drive.steps.iter().map(|step| unbiased(&drive, row(step.row)));
                vqf::rates(vqf::on_a_vehicle(), samples)[drive.compared()].to_vec()
            }
            Method::GYRONET_F32 => settled(&float),
            Method::GYRONET_INT => settled(&integer),
            Method::LINEAR => linear.clone(),
            Method::PROMPT => compared().map(|step| step.vehicle.prompt.rate.rad_per_sec()).collect(),
            // The remaining method is `Method::NAVIGATION`.
            _ => drive.navigation().map(|rate| rate.rate.rad_per_sec()).collect(),
        });
        let costs = PerMethod::new(|method| Cost::new(method, &shapes));
        let first = recording.rows.first().map_or(0, |row| row.sample.time.0);
        let seconds = compared().map(|step| (step.time.0 - first) as f64 * 1e-6).collect();
        let rate: Option<Vec<f64>> = compared().map(|step| row(step.row).reference).collect();
        let course: Vec<Option<f64>> = compared().map(|step| row(step.row).course).collect();
        let course = course.iter().any(Option::is_some).then_some(Reference::Course(course));
        let reference = rate.map(Reference::Rate).or(course);
        Ok(Self { seconds, rates, costs, reference, simulated_rest, drive, run_time })
    }
}

fn gyro(row: &Row) -> [f64; 3] {
    row.sample.angular_rate.map(|rate| rate.rad_per_sec())
}

/// Returns a row's gyro less its static bias, and its specific force.
fn unbiased(drive: &Replay, row: &Row) -> ([f64; 3], [f64; 3]) {
    let (gyro, bias) = (gyro(row), drive.gyro_bias.map(|bias| bias.rad_per_sec()));
    let force = row.sample.specific_force.map(|force| force.metre_per_sec2());
    (std::array::from_fn(|axis| gyro[axis] - bias[axis]), force)
}
