//! The hour in Kingston: a ring-laser unit's rows at 10 Hz, and the positions of a survey-grade system once a second.

use gyronet::fog::FogErrors;
use std::path::Path;

/// 1 deg/h in rad/s.
const DEG_PER_HOUR: f32 = std::f32::consts::PI / 180.0 / 3600.0;
/// Honeywell HG1700 by its brochure: a bias of 1 deg/h, 1 sigma, and 0.125 deg per square root of an hour. It says nothing
/// of a walk of the bias, and 150 ppm.
pub const HG1700: FogErrors =
    FogErrors { angle_walk: 0.125 * 60.0 * DEG_PER_HOUR, bias: DEG_PER_HOUR, bias_walk: 0.0, scale: 150e-6 };

/// Reads a table of numbers; its first line names the columns, of which the first is the time.
pub fn table(path: &Path) -> Vec<Vec<f64>> {
    let text = std::fs::read_to_string(path).expect("a file");
    let row = |line: &str| line.split(',').map(|field| field.parse().expect("a number")).collect();
    text.lines().skip(1).map(row).collect()
}

/// Returns the value of a column at a time, between the rows around it.
pub fn at(table: &[Vec<f64>], column: usize, time: f64) -> f64 {
    let after = table.partition_point(|row| row[0] < time).clamp(1, table.len() - 1);
    let [before, after] = [&table[after - 1], &table[after]];
    let share = ((time - before[0]) / (after[0] - before[0])).clamp(0.0, 1.0);
    before[column] + share * (after[column] - before[column])
}
