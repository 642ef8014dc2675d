//! `gyronet calibrate` fits gain and mounting of a unit's gyro to drives with a reference yaw rate or course.

use super::weights::Weights;
use super::{Common, WriteError, print_json, progress, read_drive};
use gyronet::model::GyroNet;
use gyronet::pipeline::PipelineConfig;
use gyronet_tools::calibrate::{Drive, Share, calibrate};
use gyronet_tools::drive::recording::Recording;
use gyronet_tools::drive::replay::Replay;
use gyronet_tools::drive::wheel_frames::WheelFrames;
use std::io::{Write, stdout};
use std::path::PathBuf;

/// Find the gain and mounting errors of a unit's gyro from recorded drives.
///
/// The command runs each drive through the pipeline, with the weights that the board runs. It compares the corrected
/// yaw rate with the reference (a yaw rate, ref_gyr_z, or a course, ref_yaw). It fits the remaining error to shares
/// of the yaw rate (gain) and of the roll and pitch rates (mounting), and prints each share with its sigma. A share
/// that the drives do not show (no turns, no tilt) is refused and left at zero.
///
/// With --out it writes a calibration file for `gyronet device calibrate unit` and `gyronet evaluate --calibration`.
/// The file is valid only with the same weights.
#[derive(Debug, Clone, clap::Args)]
#[command(after_help = "\
Examples:
  gyronet calibrate drive1.csv drive2.csv --out unit.json
  gyronet evaluate drive3.csv --calibration unit.json")]
pub struct Args {
    /// Drives recorded with the unit, with ref_gyr_z or ref_yaw.
    #[arg(required = true, value_name = "DRIVE")]
    files: Vec<PathBuf>,
    /// Write the calibration to this file.
    #[arg(long, value_name = "FILE.json")]
    out: Option<PathBuf>,
    /// Weight file [default: the library's default model].
    #[arg(long, value_name = "BLOB")]
    weights: Option<PathBuf>,
}

/// Runs the subcommand.
pub fn run(args: &Args, common: Common) -> super::Result {
    let weights = Weights::open(args.weights.as_deref())?;
    let blob = weights.blob()?;
    let recordings: Vec<Recording> =
        args.files.iter().map(|file| read_drive(file, common)).collect::<Result<_, _>>()?;
    let mut drives = Vec::new();
    for recording in &recordings {
        let bar = progress::bar(common, recording.rows.len(), recording.name());
        let replay = Replay::run(
            recording,
            &PipelineConfig::DEFAULT,
            WheelFrames::new(recording),
            &mut GyroNet::new(blob),
            || bar.inc(1),
        );
        bar.finish_and_clear();
        drives.push(Drive { recording, replay: replay? });
    }
    let unit = calibrate(&drives, blob.crc)?;
    if let Some(path) = &args.out {
        let text = serde_json::to_string_pretty(&unit.json())? + "\n";
        std::fs::write(path, text).map_err(WriteError::to(path))?;
    }
    let mut out = stdout().lock();
    if common.json {
        return print_json(&mut out, &unit.json());
    }
    for Share { name, value, sigma, refused } in &unit.shares {
        match refused {
            None => writeln!(out, "{name:<6} {value:+.5}, sigma {sigma:.5}")?,
            Some(reason) => writeln!(out, "{name:<6} refused, sigma {sigma:.5}: {reason}")?,
        }
    }
    for drive in &unit.drives {
        let degrees_per_hour = drive.yaw_rate_bias_rad_per_s.to_degrees() * 3_600.0;
        writeln!(
            out,
            "{}: remaining bias {degrees_per_hour:+.1} deg/h, spans within {:.6} rad",
            drive.name, drive.deviation_rad
        )?;
    }
    Ok(())
}
