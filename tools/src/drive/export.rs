//! This module exports a replayed drive for other programs: a table of its rates, and its path in TUM format.

use super::DT;
use super::recording::Recording;
use super::replay::Replay;
use super::wheel_frames::Speeds;
use gyronet::odometry::Track;
use gyronet::units::AngularRate;
use std::io::{self, Write};

/// Writes a line for each sample after static initialisation: time, s; the yaw rate of the gyro, the prompt rate, the
/// navigation rate and its expected error, rad/s; the yaw of the navigation rate, rad; and the status of the prompt
/// rate. An empty field is unknown.
///
/// # Errors
/// The writer's.
pub fn csv(recording: &Recording, replay: &Replay, mut out: impl Write) -> io::Result<()> {
    writeln!(out, "t_s,gyro,prompt,navigation,sigma,yaw,status")?;
    for step in &replay.steps[replay.start..] {
        let [.., gyro] = recording.rows[step.row].sample.angular_rate;
        let known = |value: Option<f64>| value.map(|value| format!("{value:.7}")).unwrap_or_default();
        let sent = step.navigation;
        writeln!(
            out,
            "{:.4},{:.7},{:.7},{},{},{},{}",
            seconds(step.time.0),
            gyro.rad_per_sec(),
            step.vehicle.prompt.rate.rad_per_sec(),
            known(sent.map(|sent| sent.rate.rad_per_sec())),
            known(sent.and_then(|sent| sent.sigma).map(AngularRate::rad_per_sec)),
            known(sent.map(|sent| sent.yaw.rad())),
            format!("{:?}", step.vehicle.prompt.status).to_lowercase(),
        )?;
    }
    out.flush()
}

/// Writes the poses from dead reckoning with the navigation rate, from the end of static initialisation on: time of
/// the recording, s, x forward and y left of the first pose, m, and the heading as a quaternion.
///
/// # Errors
/// The writer's.
pub fn tum(replay: &Replay, speeds: &Speeds, mut out: impl Write) -> io::Result<()> {
    let mut track = Track::default();
    for (step, sent) in replay.steps[replay.compared()].iter().zip(replay.navigation()) {
        let way = speeds.metre_per_sec[step.row] * DT;
        track.step([way; 2], sent.rate.rad_per_sec() * DT);
        let ([x, y], (sin, cos)) = (track.position, (0.5 * track.yaw).sin_cos());
        writeln!(out, "{:.4} {x:.4} {y:.4} 0 0 0 {sin:.9} {cos:.9}", seconds(step.time.0))?;
    }
    out.flush()
}

fn seconds(micros: u64) -> f64 {
    micros as f64 * 1e-6
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bundled;
    use crate::drive::wheel_frames::WheelFrames;
    use crate::evaluate::ablation::Uncorrected;
    use gyronet::pipeline::PipelineConfig;
    use std::f64::consts::TAU;

    #[test]
    fn table_and_path_say_the_same() {
        let recording = bundled::simulated_drive().unwrap();
        let wheels = WheelFrames::new(&recording);
        let replay =
            Replay::run(&recording, &PipelineConfig::DEFAULT, wheels, &mut Uncorrected, || {}).unwrap();
        let (mut table, mut path) = (Vec::new(), Vec::new());
        csv(&recording, &replay, &mut table).unwrap();
        tum(&replay, &Speeds::new(&recording).unwrap(), &mut path).unwrap();
        let table = String::from_utf8(table).unwrap();
        let rows: Vec<Vec<&str>> = table.lines().skip(1).map(|line| line.split(',').collect()).collect();
        assert_eq!(rows.len(), replay.steps.len() - replay.start);
        assert!(rows.iter().any(|row| row[6] == "ready"));
        let unknown = rows.iter().filter(|row| row[3].is_empty()).count();
        assert_eq!(unknown, 7, "the last navigation rates are never sent");

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
