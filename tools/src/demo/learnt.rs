//! What the board knows of its sensor over a drive: bias, gain and tilt of the mounting, each with its sigma.

use crate::board::Board;
use crate::drive::error::DataError;
use crate::drive::stream::Drive;
use crate::plot::page::chart::{Chart, Curve};
use gyronet::coprocessor::Config;
use gyronet::model::WindowNetwork;
use gyronet::pipeline::Pipeline;
use gyronet::sample::RATE_HZ;

const CHARTS: [(&str, &str); 4] = [
    ("Bias about z", "deg/s, over time in s"),
    ("Gain", "% read too much, by courses"),
    ("Roll of the mounting", "deg, beyond the configured one"),
    ("Pitch of the mounting", "deg, beyond the configured one"),
];

/// One row a second: the time since the start of the drive, s, and value and sigma for each chart, where they are known.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Learnt(Vec<(f64, [Option<[f64; 2]>; CHARTS.len()])>);

impl Learnt {
    /// Runs the board over the drive, with its wheels and courses.
    pub fn new(drive: &Drive<'_>, network: impl WindowNetwork) -> Result<Self, DataError> {
        let mut board = Board::new(Config::DEFAULT, drive.wheels(), network).moving(true);
        let mut rows = Vec::new();
        for (at, row) in drive.rows()?.enumerate() {
            let row = row?;
            // A start that is refused in motion is no error here.
            let _ = board.row(&row);
            if at % RATE_HZ as usize == 0 {
                let time = (row.sample.time.0 - drive.facts.first.0) as f64 * 1e-6;
                rows.push((time, known(board.coprocessor().pipeline())));
            }
        }
        Ok(Self(rows))
    }

    /// Returns a chart of each quantity that was known at some time, as HTML, over a range of time, s, in which the drive
    /// begins at `start`.
    pub fn charts(&self, range: (f64, f64), start: f64) -> String {
        let charts = CHARTS.into_iter().enumerate().map(|(k, (title, axes))| {
            let known = || self.0.iter().filter_map(|(time, known)| Some((start + time, known[k]?)));
            let curve = |class, label: &str, sigmas: f64| Curve {
                class,
                label: label.into(),
                note: String::new(),
                points: known().map(|(time, [value, sigma])| (time, value + sigmas * sigma)).collect(),
                // The bias is unknown to 0.3 deg/s until a start is confirmed.
                in_scale: k > 0 || sigmas == 0.0,
            };
            let curves = vec![
                curve("more", "+1 sigma", 1.0),
                curve("less", "-1 sigma", -1.0),
                curve("default", title, 0.0),
            ];
            let chart = Chart { title, axes, time: Some(range), curves };
            known().next().map_or_else(String::new, |_| chart.html())
        });
        charts.collect()
    }
}

fn known(pipeline: &Pipeline) -> [Option<[f64; 2]>; CHARTS.len()] {
    let bias = pipeline.gyro_bias().map(|[.., z]| {
        let [residual, sigma] = pipeline.bias_when_driving().map(f64::from);
        [z.rad_per_sec() + residual, sigma].map(f64::to_degrees)
    });
    let (gain, sigma) = pipeline.gain();
    let gain = sigma.map(|sigma| [gain, sigma].map(|share| 100.0 * f64::from(share)));
    let tilt = pipeline.vertical().map(|vertical| vertical.tilt_deg().map(f64::from));
    let [roll, pitch] = [0, 1].map(|axis| tilt.map(|tilt| [tilt[axis], tilt[2]]));
    [bias, gain, roll, pitch]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::board::Uncorrected;
    use crate::bundled;

    #[test]
    fn ten_minutes_with_courses_show_bias_gain_and_tilt() {
        let bundled = bundled::demo_drive(true).unwrap();
        let Learnt(rows) = Learnt::new(&Drive::from(&bundled), Uncorrected).unwrap();
        assert_eq!((rows.len(), rows[0].1), (600, [None; CHARTS.len()]));
        let sigmas = rows[599].1.map(|known| known.unwrap()[1]);
        for (sigma, most) in sigmas.into_iter().zip([0.01, 0.3, 1.2, 1.2]) {
            assert!(sigma > 0.0 && sigma < most, "{sigmas:?}");
        }
    }
}
