//! Compares wheels and gyro: the speed difference of right and left, over the track, is the yaw rate.

use super::finding::Finding;
use super::line::{DEGREES, KMH, Line, confused, seconds};
use super::recording::Rows;
use super::remedy;

/// Fewest seconds of turning for a comparison.
const LEAST_TURNING_S: usize = 5;
/// Mean yaw rate above which a second counts as turning, rad/s.
const TURNS: f64 = 0.05;

pub fn finding(rows: &Rows) -> Finding {
    let what = "wheels";
    let known = rows.wheels.iter().filter(|wheel| wheel.iter().any(Option::is_some)).count();
    if known == 0 {
        return Finding::note(what, "None: no standstill by the wheels, and no speed.");
    }
    let Some(Line { slope, correlation, offset, .. }) = compare(rows) else {
        return Finding::note(
            what,
            format!(
                "{known} recorded; no axle has both wheels, at different speeds, in enough turns to compare them with the gyro."
            ),
        );
    };
    let radius = rows.vehicle.radius_m();
    let track = slope * radius;
    let named = rows.vehicle.wheels.track_m.map(|track| format!(" ({track} m in the vehicle file)"));
    let text = format!(
        "{known} recorded; left and right against the gyro: correlation {correlation:.3}, track {track:.2} m at a radius of {radius} m{}, {offset:+.3} rad/s apart when driving straight",
        named.unwrap_or_default()
    );
    if let Some(wrong) = units(rows, track, correlation) {
        Finding::bad(what, format!("{text}: {wrong}."))
    } else if correlation > 0.9 && (0.2..4.0).contains(&track) {
        Finding::good(what, format!("{text}."))
    } else if correlation < -0.9 {
        Finding::bad(what, format!("{text}: left and right are swapped, or z is down."))
    } else {
        Finding::note(what, format!("{text}: usable for standstill and speed, not for the yaw rate."))
    }
}

/// A confusion of units, by the track that the wheels and the gyro have together.
fn units(rows: &Rows, track: f64, correlation: f64) -> Option<String> {
    let named = rows.vehicle.wheels.track_m;
    // Without a named track, that of a car or a truck.
    let fits = |ratio: f64| match named {
        Some(named) => confused(track / named, ratio),
        None => !(0.5..3.0).contains(&track) && (1.0..2.6).contains(&(track / ratio)),
    };
    if correlation < 0.9 {
        None
    } else if fits(1.0 / DEGREES) {
        Some(remedy::imu(rows, "deg/s"))
    } else if fits(KMH) {
        Some(format!("the wheels are in km/h; {}", in_kmh(rows)))
    } else {
        None
    }
}

/// The import with the unit of each wheel, or of the odometry that stands for them.
pub fn in_kmh(rows: &Rows) -> String {
    let wheels = &rows.vehicle.wheels;
    let names = [&wheels.front_left, &wheels.front_right, &wheels.rear_left, &wheels.rear_right];
    let mut flags: Vec<String> =
        names.into_iter().flatten().map(|name| format!("--unit {name}=km/h")).collect();
    if let (true, Some(odometry)) = (flags.is_empty(), rows.vehicle.signals.get("odometry")) {
        flags.push(format!("--unit {odometry}=km/h"));
    } else if flags.is_empty() {
        let number =
            (1..=rows.wheels.len()).filter(|wheel| rows.wheels[wheel - 1].iter().any(Option::is_some));
        flags = number.map(|wheel| format!("--unit wheel{wheel}_rate=km/h")).collect();
    }
    remedy::import(rows, &flags.join(" "))
}

/// Compares means over seconds. Wheels 1 and 2 are right, 3 and 4 left, 1 and 3 at the front. Returns the rate
/// difference, rad/s, over the yaw rate: its slope is the track over the radius. `None` if no axle has both wheels or
/// the drive hardly turns.
fn compare(rows: &Rows) -> Option<Line> {
    for (right, left) in [(1, 3), (0, 2)] {
        let (right, left) = (&rows.wheels[right], &rows.wheels[left]);
        let seconds = seconds(rows, 5, |k| Some((rows.rate[k][2], right[k]? - left[k]?)));
        if seconds.iter().filter(|(rate, _)| rate.abs() > TURNS).count() >= LEAST_TURNING_S {
            return Line::of(&seconds);
        }
    }
    None
}
