//! A drive from one or more logs: channels chosen, clocks aligned, everything on the 100 Hz grid of the IMU's file.

use super::align::{self, Offset};
use super::can::Bus;
use super::course::{Course, courses};
use super::error::ImportError;
use super::format::read_into;
use super::grid::{self, resample};
use super::log::Log;
use super::select::{self, Channel, File, Selection, select};
use crate::drive::DT;
use crate::drive::vehicle::Vehicle;
use std::io::{self, Write};
use std::path::PathBuf;

/// The shortest drive, s.
const SHORTEST: f64 = 3.0;
/// The longest, s: a day.
const LONGEST: f64 = 86_400.0;
/// Rates that the grid takes, Hz.
const RATES: std::ops::RangeInclusive<f64> = 24.5..=1_020.0;
/// A clock that both files share overlaps at least so much, s.
const OVERLAP: f64 = 3.0;

/// Holds what the user asks for.
#[derive(Debug, Clone, Default)]
pub struct Request {
    /// The logs; the one with the IMU gives the time.
    pub files: Vec<PathBuf>,
    /// The vehicle file's contents.
    pub vehicle: Vehicle,
    /// The files' clocks are one.
    pub same_clock: bool,
    /// Seconds from the first sample that are left out.
    pub from: f64,
}

/// One row of a drive; values that are not known are `None`.
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

/// A drive that was made.
#[derive(Debug)]
pub struct Imported {
    /// Its rows; those in a gap of the IMU are missing.
    pub rows: Vec<Row>,
    /// One line for each thing that a user should know: what was taken, how, and what was dropped.
    pub report: Vec<String>,
    /// Records that could not be used.
    pub dropped: u64,
}

/// Reads logs and makes one drive of them.
///
/// # Errors
/// [`ImportError`].
pub fn import(request: &Request) -> Result<Imported, ImportError> {
    let bus = request.vehicle.bus.dbc.as_deref().map(Bus::read).transpose()?;
    let mut files = Vec::new();
    for path in &request.files {
        let log = Log { wanted: Some(select::numbers(&request.vehicle)), ..Log::default() };
        let log = read_into(path, bus.as_ref(), &request.vehicle.columns, log)?;
        files.push(File { path: path.display().to_string(), log });
    }
    let mut report = Vec::new();
    for File { path, log } in &files {
        for (reason, count) in &log.dropped {
            report.push(format!("{path}: dropped {count}: {reason}"));
        }
        let passed_over: u64 = log.passed_over.values().sum();
        if passed_over > 0 {
            let kinds: Vec<&str> = log.passed_over.keys().map(String::as_str).take(6).collect();
            report.push(format!("{path}: {passed_over} records of no use to a drive: {}", kinds.join(", ")));
        }
    }
    let dropped = files.iter().flat_map(|file| file.log.dropped.values()).sum();
    let selection = select(&files, &request.vehicle)?;
    let offsets = clocks(&files, &selection, request, &mut report)?;
    let rows = rows(&selection, &offsets, request, &mut report)?;
    Ok(Imported { rows, report, dropped })
}

/// These are added to the times of each file.
fn clocks(
    files: &[File],
    selection: &Selection<'_>,
    request: &Request,
    report: &mut Vec<String>,
) -> Result<Vec<f64>, ImportError> {
    let mut offsets = vec![0.0; files.len()];
    let main = selection.imu.file;
    if request.same_clock || files.len() == 1 {
        return Ok(offsets);
    }
    let imu = selection.imu.imu();
    let mounting = &request.vehicle.mounting;
    let turning: Vec<(f64, f64)> =
        imu.iter().map(|(seconds, [.., x, y, z])| (*seconds, mounting.turn([*x, *y, *z])[2])).collect();
    let used = |file: usize| all(selection).any(|channel| channel.file == file);
    for (file, File { path, .. }) in files.iter().enumerate().filter(|(file, _)| *file != main && used(*file))
    {
        let clock =
            |reason| ImportError::Clock { path: path.clone(), first: files[main].path.clone(), reason };
        let (rate, of) = rate_of(file, selection, &request.vehicle).ok_or_else(|| {
            clock("it has no yaw rate to compare: name one, or give --same-clock".to_owned())
        })?;
        let Offset { seconds, coefficient } = align::offset(&turning, &rate).map_err(clock)?;
        report.push(format!(
            "{path}: clock moved by {seconds:+.3} s, where {of} agrees with the gyro (correlation {coefficient:.3})"
        ));
        offsets[file] = seconds;
    }
    Ok(offsets)
}

fn all<'s>(selection: &'s Selection<'_>) -> impl Iterator<Item = &'s Channel<'s>> {
    let others = [&selection.odometry, &selection.position, &selection.reference_rate];
    std::iter::once(&selection.imu)
        .chain(others.into_iter().flatten())
        .chain(selection.wheels.iter().flatten())
}

/// A yaw rate of a file: the vehicle's own, that of its odometry, its wheels' difference, or its course's change.
fn rate_of(file: usize, selection: &Selection<'_>, vehicle: &Vehicle) -> Option<(Vec<(f64, f64)>, String)> {
    let here = |channel: &Option<Channel<'_>>| channel.as_ref().is_some_and(|channel| channel.file == file);
    let plain =
        |series: Vec<(f64, [f64; 1])>| series.into_iter().map(|(seconds, [rate])| (seconds, rate)).collect();
    let own = [&selection.reference_rate, &selection.odometry].into_iter().find(|channel| here(channel));
    if let Some(channel) = own.and_then(Option::as_ref) {
        return Some((plain(channel.yaw_rate()), channel.name.to_owned()));
    }
    let [fr, rr, fl, rl] = &selection.wheels;
    for (right, left) in [(rr, rl), (fr, fl)] {
        let (Some(right), Some(left)) =
            (right.as_ref().filter(|_| here(right)), left.as_ref().filter(|_| here(left)))
        else {
            continue;
        };
        let ((right, _), (left, is_rate)) = (right.speed(), left.speed());
        let scale = if is_rate { vehicle.radius_m() } else { 1.0 };
        let track = vehicle.wheels.track_m.unwrap_or(1.5);
        let start = right.first()?.0.max(left.first()?.0);
        let count = ((right.last()?.0.min(left.last()?.0) - start) / DT).clamp(0.0, LONGEST / DT) as usize;
        let both = resample(&right, start, count).into_iter().zip(resample(&left, start, count));
        let rate = both.enumerate().filter_map(|(k, (right, left))| {
            Some((start + DT * k as f64, scale * (right?[0] - left?[0]) / track))
        });
        return Some((rate.collect(), "the difference of the wheels".to_owned()));
    }
    let position = selection.position.as_ref().filter(|channel| channel.file == file)?;
    let courses = courses(&position.fixes());
    let change = |pair: &[Course]| {
        let seconds = pair[1].seconds - pair[0].seconds;
        (seconds < 3.0)
            .then(|| (0.5 * (pair[0].seconds + pair[1].seconds), (pair[1].rad - pair[0].rad) / seconds))
    };
    Some((courses.windows(2).filter_map(change).collect(), "the change of the course".to_owned()))
}

fn rows(
    selection: &Selection<'_>,
    offsets: &[f64],
    request: &Request,
    report: &mut Vec<String>,
) -> Result<Vec<Row>, ImportError> {
    let vehicle = &request.vehicle;
    let imu = selection.imu.imu();
    let channel = selection.imu.name.to_owned();
    let (Some(first), Some(last)) = (imu.first(), imu.last()) else {
        return Err(ImportError::Short { channel, seconds: 0.0 });
    };
    let start = first.0 + request.from;
    let seconds = last.0 - start;
    if !(SHORTEST..LONGEST).contains(&seconds) {
        return Err(ImportError::Short { channel, seconds });
    }
    let hz = grid::rate(&imu).unwrap_or_default();
    if !RATES.contains(&hz) {
        return Err(ImportError::Rate { channel, hz });
    }
    let count = (seconds / DT) as usize + 1;
    report.push(format!("imu: {channel}, {hz:.1} Hz to 100 Hz: {}", grid::method(hz)));
    let imu = resample(&imu, start, count);
    let reference = selection.reference_rate.as_ref().map(|channel| {
        report.push(format!("reference rate: {}", channel.name));
        resample(&shifted(channel.yaw_rate(), offsets[channel.file]), start, count)
    });
    let wheels = wheels(selection, offsets, vehicle, (start, count), report);
    let course = selection.position.as_ref().map(|channel| {
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
        on_rows(&courses, start - offsets[channel.file], count)
    });
    let mut missing = 0;
    let rows: Vec<Row> = (0..count)
        .filter_map(|k| {
            let Some([fx, fy, fz, wx, wy, wz]) = imu[k] else {
                missing += 1;
                return None;
            };
            let ([fx, fy, fz], [wx, wy, wz]) =
                (vehicle.mounting.turn([fx, fy, fz]), vehicle.mounting.turn([wx, wy, wz]));
            Some(Row {
                seconds: DT * k as f64,
                imu: [fx, fy, fz, wx, wy, wz],
                reference: reference.as_ref().and_then(|reference| reference[k]).map(|[rate]| rate),
                course: course.as_ref().and_then(|course| course[k]),
                wheels: std::array::from_fn(|wheel| {
                    wheels[wheel].as_ref().and_then(|wheel| wheel[k]).map(|[rate]| rate)
                }),
            })
        })
        .collect();
    if missing > 0 {
        report.push(format!("imu: {missing} of {count} rows lie in gaps and are left out"));
    }
    Ok(rows)
}

type Grid = Option<Vec<Option<[f64; 1]>>>;

/// The rates of the wheels, rad/s: each by its own signal, or the rear ones by the odometry.
fn wheels(
    selection: &Selection<'_>,
    offsets: &[f64],
    vehicle: &Vehicle,
    (start, count): (f64, usize),
    report: &mut Vec<String>,
) -> [Grid; 4] {
    let radius = vehicle.radius_m();
    let assumed = if vehicle.wheels.radius_m.is_some() { "" } else { ", assumed: name wheels.radius_m" };
    if let Some(channel) = &selection.odometry {
        let speed = shifted(channel.odometry(), offsets[channel.file]);
        let half = 0.5 * vehicle.wheels.track_m.unwrap_or_default();
        let overlap = speed.last().map_or(0.0, |(seconds, _)| seconds - start);
        if overlap < OVERLAP {
            report.push(format!("wheels: {} has no time in common with the IMU", channel.name));
            return [const { None }; 4];
        }
        report.push(format!("wheels: the rear ones by {}, radius {radius} m{assumed}", channel.name));
        let grid = resample(&speed, start, count);
        let side = |sign: f64| {
            let rate = |[speed, turn]: [f64; 2]| [(speed + sign * half * turn) / radius];
            Some(grid.iter().map(|row| row.map(rate)).collect())
        };
        return [None, side(1.0), None, side(-1.0)];
    }
    let wheels = selection.wheels.map(|channel| {
        let channel = channel?;
        let (speed, is_rate) = channel.speed();
        let scale = if is_rate { 1.0 } else { 1.0 / radius };
        let rate = resample(&shifted(speed, offsets[channel.file]), start, count);
        Some(rate.into_iter().map(|row| row.map(|[rate]| [scale * rate])).collect())
    });
    let names: Vec<&str> = selection.wheels.iter().flatten().map(|channel| channel.name).collect();
    if !names.is_empty() {
        report.push(format!("wheels: {}, radius {radius} m{assumed}", names.join(", ")));
    }
    wheels
}

fn shifted<const N: usize>(mut series: Vec<(f64, [f64; N])>, offset: f64) -> Vec<(f64, [f64; N])> {
    for (seconds, _) in &mut series {
        *seconds += offset;
    }
    series
}

/// Each course in the row that is nearest to it; the rows between have none.
fn on_rows(courses: &[Course], start: f64, count: usize) -> Vec<Option<[f64; 3]>> {
    let mut rows = vec![None; count];
    for Course { seconds, rad, sigma, speed } in courses {
        let at = ((seconds - start) / DT).round();
        if at >= 0.0
            && let Some(row) = rows.get_mut(at as usize)
        {
            *row = Some([*rad, *sigma, *speed]);
        }
    }
    rows
}

/// Writes a drive as the CSV that every command reads; columns that are empty throughout are left out.
///
/// # Errors
/// The writer's.
pub fn write_csv(rows: &[Row], mut out: impl Write) -> io::Result<()> {
    let has_reference = rows.iter().any(|row| row.reference.is_some());
    let has_course = rows.iter().any(|row| row.course.is_some());
    let has_wheel: [bool; 4] =
        std::array::from_fn(|wheel| rows.iter().any(|row| row.wheels[wheel].is_some()));
    write!(out, "t_s,acc_x,acc_y,acc_z,gyr_x,gyr_y,gyr_z")?;
    if has_reference {
        write!(out, ",ref_gyr_z")?;
    }
    if has_course {
        write!(out, ",ref_yaw,ref_yaw_sigma,gnss_speed")?;
    }
    for wheel in (0..4).filter(|wheel| has_wheel[*wheel]) {
        write!(out, ",wheel{}_rate", wheel + 1)?;
    }
    writeln!(out)?;
    for row in rows {
        write!(out, "{:.2}", row.seconds)?;
        for value in row.imu {
            write!(out, ",{value:.7}")?;
        }
        if has_reference {
            field(&mut out, row.reference)?;
        }
        if has_course {
            for k in 0..3 {
                field(&mut out, row.course.map(|course| course[k]))?;
            }
        }
        for wheel in (0..4).filter(|wheel| has_wheel[*wheel]) {
            field(&mut out, row.wheels[wheel])?;
        }
        writeln!(out)?;
    }
    out.flush()
}

fn field(out: &mut impl Write, value: Option<f64>) -> io::Result<()> {
    match value {
        Some(value) => write!(out, ",{value:.6}"),
        None => write!(out, ","),
    }
}
