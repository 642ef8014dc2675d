//! The heading error after a loss of GNSS: the courses are hidden from a start on, for every start of a drive.
//!
//! A start comes every few seconds ([`EVERY_S`] in the table), once the vehicle has driven with a course for long
//! enough. The boards at work are copied there, and the copies go on without a course. The error of a method is the
//! change of its heading since the start less that of the reference, which is taken as the median of the last three
//! seconds, at both ends. Every method has the same samples, wheels and courses.

use crate::board::{Board, Step, Uncorrected};
use crate::drive::DT;
use crate::drive::error::DataError;
use crate::drive::recording::Row;
use crate::drive::stream::Drive;
use crate::drive::wheel_frames::Speeds;
use crate::evaluate::angle::wrap;
use crate::evaluate::heading_error::{OffCourse, median};
use crate::evaluate::outage_path::{ByMethod, Path, Point};
use crate::evaluate::rates::silent;
use crate::evaluate::{ekf, vqf};
use gyronet::heading::CourseConfig;
use gyronet::model::window::{Features, WINDOW};
use gyronet::model::{Estimate, WindowNetwork};
use gyronet::pipeline::PipelineConfig;
use gyronet::sample::{RATE_HZ, Standstill};
use gyronet::units::{AngularRate, SpecificForce};
use std::cell::RefCell;
use std::collections::VecDeque;
use std::rc::Rc;

/// Time from one start to the next in the table, s.
pub const EVERY_S: usize = 2;
/// Seconds of course before a start, one set of rows each.
pub const AFTER_S: [usize; 2] = [60, 20];
/// Longest time from one course to the next of a vehicle that drives with a course, and from one GNSS speed to the next, s.
const APART_S: f64 = 2.1;
/// Samples over whose median the reference is taken.
const MEDIAN: usize = 3 * SECOND;
const SECOND: usize = RATE_HZ as usize;
const MINUTE: usize = 60 * SECOND;

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Outage {
    /// Time driven with a course before it, s.
    pub driven_s: f64,
    pub seconds: usize,
    /// Its start, s from the start of the drive.
    pub start_s: f64,
    /// Whether a rest had shown the bias by then; if not, static initialisation, zero-rate updates and VQF have no rate,
    /// and get the gyro's.
    pub is_rested: bool,
    pub heading: ByMethod<f64>,
    /// Distance by the wheels, or by GNSS of a drive without them, m, and what the errors of the heading move its end by, m.
    pub position: Option<(f64, ByMethod<f64>)>,
    /// The error that the board expects of its heading, rad, over whole minutes: the sum of the minutes' doubts.
    pub expected: Option<f64>,
}

/// Returns why no outage has an error: what a drive lacks for one of so many seconds.
pub fn no_start(seconds: usize) -> String {
    let CourseConfig { slowest, across, .. } = CourseConfig::DEFAULT;
    format!(
        "no start of an outage: a drive needs {} s with a course every 2 s (columns course and gnss_speed, or gnss_lat and \
         gnss_lon; below {slowest} m/s a course_sigma of {:.3} rad at most), then {seconds} s, and a reference (ref_gyr_z or \
         ref_yaw)",
        AFTER_S[1],
        across / slowest
    )
}

#[derive(Clone)]
struct Shared<'a>(Rc<RefCell<&'a mut dyn WindowNetwork>>);

impl WindowNetwork for Shared<'_> {
    fn estimate(&mut self, window: &[Features; WINDOW]) -> Estimate {
        self.0.borrow_mut().estimate(window)
    }
}

/// Runs every method through the outages of a drive, which may begin in motion; also returns the time driven with a
/// course, s. `ours` configures the boards with the course, and its zero-rate updates those without.
pub fn run(
    drive: &Drive<'_>,
    network: &mut dyn WindowNetwork,
    lengths_s: &[usize],
    every_s: usize,
    ours: PipelineConfig,
    progress: impl FnMut(),
) -> Result<(Vec<Outage>, f64), DataError> {
    let race = Race::run(drive, network, lengths_s, Starts::Every(every_s * SECOND), ours, progress)?;
    Ok((race.found, race.driven_s))
}

/// Runs one outage again, and returns the way through it at every half second.
pub fn trace(
    drive: &Drive<'_>,
    network: &mut dyn WindowNetwork,
    outage: &Outage,
    ours: PipelineConfig,
) -> Result<Vec<Point>, DataError> {
    let start = (outage.start_s / DT).round() as usize;
    Ok(Race::run(drive, network, &[outage.seconds], Starts::At(start), ours, || {})?.trace)
}

/// The boards with the course: without the model, and with it.
#[derive(Clone)]
struct Boards<'a> {
    no_model: Board<Uncorrected>,
    model: Board<Shared<'a>>,
}

impl Boards<'_> {
    fn row(&mut self, row: &Row) -> Option<[Step; 2]> {
        // A start that is refused in motion is no error here.
        let (no_model, model) = (self.no_model.row(row).ok().flatten(), self.model.row(row).ok().flatten());
        no_model.zip(model).map(|(no_model, model)| [no_model, model])
    }

    fn end(&mut self) -> Option<[Step; 2]> {
        self.no_model.end().zip(self.model.end()).map(|(no_model, model)| [no_model, model])
    }
}

/// The boards and filters of one drive, and the outages in progress.
struct Race<'a> {
    lengths: Vec<usize>,
    boards: Boards<'a>,
    zero_rate: Board<Uncorrected>,
    ekf: ekf::Filter,
    vqf: vqf::Heading,
    speeds: Option<Speeds>,
    /// Newest speed by GNSS, m/s, and its time, us.
    gnss_speed: Option<(f64, u64)>,
    /// Time of the newest course, us, and the time driven with one, s.
    newest: Option<u64>,
    driven_s: f64,
    /// The bias of static initialisation, readings of the last two seconds, and the updates at standstill so far.
    static_bias: Option<[f64; 3]>,
    gyro: VecDeque<f64>,
    updates: u32,
    reference: Reference,
    running: Vec<Running<'a>>,
    found: Vec<Outage>,
    starts: Starts,
    trace: Vec<Point>,
}

/// The rows at which GNSS is lost: every so many, or one whose way is kept.
#[derive(Clone, Copy)]
enum Starts {
    Every(usize),
    At(usize),
}

struct Running<'a> {
    start: usize,
    driven_s: f64,
    /// Copies that get no course any more.
    boards: Boards<'a>,
    /// Known once the boards give out the step of the start.
    begun: Option<Begun>,
    path: Path,
    /// The sum of the doubts of its minutes, rad, unless one is unknown.
    doubts: Option<f64>,
}

/// The copy of the filter, and the gyro's sum less the true heading at the start.
struct Begun {
    ekf: ekf::Filter,
    median: f64,
    is_rested: bool,
}

/// The gyro's sum less the true heading.
#[derive(Default)]
struct Reference {
    by_course: OffCourse,
    by_rate: f64,
    recent: VecDeque<Option<f64>>,
}

impl Reference {
    fn add(&mut self, gyro: f64, row: &Row) {
        self.recent.push_back(match row.reference {
            Some(rate) => {
                self.by_rate += (gyro - rate) * DT;
                Some(self.by_rate)
            }
            None => self.by_course.add(gyro, row.course),
        });
        if self.recent.len() > MEDIAN {
            self.recent.pop_front();
        }
    }

    fn median(&self) -> Option<f64> {
        median(self.recent.iter().flatten().copied().collect())
    }
}

impl<'a> Race<'a> {
    fn run(
        drive: &Drive<'_>,
        network: &'a mut dyn WindowNetwork,
        lengths_s: &[usize],
        starts: Starts,
        ours: PipelineConfig,
        mut progress: impl FnMut(),
    ) -> Result<Self, DataError> {
        let mut race = Self::new(drive, Shared(Rc::new(RefCell::new(network))), lengths_s, starts, ours);
        for (at, row) in drive.rows()?.enumerate() {
            race.row(at, &row?);
            progress();
            if matches!(starts, Starts::At(start) if at > start) && race.running.is_empty() {
                return Ok(race);
            }
        }
        race.end();
        Ok(race)
    }

    fn new(
        drive: &Drive<'_>,
        network: Shared<'a>,
        lengths_s: &[usize],
        starts: Starts,
        ours: PipelineConfig,
    ) -> Self {
        let classical = PipelineConfig { zero_rate: ours.zero_rate, ..PipelineConfig::DEFAULT };
        let no_model = Board::new(silent(ours), drive.wheels(), Uncorrected).moving(true);
        let model = Board::new(silent(ours), drive.wheels(), network).moving(true);
        Self {
            lengths: lengths_s.to_vec(),
            boards: Boards { no_model, model },
            zero_rate: Board::new(silent(classical), drive.wheels(), Uncorrected).moving(false),
            ekf: ekf::Filter::default(),
            vqf: vqf::Heading::new(vqf::on_a_vehicle()),
            speeds: drive.speeds(),
            gnss_speed: None,
            newest: None,
            driven_s: 0.0,
            static_bias: None,
            gyro: VecDeque::new(),
            updates: 0,
            reference: Reference::default(),
            running: Vec::new(),
            found: Vec::new(),
            starts,
            trace: Vec::new(),
        }
    }

    fn row(&mut self, at: usize, row: &Row) {
        let hidden = Row { heading: None, ..*row };
        let copies = self.running.iter_mut().map(|outage| outage.boards.row(&hidden)).collect();
        let zero_rate = self.zero_rate.row(row).ok().flatten();
        if let Some((steps, zero_rate)) = self.boards.row(row).zip(zero_rate) {
            self.step(&steps, &zero_rate, copies);
        }
        self.listen(row);
        let starts = match self.starts {
            Starts::Every(rows) => {
                at.is_multiple_of(rows) && AFTER_S.iter().any(|after| self.driven_s >= *after as f64)
            }
            Starts::At(row) => at == row,
        };
        if starts {
            let (boards, driven_s) = (self.boards.clone(), self.driven_s);
            self.running.push(Running {
                start: at,
                driven_s,
                boards,
                begun: None,
                path: Path::default(),
                doubts: Some(0.0),
            });
        }
    }

    fn end(&mut self) {
        while let Some((steps, zero_rate)) = self.boards.end().zip(self.zero_rate.end()) {
            let copies = self.running.iter_mut().map(|outage| outage.boards.end()).collect();
            self.step(&steps, &zero_rate, copies);
        }
    }

    fn listen(&mut self, row: &Row) {
        if row.heading.is_some_and(|heading| CourseConfig::DEFAULT.sigma(&heading).is_some()) {
            let now = row.sample.time.0;
            let since = self.newest.replace(now).map_or(0.0, |last| (now - last) as f64 * 1e-6);
            self.driven_s += if since < APART_S { since } else { 0.0 };
        }
    }

    /// Adds a step of the boards and of their copies to every method.
    fn step(&mut self, [_, model]: &[Step; 2], zero_rate: &Step, copies: Vec<Option<[Step; 2]>>) {
        let row = &model.input;
        let [x, y, gyro] = row.sample.angular_rate.map(AngularRate::rad_per_sec);
        self.reference.add(gyro, row);
        let pipeline = self.zero_rate.coprocessor().pipeline();
        let known = pipeline.gyro_bias().filter(|_| self.static_bias.is_none());
        let known = known.map(|bias| bias.map(AngularRate::rad_per_sec));
        self.static_bias = self.static_bias.or(known);
        let [bx, by, bias] = self.static_bias.unwrap_or_default();
        let updates = pipeline.counters().zero_rate_updates;
        let force = row.sample.specific_force.map(SpecificForce::metre_per_sec2);
        let vqf = self.vqf.rate([x - bx, y - by, gyro - bias], force);
        // The update is of the second before the newest one.
        self.gyro.push_back(gyro);
        let ended = self.gyro.len() > 2 * SECOND && self.gyro.pop_front().is_some() && updates > self.updates;
        let mean = ended.then(|| self.gyro.iter().take(SECOND).sum::<f64>() / SECOND as f64);
        self.updates = updates;
        let stands = model.standstill == Standstill::Still;
        let filtered = |ekf: &mut ekf::Filter| {
            known.map(|[.., z]| z).into_iter().chain(mean).for_each(|mean| ekf.standstill(mean));
            ekf.sample(gyro, stands)
        };
        filtered(&mut self.ekf);
        if let Some(heading) = &row.heading {
            self.ekf.course(heading);
        }
        let now = row.sample.time.0;
        self.gnss_speed = row.speed.map(|speed| (speed, now)).or(self.gnss_speed);
        let by_gnss = self.gnss_speed.filter(|(_, at)| (now - at) as f64 * 1e-6 < APART_S);
        let speed = self.speeds.as_mut().map(|speeds| speeds.next(row)).or(by_gnss.map(|(speed, _)| speed));
        let has_speed = self.speeds.is_some() || self.gnss_speed.is_some();
        let (median, lengths, found) = (self.reference.median(), &self.lengths, &mut self.found);
        let mut trace = matches!(self.starts, Starts::At(_)).then_some(&mut self.trace);
        let mut copies = copies.into_iter();
        self.running.retain_mut(|outage| {
            let Some(Some([own_no_model, own])) = copies.next() else { return false };
            if own.row <= outage.start {
                if own.row == outage.start {
                    let is_rested = self.static_bias.is_some();
                    outage.begun = median.map(|median| Begun { ekf: self.ekf.clone(), median, is_rested });
                }
                return own.row < outage.start || outage.begun.is_some();
            }
            let Some(begun) = &mut outage.begun else { return false };
            let rate = |step: &Step| step.delayed.map_or(gyro, |sent| sent.rate.rad_per_sec());
            let rates = [
                gyro - bias,
                rate(zero_rate),
                vqf,
                filtered(&mut begun.ekf),
                rate(&own_no_model),
                rate(&own),
            ];
            outage.path.add(rates, gyro, median.map_or(0.0, |median| median - begun.median), speed);
            let steps = own.row - outage.start;
            let is_minute = steps.is_multiple_of(MINUTE);
            if is_minute {
                let doubt = outage.boards.model.coprocessor().pipeline().status(None).doubt;
                let doubt = doubt.map(|hundredths| (f64::from(hundredths) / 100.0).to_radians());
                outage.doubts = outage.doubts.zip(doubt).map(|(before, doubt)| before + doubt);
            }
            if let Some(trace) = &mut trace
                && steps.is_multiple_of(SECOND / 2)
            {
                trace.push(outage.path.point(has_speed));
            }
            if let Some(seconds) = lengths.iter().copied().find(|seconds| seconds * SECOND == steps)
                && median.is_some()
            {
                let Point { heading, position } = outage.path.point(has_speed);
                found.push(Outage {
                    driven_s: outage.driven_s,
                    seconds,
                    start_s: outage.start as f64 * DT,
                    is_rested: begun.is_rested,
                    heading: heading.map(|off| wrap(off).abs()),
                    position,
                    expected: outage.doubts.filter(|_| is_minute),
                });
            }
            lengths.iter().any(|seconds| seconds * SECOND > steps)
        });
    }
}
