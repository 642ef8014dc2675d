//! Tables and paths of a replayed drive for other programs: its rates, and its path in TUM format.

use super::DT;
use super::wheel_frames::Speeds;
use crate::board::Step;
use crate::drive::track::Track;
use gyronet::units::AngularRate;
use std::io::{self, Write};

/// The columns of a table with a line for each step after static initialisation: time, s; the yaw rate of the gyro, the
/// live rate, the delayed rate and its expected error, rad/s; the yaw of the delayed rate, rad; and the status of the
/// live rate. An empty field is unknown.
pub const HEADER: &str = "t_s,gyro,live,delayed,sigma,yaw,status";

pub fn line(step: &Step, out: &mut impl Write) -> io::Result<()> {
    if !step.is_initialised {
        return Ok(());
    }
    let [.., gyro] = step.input.sample.angular_rate;
    let known = |value: Option<f64>| value.map(|value| format!("{value:.7}")).unwrap_or_default();
    let sent = step.delayed;
    writeln!(
        out,
        "{:.4},{:.7},{:.7},{},{},{},{}",
        seconds(step.time.0),
        gyro.rad_per_sec(),
        step.vehicle.live.rate.rad_per_sec(),
        known(sent.map(|sent| sent.rate.rad_per_sec())),
        known(sent.and_then(|sent| sent.sigma).map(AngularRate::rad_per_sec)),
        known(sent.map(|sent| sent.yaw.rad())),
        format!("{:?}", step.vehicle.live.status).to_lowercase(),
    )
}

/// The poses from dead reckoning with the delayed rate, from the end of static initialisation on: time of the
/// recording, s, x forward and y left of the first pose, m, and the heading as a quaternion.
#[derive(Debug)]
pub struct Tum {
    speeds: Speeds,
    track: Track,
}

impl Tum {
    pub fn new(speeds: Speeds) -> Self {
        Self { speeds, track: Track::default() }
    }

    pub fn pose(&mut self, step: &Step, out: &mut impl Write) -> io::Result<()> {
        let way = self.speeds.next(&step.input) * DT;
        let Some(sent) = step.delayed.filter(|_| step.is_compared) else { return Ok(()) };
        self.track.step([way; 2], sent.rate.rad_per_sec() * DT);
        let ([x, y], (sin, cos)) = (self.track.position, (0.5 * self.track.yaw).sin_cos());
        writeln!(out, "{:.4} {x:.4} {y:.4} 0 0 0 {sin:.9} {cos:.9}", seconds(step.time.0))
    }
}

fn seconds(micros: u64) -> f64 {
    micros as f64 * 1e-6
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::board::Board;
    use crate::board::Uncorrected;
    use crate::bundled;
    use crate::drive::replay::Steps;
    use crate::drive::stream::Drive;
    use gyronet::coprocessor::Config;
    use std::f64::consts::TAU;

    #[test]
    fn table_and_path_say_the_same() {
        let recording = bundled::simulated_drive().unwrap();
        let drive = Drive::from(&recording);
        let board = Board::new(Config::DEFAULT, drive.wheels(), Uncorrected);
        let (mut table, mut path) = (Vec::new(), Vec::new());
        let mut tum = Tum::new(drive.speeds().unwrap());
        for step in Steps::new(&drive, board).unwrap() {
            let step = step.unwrap();
            line(&step, &mut table).unwrap();
            tum.pose(&step, &mut path).unwrap();
        }
        let table = String::from_utf8(table).unwrap();
        let rows: Vec<Vec<&str>> = table.lines().map(|line| line.split(',').collect()).collect();
        assert_eq!(rows.len(), recording.rows.len() - 300);
        assert!(rows.iter().any(|row| row[6] == "ready"));
        let unknown = rows.iter().filter(|row| row[3].is_empty()).count();
        assert_eq!(unknown, 7, "the last delayed rates are never sent");

        let number = |field: &str| field.parse::<f64>().unwrap();
        let path = String::from_utf8(path).unwrap();
        let poses: Vec<Vec<f64>> = path.lines().map(|line| line.split(' ').map(number).collect()).collect();
        assert_eq!(poses.len(), rows.len() - unknown);
        let (pose, row) = (poses.last().unwrap(), &rows[poses.len() - 1]);
        assert!((pose[0] - number(row[0])).abs() < 1e-9);
        // Both yaws start at the same sample.
        let off = 2.0 * pose[6].atan2(pose[7]) - number(row[5]);
        assert!((off - TAU * (off / TAU).round()).abs() < 1e-3, "{off} {row:?}");
        let reach = poses.iter().map(|pose| pose[1].hypot(pose[2])).fold(0.0, f64::max);
        assert!((200.0..564.0).contains(&reach), "{reach}");
    }
}
