//! `gyronet calibrate` fits gain and mounting of a unit's gyro to drives with a reference yaw rate or course.

use super::weights::Sent;
use super::{Common, named, print_json, progress, remarked};
use gyronet::model::{Blob, GyroNet};
use gyronet_tools::board::Board;
use gyronet_tools::calibrate::{Cut, Share, calibrate, config};
use gyronet_tools::drive::stream::Drive;
use std::error::Error;
use std::io::{Write, stdout};
use std::path::PathBuf;

/// Find the gain and mounting errors of a unit's gyro from recorded drives.
///
/// The command runs each drive through the pipeline, with the weights that the board runs. It compares the corrected
/// yaw rate with the reference. It fits the remaining error to shares of the yaw rate (gain) and of the roll and pitch
/// rates (mounting), and prints each share with its sigma. A share that the drives do not show (no turns, no tilt) is
/// refused and left at zero. Without a reference yaw rate (ref_gyr_z) the board itself learns the gain from the courses
/// of the drive (course and gnss_speed, or positions), or else from the reference's (ref_yaw).
///
/// With --out it writes a calibration file for `gyronet device calibrate unit` and `gyronet evaluate --calibration`.
/// The file is valid only with the same weights.
#[derive(Debug, Clone, clap::Args)]
#[command(after_help = "\
Examples:
  gyronet calibrate drive1.csv drive2.csv --out unit.json
  gyronet evaluate drive3.csv --calibration unit.json")]
pub struct Args {
    /// Drives recorded with the unit, with ref_gyr_z, ref_yaw or a course.
    #[arg(required = true, value_name = "DRIVE")]
    files: Vec<PathBuf>,
    /// Write the calibration to this file.
    #[arg(long, value_name = "FILE.json")]
    out: Option<PathBuf>,
    #[command(flatten)]
    sent: Sent,
}

pub fn run(args: &Args, common: Common) -> super::Result {
    let weights = args.sent.open()?;
    let blob = weights.blob()?;
    let open = |file: &PathBuf| remarked(Drive::open_with_courses(file)?, common);
    let drives = args.files.iter().map(|file| cut(&open(file)?, blob, common));
    let drives = drives.collect::<Result<Vec<Cut>, Box<dyn Error>>>()?;
    let unit = calibrate(&drives, blob.crc)?;
    let found = unit.shares.iter().any(|share| share.refused.is_none());
    if let Some(path) = args.out.as_ref().filter(|_| found) {
        let text = serde_json::to_string_pretty(&unit.json())? + "\n";
        std::fs::write(path, text).map_err(named(path))?;
    }
    let mut out = stdout().lock();
    if common.json {
        return print_json(&mut out, &unit.json());
    }
    for Share { name, value, sigma, limit, refused, remark } in &unit.shares {
        match refused {
            None => {
                let remark = remark.map(|remark| format!(": {remark}")).unwrap_or_default();
                writeln!(out, "{name:<6} {value:+.5}, sigma {sigma:.5}{remark}")?;
            }
            Some(reason) if sigma.is_infinite() => writeln!(out, "{name:<6} refused: {reason}")?,
            Some(reason) => writeln!(out, "{name:<6} refused, sigma {sigma:.5} (at most {limit}): {reason}")?,
        }
    }
    for drive in &unit.drives {
        let degrees_per_hour = drive.yaw_rate_bias_rad_per_s.to_degrees() * 3_600.0;
        write!(out, "{}: remaining bias {degrees_per_hour:+.1} deg/h", drive.name)?;
        match drive.deviation_rad {
            Some(deviation) => writeln!(out, ", its turns scatter by {deviation:.6} rad")?,
            None => writeln!(out, ", by its course")?,
        }
    }
    match &args.out {
        Some(path) if !found => {
            Err(format!("{}: not written: nothing could be calibrated", path.display()).into())
        }
        _ => Ok(()),
    }
}

/// Runs a drive on the board with these weights, with a progress bar.
pub fn cut(drive: &Drive<'_>, blob: Blob<'_>, common: Common) -> Result<Cut, Box<dyn Error>> {
    let bar = progress::bar(common, drive.facts.rows, drive.name());
    let board = Board::new(config(), drive.wheels(), GyroNet::new(blob));
    let cut = Cut::new(drive, board, || bar.inc(1));
    bar.finish_and_clear();
    Ok(cut?)
}
