//! The table of a replayed drive's rates for other programs.

use crate::board::Step;
use gyronet::units::AngularRate;
use std::io::{self, Write};

/// A table with a line for each step after static initialisation: time, s; the yaw rate of the gyro, the prompt rate,
/// the navigation rate and its expected error, rad/s; the yaw of the navigation rate, rad; and the status of the prompt
/// rate. An empty field is unknown.
#[derive(Debug)]
pub struct Table<W> {
    out: W,
}

impl<W: Write> Table<W> {
    /// Writes the header.
    pub fn new(mut out: W) -> io::Result<Self> {
        writeln!(out, "t_s,gyro,prompt,navigation,sigma,yaw,status")?;
        Ok(Self { out })
    }

    pub fn step(&mut self, step: &Step) -> io::Result<()> {
        if !step.is_initialised {
            return Ok(());
        }
        let [.., gyro] = step.input.sample.angular_rate;
        let known = |value: Option<f64>| value.map(|value| format!("{value:.7}")).unwrap_or_default();
        let sent = step.navigation;
        writeln!(
            self.out,
            "{:.4},{:.7},{:.7},{},{},{},{}",
            seconds(step.time.0),
            gyro.rad_per_sec(),
            step.vehicle.prompt.rate.rad_per_sec(),
            known(sent.map(|sent| sent.rate.rad_per_sec())),
            known(sent.and_then(|sent| sent.sigma).map(AngularRate::rad_per_sec)),
            known(sent.map(|sent| sent.yaw.rad())),
            format!("{:?}", step.vehicle.prompt.status).to_lowercase(),
        )
    }

    /// Flushes the writer.
    pub fn finish(&mut self) -> io::Result<()> {
        self.out.flush()
    }
}

fn seconds(micros: u64) -> f64 {
    micros as f64 * 1e-6
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::board::Board;
    use crate::bundled;
    use crate::drive::replay::Steps;
    use crate::drive::stream::Drive;
    use crate::evaluate::ablation::Uncorrected;
    use gyronet::coprocessor::Config;

    #[test]
    fn a_table_has_a_row_for_each_sample() {
        let recording = bundled::simulated_drive().unwrap();
        let drive = Drive::from(&recording);
        let board = Board::new(Config::DEFAULT, drive.wheels(), Uncorrected);
        let mut table = Table::new(Vec::new()).unwrap();
        for step in Steps::new(&drive, board).unwrap() {
            table.step(&step.unwrap()).unwrap();
        }
        let table = String::from_utf8(table.out).unwrap();
        let rows: Vec<Vec<&str>> = table.lines().skip(1).map(|line| line.split(',').collect()).collect();
        assert_eq!(rows.len(), recording.rows.len() - 300);
        assert!(rows.iter().any(|row| row[6] == "ready"));
        let unknown = rows.iter().filter(|row| row[3].is_empty()).count();
        assert_eq!(unknown, 7, "the last navigation rates are never sent");
    }
}
