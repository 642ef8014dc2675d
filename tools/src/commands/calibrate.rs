//! `gyronet calibrate`: gain and mounting of a unit's gyro, from drives with a reference of their heading.

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

/// Find gain and mounting of a unit's gyro.
///
/// Each drive runs through the pipeline with the weights that the board runs. What the corrected yaw rate then lacks
/// of the reference (a yaw rate, ref_gyr_z, or a course, ref_yaw) is put down to the gyro's gain and to how the unit is mounted: shares of the yaw, roll and pitch
/// rate, each with its sigma. A share that the drives do not show (no turns, no tilt) is refused and left at zero. The
/// file is for `gyronet device calibrate unit` and for `gyronet evaluate --calibration`, and belongs to these weights.
#[derive(Debug, Clone, clap::Args)]
#[command(after_help = "\
Examples:
  gyronet calibrate drive1.csv drive2.csv --out unit.json
  gyronet evaluate drive3.csv --calibration unit.json")]
pub struct Args {
    /// Recorded drives of the unit, with ref_gyr_z or ref_yaw.
    #[arg(required = true, value_name = "DRIVE")]
    files: Vec<PathBuf>,
    /// Write the calibration to this file.
    #[arg(long, value_name = "FILE.json")]
    out: Option<PathBuf>,
    /// Weight file [default: the one that comes with the library].
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
            "{}: bias left {degrees_per_hour:+.1} deg/h, spans within {:.6} rad",
            drive.name, drive.deviation_rad
        )?;
    }
    Ok(())
}
