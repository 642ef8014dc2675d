//! Remedies of findings: edits of the vehicle file, or flags of the import.

use super::Mounting;
use super::recording::Rows;
use crate::drive::vehicle::{self, Vehicle};
use crate::drive::word;
use std::path::Path;

/// The vehicle file whose edit works, with the mounting that turns x forward and z up; `left_deg` is the direction of
/// forward from x after levelling.
pub fn mounting(rows: &Rows, level: &Mounting, left_deg: f64) -> String {
    let Vehicle { mounting, recording, path, .. } = &rows.vehicle;
    let level = vehicle::Mounting::of([level.roll_deg, level.pitch_deg, 0.0]);
    let vehicle::Mounting { roll_deg, pitch_deg, yaw_deg, .. } =
        mounting.then(&level).then(&vehicle::Mounting::of([0.0, 0.0, -left_deg]));
    let default = Path::new(&rows.name).with_extension("toml");
    let file = path.as_deref().unwrap_or(&default).file_name().unwrap_or_default().display();
    let applied = if mounting.applied { ", applied = false" } else { "" };
    let mut text = format!(
        "in {file}, under [mounting], set roll_deg = {roll_deg:.1}, pitch_deg = {pitch_deg:.1}, yaw_deg = {yaw_deg:.1}{applied}"
    );
    let vehicle::Mounting { roll_deg, pitch_deg, yaw_deg, .. } =
        recording.mounting.then(&vehicle::Mounting::of([roll_deg, pitch_deg, yaw_deg]));
    if recording.mounting != vehicle::Mounting::default() {
        text += &format!(" (on the board {roll_deg:.1}, {pitch_deg:.1}, {yaw_deg:.1})");
    }
    text
}

/// The channel of a role, as the import names it in this drive or in its log.
pub fn channel<'r>(rows: &'r Rows, role: &str, column: &'r str) -> &'r str {
    rows.vehicle.signals.get(role).map_or(column, String::as_str)
}

pub fn imu(rows: &Rows, its: &str) -> String {
    unit(rows, channel(rows, "imu", "imu"), its)
}

pub fn unit(rows: &Rows, channel: &str, unit: &str) -> String {
    format!("{channel} is in {unit}; {}", import(rows, &format!("--unit {channel}={unit}")))
}

pub fn import(rows: &Rows, flags: &str) -> String {
    if rows.vehicle.recording.units.is_empty() {
        command(rows, flags, "fixed")
    } else {
        format!("import the log again with `{flags}`")
    }
}

/// The import of the drive itself, into a file beside it.
pub fn command(rows: &Rows, flags: &str, end: &str) -> String {
    let file = Path::new(&rows.file);
    let out = format!("{}_{end}.csv", file.with_extension("").display());
    let import = format!("cargo gyronet import {} {flags}", word(file));
    format!("`{} --out {}`", import.trim_end(), word(Path::new(&out)))
}
