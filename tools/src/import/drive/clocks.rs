//! Aligns the clocks of several files with the clock of the IMU's file, by the yaw rates that both have.

use super::{Request, channels};
use crate::drive::DT;
use crate::drive::vehicle::Vehicle;
use crate::import::align::{self, Offset};
use crate::import::course::{Course, courses};
use crate::import::error::ImportError;
use crate::import::grid::{Grid, Stream};
use crate::import::select::{Channel, File, Selection};

/// Returns the offset to add to the times of each file, s.
pub(super) fn offsets(
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
    let mounting = &request.vehicle.mounting;
    let yaw = move |(seconds, [.., x, y, z]): (f64, [f64; 6])| (seconds, [mounting.turn([x, y, z])[2]]);
    let turning = thinned(|| Box::new(selection.imu.imu().map(yaw)));
    let used = |file: usize| channels(selection).any(|channel| channel.file == file);
    for (file, File { path, .. }) in files.iter().enumerate().filter(|(file, _)| *file != main && used(*file))
    {
        let clock =
            |reason| ImportError::Clock { path: path.clone(), first: files[main].path.clone(), reason };
        let (rate, of) = rate_of(file, selection, &request.vehicle).ok_or_else(|| {
            clock(
                "the file has no yaw rate to compare: name a channel with one, or pass --same-clock"
                    .to_owned(),
            )
        })?;
        let Offset { seconds, coefficient } = align::offset(&turning, &rate).map_err(clock)?;
        report.push(format!(
            "{path}: clock moved by {seconds:+.3} s, where {of} agrees with the gyro (correlation {coefficient:.3})"
        ));
        offsets[file] = seconds;
    }
    Ok(offsets)
}

/// Returns a yaw rate of a file and its name: the reference, odometry, wheel difference, or change of course.
fn rate_of(file: usize, selection: &Selection<'_>, vehicle: &Vehicle) -> Option<(Vec<(f64, f64)>, String)> {
    let here = |channel: &Option<Channel<'_>>| channel.as_ref().is_some_and(|channel| channel.file == file);
    let own = [&selection.reference_rate, &selection.odometry].into_iter().find(|channel| here(channel));
    if let Some(channel) = own.and_then(Option::as_ref) {
        return Some((thinned(|| channel.yaw_rate()), channel.name.to_owned()));
    }
    let [fr, rr, fl, rl] = &selection.wheels;
    for (right, left) in [(rr, rl), (fr, fl)] {
        let (Some(right), Some(left)) =
            (right.as_ref().filter(|_| here(right)), left.as_ref().filter(|_| here(left)))
        else {
            continue;
        };
        let scale = if left.speed().1 { vehicle.radius_m() } else { 1.0 };
        let track = vehicle.wheels.track_m.unwrap_or(1.5);
        let start = right.samples.first().0.max(left.samples.first().0);
        let end = right.samples.last().0.min(left.samples.last().0);
        let seconds = (end - start).clamp(0.0, align::LONGEST);
        let (right, left) =
            (Grid::new(|| right.speed().0, 0.0, start), Grid::new(|| left.speed().0, 0.0, start));
        let both = right.zip(left).take((seconds / DT) as usize);
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

/// Returns the part of a rate that is compared; values that are closer than 5 ms are averaged.
fn thinned<'a>(stream: impl Fn() -> Stream<'a, 1>) -> Vec<(f64, f64)> {
    let start = stream().next().map_or(0.0, |(seconds, _)| seconds);
    let near = stream().take_while(|(seconds, _)| seconds - start < align::LONGEST);
    let mut thin: Vec<(f64, f64)> = Vec::new();
    // Number of values in the last mean.
    let mut count = 0.0;
    for (seconds, [rate]) in near {
        match thin.last_mut() {
            Some((from, mean)) if seconds - *from < 0.5 * DT => {
                count += 1.0;
                *from += (seconds - *from) / count;
                *mean += (rate - *mean) / count;
            }
            _ => {
                count = 1.0;
                thin.push((seconds, rate));
            }
        }
    }
    thin
}
