//! The recordings with a speed, and when their vehicles move and stand.

use gyronet_tools::drive::recording::{Reader, Row};
use gyronet_tools::drive::stream::Recording;
use gyronet_tools::drive::vehicle::Vehicle;
use std::path::Path;

/// Above this speed the vehicle moves, and below that it stands, m/s.
const MOVES: f64 = 0.3;
const STANDS: f64 = 0.15;
/// Rows by which the wheels of `utv` are late.
const LATE: usize = 100;

/// The truth in a recording: whether the vehicle moves or stands at each row, where that is known.
pub struct Truth {
    pub moves: Vec<bool>,
    pub stands: Vec<bool>,
}

impl Truth {
    /// By the recorded speed; by the wheels where there is none, or it is frozen until the first fix.
    pub fn read(path: &Path, recording: &Recording) -> Option<Self> {
        let text = std::fs::read_to_string(path).ok()?;
        let mut lines = text.lines();
        let header: Vec<&str> = lines.next()?.split(',').collect();
        let column = header.iter().position(|name| *name == "speed");
        let field = |line: &str| column.and_then(|column| line.split(',').nth(column)?.parse::<f64>().ok());
        let mut speeds: Vec<Option<f64>> = lines.map(field).collect();
        let frozen = speeds.iter().take(100).all(|speed| *speed == speeds[0]) && speeds[0] > Some(MOVES);
        let late = header.contains(&"can_speed");
        let by_wheels = column.is_none() || frozen;
        if by_wheels {
            let radius = recording.vehicle.radius_m();
            let fastest =
                |row: &Row| row.wheels.iter().flatten().map(|rate| rate.abs() * radius).reduce(f64::max);
            speeds = recording.rows.iter().map(fastest).collect();
        }
        let mut last = None;
        speeds.iter_mut().for_each(|speed| last = std::mem::replace(speed, speed.or(last)).or(last));
        let is = |check: &dyn Fn(f64) -> bool| speeds.iter().map(|speed| speed.is_some_and(check)).collect();
        let (moves, stands): (Vec<bool>, Vec<bool>) =
            (is(&|speed| speed > MOVES), is(&|speed| speed < STANDS));
        let near = |flags: &[bool], row: usize| {
            let span = row.saturating_sub(LATE)..(row + LATE).min(flags.len());
            late && flags[span].contains(&true)
        };
        let clear = |flags: &[bool], other: &[bool]| {
            (0..flags.len()).map(|row| flags[row] && !near(other, row)).collect::<Vec<_>>()
        };
        let known = moves.contains(&true) || stands.contains(&true);
        known.then(|| Self { moves: clear(&moves, &stands), stands: clear(&stands, &moves) })
    }

    /// The stops of at least three seconds.
    pub fn stops(&self) -> Vec<std::ops::Range<usize>> {
        let (mut stops, mut begin) = (Vec::new(), None);
        for (row, stands) in self.stands.iter().chain([&false]).enumerate() {
            match (begin, stands) {
                (None, true) => begin = Some(row),
                (Some(first), false) => {
                    stops.extend((row - first >= 300).then_some(first..row));
                    begin = None;
                }
                _ => {}
            }
        }
        stops
    }
}

/// Reads a recording, also one that begins in motion.
pub fn read(path: &Path) -> Recording {
    let vehicle = Vehicle::of_drive(path).expect("a vehicle file or none");
    let file = std::fs::File::open(path).expect("a recording");
    let name = path.display().to_string();
    let rows = Reader::new(&name, file).expect("a header").mounted(&vehicle);
    let rows = rows.collect::<Result<_, _>>().expect("rows");
    Recording { path: name, rows, missing: 0, vehicle }
}
