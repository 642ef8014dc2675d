//! The yaw rates of one drive by each method, sample by sample: all methods run side by side, from the same samples
//! and in the same pipeline.
//!
//! The drive is read more than once, and never kept: first for its facts ([`Drive::open`]), then its beginning for the
//! static bias, which the classical methods subtract from the first sample on, and then as a whole. A drive that begins
//! in motion is read once more before that, for the best constant bias (`rest`).

use crate::board::{Board, Step, Uncorrected};
use crate::drive::error::{DataError, DataFault};
use crate::drive::recording::between;
use crate::drive::replay::initialise;
use crate::drive::stream::Drive;
use crate::drive::wheel_frames::Speeds;
use crate::evaluate::angle::integral;
use crate::evaluate::fir::{Line, LowPass};
use crate::evaluate::heading_error::{ALIGNED, OffCourse, median};
use crate::evaluate::methods::{Method, PerMethod};
use crate::evaluate::trajectory_error::Point;
use crate::evaluate::{rest, vqf};
use gyronet::can;
use gyronet::compensate::{CompensateConfig, Lag};
use gyronet::coprocessor::Config;
use gyronet::estimate::YawEstimate;
use gyronet::model::WindowNetwork;
use gyronet::pipeline::PipelineConfig;
use gyronet::units::{AngularRate, Micros, SpecificForce};
use std::borrow::Cow;
use std::collections::VecDeque;

type Network<'a> = &'a mut dyn WindowNetwork;

pub struct Networks<'a> {
    /// The model of the default weights, whose linear part corrects the rate.
    pub default: Network<'a>,
    /// The model of the rates that are sent, if it is not the default.
    pub sent: Option<Network<'a>>,
    /// The paper's GyroNet in f32 and in integers, for the rows of the same names.
    pub paper: Option<[Network<'a>; 2]>,
}

#[derive(Debug, Clone)]
pub struct Sample {
    pub step: Step,
    /// The rates by each method, rad/s.
    pub rates: PerMethod<f64>,
}

#[derive(Debug, Clone)]
pub struct Comparison {
    /// True if the drive begins in motion, so that a simulated standstill was inserted before it.
    pub simulated_rest: bool,
    /// Number of grid steps without a sample.
    pub missing: u32,
}

/// A configuration whose board sends nothing: only its rates are compared.
pub(super) fn silent(pipeline: PipelineConfig) -> Config {
    Config { pipeline, can: can::config::Config::SILENT, ..Config::DEFAULT }
}

/// Runs every method, and passes each sample to `visit`. All networks run in the same pipeline; the pipeline without a
/// network is [`STATIC_ZERO_RATE`](crate::evaluate::methods::Method::STATIC_ZERO_RATE).
pub fn run(
    drive: &Drive<'_>,
    networks: Networks<'_>,
    mut visit: impl FnMut(&Sample),
) -> Result<Comparison, DataError> {
    let at_rest = drive.facts.check_rest(&drive.path);
    let (drive, bias, simulated_rest) = match at_rest.and_then(|()| initialise(drive)) {
        Ok(bias) => (Cow::Borrowed(drive), bias, false),
        Err(error) => {
            let rested = rest::before(drive)?.ok_or(error)?;
            let bias = initialise(&rested)?;
            (Cow::Owned(rested), bias, true)
        }
    };
    let drive = &*drive;
    let board = |network| Board::new(silent(PipelineConfig::DEFAULT), drive.wheels(), network);
    let mut boards: Vec<Board<Network<'_>>> = vec![board(networks.default)];
    boards.extend(networks.sent.map(board));
    let sent = boards.len() - 1;
    boards.extend(networks.paper.into_iter().flatten().map(board));
    let compensate = CompensateConfig { lag: Lag::NONE, ..CompensateConfig::DEFAULT };
    let at_once = silent(PipelineConfig { compensate, ..PipelineConfig::DEFAULT });
    let mut zero_rate = Board::new(at_once, drive.wheels(), Uncorrected);
    let mut side_by_side = SideBySide::new(bias);
    let mut rows = drive.rows()?;
    loop {
        let row = rows.next().transpose()?;
        let refused =
            |line| move |source| DataError::of(&drive.path, DataFault::StartsMoving { line, source });
        let next = |board: &mut Board<_>| match &row {
            Some(row) => board.row(row).map_err(refused(row.line)),
            None => Ok(board.end()),
        };
        // Every board takes the row before any step is used.
        let steps: Vec<Option<Step>> = boards.iter_mut().map(next).collect::<Result<_, _>>()?;
        let steps: Option<Vec<Step>> = steps.into_iter().collect();
        let updated = match &row {
            Some(row) => zero_rate.row(row).map_err(refused(row.line))?,
            None => zero_rate.end(),
        };
        match steps.zip(updated) {
            Some((steps, updated)) => {
                let paper = [1, 2].map(|after| steps.get(sent + after).map(|step| step.complete));
                let known = Known { updated: updated.delayed, linear: steps[0].complete, paper };
                let step = steps.into_iter().nth(sent).unwrap_or(updated);
                side_by_side.step(step, &known).iter().for_each(&mut visit);
            }
            None if row.is_none() => break,
            None => {}
        }
    }
    while let Some(sample) = side_by_side.end() {
        visit(&sample);
    }
    let missing = boards[sent].coprocessor().pipeline().counters().missing;
    Ok(Comparison { simulated_rest, missing })
}

/// The rates that other boards have found for a step.
struct Known {
    updated: Option<YawEstimate>,
    linear: AngularRate,
    paper: [Option<AngularRate>; 2],
}

/// The filters beside the board, from the start of the drive on.
struct SideBySide {
    bias: [f64; 3],
    fir: [Line; 2],
    vqf: vqf::Heading,
    /// Samples that wait for the low passes.
    waiting: VecDeque<Sample>,
}

impl SideBySide {
    fn new(bias: [AngularRate; 3]) -> Self {
        Self {
            bias: bias.map(AngularRate::rad_per_sec),
            fir: [LowPass::chosen(), LowPass::chosen()].map(Line::new),
            vqf: vqf::Heading::new(vqf::on_a_vehicle()),
            waiting: VecDeque::new(),
        }
    }

    /// Adds a step; returns the sample before it that is complete with it.
    fn step(&mut self, step: Step, known: &Known) -> Option<Sample> {
        let sample = &step.input.sample;
        let gyro = sample.angular_rate.map(AngularRate::rad_per_sec);
        let [x, y, still] = [0, 1, 2].map(|axis| gyro[axis] - self.bias[axis]);
        // The static rate is used before the first delayed rate and after the last one.
        let updated = known.updated.map_or(still, |sent| sent.rate.rad_per_sec());
        let vqf = self.vqf.rate([x, y, still], sample.specific_force.map(SpecificForce::metre_per_sec2));
        let delayed = step.delayed.map(|sent| sent.rate.rad_per_sec());
        let [float, integer] = known.paper.map(|rate| rate.map(AngularRate::rad_per_sec));
        // In the order of Method::ON_A_DRIVE; the low passes' rates come later.
        let rates = PerMethod::of([
            Some(gyro[2]),
            Some(still),
            Some(updated),
            None,
            None,
            Some(vqf),
            Some(known.linear.rad_per_sec()),
            float,
            integer,
            Some(step.vehicle.live.rate.rad_per_sec()),
            delayed,
        ]);
        self.waiting.push_back(Sample { step, rates });
        let filtered = [self.fir[0].next(still), self.fir[1].next(updated)];
        self.complete(filtered)
    }

    fn end(&mut self) -> Option<Sample> {
        let filtered = [self.fir[0].end(), self.fir[1].end()];
        self.complete(filtered)
    }

    fn complete(&mut self, [fir, fir_zero_rate]: [Option<f64>; 2]) -> Option<Sample> {
        let (fir, fir_zero_rate) = fir.zip(fir_zero_rate)?;
        let mut sample = self.waiting.pop_front()?;
        let [_, _, _, first, second, ..] = sample.rates.values_mut();
        (*first, *second) = (Some(fir), Some(fir_zero_rate));
        Some(sample)
    }
}

/// The rates of the compared samples of a drive in memory, for its curves, with what its references say.
#[derive(Debug, Clone, Default)]
pub struct Rates {
    /// Time of each sample since the first sample of the recording, s.
    pub seconds: Vec<f64>,
    /// The rates by each method, rad/s.
    pub rates: PerMethod<Vec<f64>>,
    /// The true yaw rate of each sample, rad/s; `None` if one has none.
    reference: Option<Vec<f64>>,
    /// The course at each sample, unwrapped, from any zero direction, rad.
    courses: Vec<Option<f64>>,
    /// The speed of the vehicle at each sample, m/s, by its wheels, else by GNSS.
    speeds: Vec<f64>,
    /// New positions by GNSS: the number of the sample, and the place east and north of the first one, m.
    pub places: Vec<(usize, Point)>,
    first: Micros,
    wheels: Option<Speeds>,
    speed: Option<f64>,
    off_course: OffCourse,
    place: Option<[[f64; 2]; 2]>,
}

impl Rates {
    pub fn of(drive: &Drive<'_>) -> Self {
        Self {
            reference: Some(Vec::new()),
            first: drive.facts.first,
            wheels: drive.speeds(),
            ..Self::default()
        }
    }

    pub fn add(&mut self, Sample { step, rates }: &Sample) {
        let row = &step.input;
        let by_wheels = self.wheels.as_mut().map(|wheels| wheels.next(row));
        self.speed = by_wheels.or(row.speed).or(self.speed);
        if !step.is_compared {
            return;
        }
        if let Some(place) = row.place.filter(|place| self.place.is_none_or(|[_, last]| last != *place)) {
            let [first, _] = self.place.unwrap_or([place; 2]);
            self.place = Some([first, place]);
            self.places.push((self.seconds.len(), between(first, place)));
        }
        self.seconds.push((step.time.0 - self.first.0) as f64 * 1e-6);
        self.speeds.push(self.speed.unwrap_or(0.0));
        let [.., gyro] = row.sample.angular_rate;
        let off = self.off_course.add(gyro.rad_per_sec(), row.course);
        self.courses.push(off.map(|off| self.off_course.yaw() - off));
        match (&mut self.reference, row.reference) {
            (Some(reference), Some(rate)) => reference.push(rate),
            (reference, _) => *reference = None,
        }
        for (all, rate) in self.rates.values_mut().iter_mut().zip(rates.values()) {
            if let Some(rate) = rate {
                all.get_or_insert_default().push(*rate);
            }
        }
    }

    /// The heading by each reference after each sample, rad, where it is known; `None` without a reference. The course
    /// is laid onto the delayed rate's heading of its first 20 s.
    pub fn truth(&self) -> Option<Vec<Option<f64>>> {
        if let Some(rates) = &self.reference {
            return Some(integral(rates).into_iter().map(Some).collect());
        }
        let first = self.courses.iter().position(Option::is_some)?;
        let yaw = integral(&self.rates[Method::DELAYED]);
        let both = yaw.iter().zip(&self.courses).skip(first).take(ALIGNED);
        let off = median(both.filter_map(|(yaw, course)| Some(yaw - (*course)?)).collect())?;
        Some(self.courses.iter().map(|course| Some((*course)? + off)).collect())
    }

    /// The course at each sample, if it is the reference.
    pub fn courses(&self) -> Option<&[Option<f64>]> {
        Some(&*self.courses).filter(|known| self.reference.is_none() && known.iter().any(Option::is_some))
    }

    /// The speeds; `None` where nothing measures them.
    pub fn speeds(&self) -> Option<&[f64]> {
        self.speed.map(|_| self.speeds.as_slice())
    }
}
