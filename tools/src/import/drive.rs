//! Makes one drive from one or more logs. It chooses the channels, aligns the clocks and resamples
//! everything to a 100 Hz grid on the clock of the IMU's file, with one row in memory at a time.

mod clocks;
mod csv;

use super::can::Bus;
use super::course::{Course, courses};
use super::error::ImportError;
use super::format::read_into;
use super::grid::{self, Grid, Stream};
use super::log::Log;
use super::select::{self, Channel, File, Selection, select};
use crate::drive::DT;
use crate::drive::vehicle::Vehicle;
use std::path::PathBuf;

/// Length of the shortest drive, s.
const SHORTEST: f64 = 3.0;
/// Length of the longest drive, s: a day.
const LONGEST: f64 = 86_400.0;
/// IMU sample rates that can be resampled, Hz.
const RATES: std::ops::RangeInclusive<f64> = 24.5..=1_020.0;
/// Least overlap of the odometry with the IMU, s.
const OVERLAP: f64 = 3.0;

/// The request of the user.
#[derive(Debug, Clone, Default)]
pub struct Request {
    /// Paths of the logs; the drive has the clock of the log with the IMU.
    pub files: Vec<PathBuf>,
    /// Contents of the vehicle file.
    pub vehicle: Vehicle,
    pub same_clock: bool,
    /// Time to skip at the beginning, s.
    pub from: f64,
}

/// One row of a drive; unknown values are `None`.
#[derive(Debug, Clone, PartialEq)]
pub struct Row {
    /// Seconds since the first row.
    pub seconds: f64,
    /// Specific force, m/s^2, and angular rate, rad/s, in the vehicle's axes.
    pub imu: [f64; 6],
    /// The reference yaw rate, rad/s.
    pub reference: Option<f64>,
    /// Course, rad to the left, its standard deviation, rad, and the speed, m/s.
    pub course: Option<[f64; 3]>,
    /// Rates of the wheels, rad/s: front right, rear right, front left, rear left.
    pub wheels: [Option<f64>; 4],
}

#[derive(Debug)]
pub struct Logs {
    files: Vec<File>,
    report: Vec<String>,
    /// Number of records that could not be used.
    pub dropped: u64,
}

impl Logs {
    pub fn read(request: &Request) -> Result<Self, ImportError> {
        let bus = request.vehicle.bus.dbc.as_deref().map(Bus::read).transpose()?;
        let mut files = Vec::new();
        let mut report = Vec::new();
        for path in &request.files {
            let log = Log { wanted: Some(select::numbers(&request.vehicle)), ..Log::default() };
            let log = read_into(path, bus.as_ref(), &request.vehicle.columns, log)?;
            let path = path.display().to_string();
            for (reason, count) in &log.dropped {
                report.push(format!("{path}: dropped {count}: {reason}"));
            }
            let passed_over: u64 = log.passed_over.values().sum();
            if passed_over > 0 {
                let kinds: Vec<&str> = log.passed_over.keys().map(String::as_str).take(6).collect();
                report.push(format!(
                    "{path}: {passed_over} records of kinds that a drive does not need: {}",
                    kinds.join(", ")
                ));
            }
            files.push(File { path, log });
        }
        let dropped = files.iter().flat_map(|file| file.log.dropped.values()).sum();
        Ok(Self { files, report, dropped })
    }

    pub fn drive<'a>(&'a self, request: &'a Request) -> Result<Drive<'a>, ImportError> {
        let mut report = self.report.clone();
        let selection = select(&self.files, &request.vehicle)?;
        let offsets = clocks::offsets(&self.files, &selection, request, &mut report)?;
        let (start, count) = span(&selection, request, &mut report)?;
        let mut drive = Drive {
            has_odometry: has_odometry(&selection, &offsets, &request.vehicle, start, &mut report),
            courses: courses_by_row(&selection, &offsets, start, &mut report),
            selection,
            offsets,
            vehicle: &request.vehicle,
            start,
            count,
            report,
            seen: Seen::default(),
        };
        let mut seen = Seen::default();
        drive.rows().for_each(|row| seen.add(&row));
        drive.check(&self.files)?;
        let missing = count - seen.rows;
        if missing > 0 {
            drive.report.push(format!("imu: {missing} of {count} rows are in gaps and left out"));
        }
        drive.seen = seen;
        Ok(drive)
    }
}

/// A summary of all rows.
#[derive(Debug, Clone, Copy, Default)]
pub struct Seen {
    /// The number of rows.
    pub rows: usize,
    /// The time of the last row, s.
    pub seconds: f64,
    reference: bool,
    course: bool,
    wheels: [bool; 4],
}

impl Seen {
    fn add(&mut self, row: &Row) {
        self.rows += 1;
        self.seconds = row.seconds;
        self.reference |= row.reference.is_some();
        self.course |= row.course.is_some();
        for (seen, wheel) in self.wheels.iter_mut().zip(row.wheels) {
            *seen |= wheel.is_some();
        }
    }
}

/// A drive whose rows are computed on demand.
#[derive(Debug)]
pub struct Drive<'a> {
    selection: Selection<'a>,
    offsets: Vec<f64>,
    vehicle: &'a Vehicle,
    start: f64,
    count: usize,
    /// Each course with the index of the nearest row; other rows have no course.
    courses: Vec<(usize, [f64; 3])>,
    has_odometry: bool,
    /// Lines for the user: which channels were used, how, and what was dropped.
    pub report: Vec<String>,
    /// The summary of the rows.
    pub seen: Seen,
}

fn channels<'s>(selection: &'s Selection<'_>) -> impl Iterator<Item = &'s Channel<'s>> {
    let others = [&selection.odometry, &selection.position, &selection.reference_rate];
    std::iter::once(&selection.imu)
        .chain(others.into_iter().flatten())
        .chain(selection.wheels.iter().flatten())
}

/// Returns the time of the first row and the number of rows.
fn span(
    selection: &Selection<'_>,
    request: &Request,
    report: &mut Vec<String>,
) -> Result<(f64, usize), ImportError> {
    let channel = selection.imu.name.to_owned();
    let start = selection.imu.samples.first().0 + request.from;
    let seconds = selection.imu.samples.last().0 - start;
    if !(SHORTEST..LONGEST).contains(&seconds) {
        return Err(ImportError::Short { channel, seconds });
    }
    let hz = grid::rate(selection.imu.imu()).unwrap_or_default();
    if !RATES.contains(&hz) {
        return Err(ImportError::Rate { channel, hz });
    }
    report.push(format!("imu: {channel}, {hz:.1} Hz to 100 Hz: {}", grid::method(hz)));
    Ok((start, (seconds / DT) as usize + 1))
}

/// Reports which channels give the wheels; returns whether an odometry gives them.
fn has_odometry(
    selection: &Selection<'_>,
    offsets: &[f64],
    vehicle: &Vehicle,
    start: f64,
    report: &mut Vec<String>,
) -> bool {
    if let Some(channel) = &selection.reference_rate {
        report.push(format!("reference rate: {}", channel.name));
    }
    let radius = vehicle.radius_m();
    let assumed = if vehicle.wheels.radius_m.is_some() { "" } else { " (assumed; set wheels.radius_m)" };
    if let Some(channel) = &selection.odometry {
        let overlap = channel.samples.last().0 + offsets[channel.file] - start;
        if overlap < OVERLAP {
            report.push(format!("wheels: {} does not overlap with the IMU in time", channel.name));
            return false;
        }
        report.push(format!("wheels: the rear wheels from {}, radius {radius} m{assumed}", channel.name));
        return true;
    }
    let names: Vec<&str> = selection.wheels.iter().flatten().map(|channel| channel.name).collect();
    if !names.is_empty() {
        report.push(format!("wheels: {}, radius {radius} m{assumed}", names.join(", ")));
    }
    false
}

/// Returns each course with the index of the nearest row.
fn courses_by_row(
    selection: &Selection<'_>,
    offsets: &[f64],
    start: f64,
    report: &mut Vec<String>,
) -> Vec<(usize, [f64; 3])> {
    let Some(channel) = &selection.position else { return Vec::new() };
    let courses = courses(&channel.fixes());
    let mut sigmas: Vec<f64> = courses.iter().map(|course| course.sigma).collect();
    sigmas.sort_unstable_by(f64::total_cmp);
    let middle = sigmas
        .get(sigmas.len() / 2)
        .map_or("no course".to_owned(), |sigma| format!("median sigma {sigma:.3} rad"));
    report.push(format!(
        "position: {}, {} courses of {} fixes, {middle}",
        channel.name,
        courses.len(),
        channel.samples.len()
    ));
    let row = |course: &Course| {
        let at = ((course.seconds + offsets[channel.file] - start) / DT).round();
        (at >= 0.0).then_some((at as usize, [course.rad, course.sigma, course.speed]))
    };
    courses.iter().filter_map(row).collect()
}

impl<'a> Drive<'a> {
    /// Returns the rows; rows in a gap of the IMU are left out.
    pub fn rows(&self) -> impl Iterator<Item = Row> {
        let start = self.start;
        let mut imu = Grid::new(|| self.selection.imu.imu(), 0.0, start);
        let mut reference = self.grid(self.selection.reference_rate.as_ref(), Channel::yaw_rate);
        let odometry = self.selection.odometry.as_ref().filter(|_| self.has_odometry);
        let mut odometry = self.grid(odometry, Channel::odometry);
        let mut wheels = self
            .selection
            .wheels
            .each_ref()
            .map(|wheel| self.grid(wheel.as_ref(), |channel| channel.speed().0));
        let (half, radius) = (0.5 * self.vehicle.wheels.track_m.unwrap_or_default(), self.vehicle.radius_m());
        let scales = self.selection.wheels.each_ref().map(|wheel| {
            let is_rate = wheel.as_ref().is_some_and(|wheel| wheel.speed().1);
            if is_rate { 1.0 } else { 1.0 / radius }
        });
        let mut courses = self.courses.iter().peekable();
        let row = move |k| {
            let imu = imu.next().flatten();
            let reference = reference.as_mut().and_then(|grid| grid.next().flatten());
            let mut rates: [Option<f64>; 4] = std::array::from_fn(|wheel| {
                let [speed] = wheels[wheel].as_mut()?.next()??;
                Some(scales[wheel] * speed)
            });
            if let Some([speed, turn]) = odometry.as_mut().and_then(|grid| grid.next().flatten()) {
                rates =
                    [None, Some((speed + half * turn) / radius), None, Some((speed - half * turn) / radius)];
            }
            let mut course = None;
            while let Some((at, value)) = courses.next_if(|(at, _)| *at <= k) {
                course = (*at == k).then_some(*value);
            }
            let [fx, fy, fz, wx, wy, wz] = imu?;
            let [[fx, fy, fz], [wx, wy, wz]] =
                [[fx, fy, fz], [wx, wy, wz]].map(|vector| self.vehicle.mounting.turn(vector));
            let (seconds, imu) = (DT * k as f64, [fx, fy, fz, wx, wy, wz]);
            Some(Row { seconds, imu, reference: reference.map(|[rate]| rate), course, wheels: rates })
        };
        (0..self.count).filter_map(row)
    }

    /// Resamples a channel to the rows.
    fn grid<'s, const N: usize>(
        &'s self,
        channel: Option<&'s Channel<'a>>,
        of: fn(&Channel<'a>) -> Stream<'a, N>,
    ) -> Option<Grid<'a, N>> {
        let channel = channel?;
        Some(Grid::new(|| of(channel), self.offsets[channel.file], self.start))
    }

    /// Checks that all samples could be read back from the temporary files.
    fn check(&self, files: &[File]) -> Result<(), ImportError> {
        let failed =
            channels(&self.selection).find_map(|channel| Some((channel.file, channel.samples.failure()?)));
        failed
            .map_or(Ok(()), |(file, source)| Err(ImportError::Io { path: files[file].path.clone(), source }))
    }
}
