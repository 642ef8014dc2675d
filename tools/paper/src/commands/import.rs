//! `gyronet-paper import` converts a sequence to one drive.

use super::{named, print_json, remark};
use gyronet_paper::fog_replay;
use gyronet_paper::sequence::{self, Sequence};
use gyronet_paper::simulate::vehicles::CAR;
use gyronet_tools::drive::vehicle::Vehicle;
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::PathBuf;

/// Summarise a sequence, and convert it to one drive.
///
/// KAIST has sensor_data/{xsens_imu,fog,encoder}.csv, calibration/EncoderParameter.txt and global_pose.csv.
/// Missing files, wrong columns, fields that are not numbers, and
/// time that goes backwards are errors. Rows with NaN, repeated stamps, gaps and encoder resets are counted and
/// reported.
#[derive(Debug, Clone, clap::Args)]
#[command(after_help = "\
Examples:
  gyronet-paper import urban14 --out urban14.csv")]
pub struct Args {
    /// Folder of the sequence.
    #[arg(value_name = "DIR")]
    folder: PathBuf,
    /// Write the drive to this file, at 100 Hz; the commands of gyronet read it.
    #[arg(long, value_name = "FILE.csv")]
    out: Option<PathBuf>,
    /// Write a training drive: without the steps in a gap of any file, and with the Earth's rate and the bias
    /// subtracted from the fibre-optic gyro, as FoGNet receives it. A sequence that starts moving is an error.
    #[arg(long, requires = "out")]
    training: bool,
}

pub fn run(args: &Args, json: bool) -> super::Result {
    let sequence = Sequence::read(&args.folder)?;
    if json {
        let [imu, fog, wheels, truth] = &sequence.files;
        print_json(&serde_json::json!({
            "name": sequence.name,
            "simulated": sequence.simulated,
            "seconds": sequence.seconds(),
            "files": { "imu": imu, "fog": fog, "wheels": wheels, "truth": truth },
            "steps_in_gap": sequence.in_gap,
        }))?;
    } else {
        summary(&sequence)?;
    }
    write(args, &sequence)
}

fn summary(sequence: &Sequence) -> std::io::Result<()> {
    let mut out = std::io::stdout().lock();
    let simulated = if sequence.simulated.is_some() { " (simulated)" } else { "" };
    writeln!(out, "{}{simulated}: {:.2} s on the 100 Hz grid", sequence.name, sequence.seconds())?;
    for (file, in_gap) in sequence.files.iter().zip(sequence.in_gap) {
        write!(out, "  {file}")?;
        if in_gap > 0 {
            write!(out, ", {in_gap} steps in gaps over {:.0} ms", 1e3 * sequence::MAX_GAP)?;
        }
        writeln!(out)?;
    }
    Ok(())
}

fn write(args: &Args, sequence: &Sequence) -> super::Result {
    if let Some(path) = &args.out {
        if args.training {
            sequence.needs_standstill()?;
        }
        let out = BufWriter::new(File::create(path).map_err(named(path))?);
        let rows = if args.training {
            sequence::write_whole(&fog_replay::after_base(sequence), out)
        } else {
            sequence::write_csv(sequence, out)
        };
        let rows = rows.map_err(named(path))?;
        let beside = Vehicle::beside(path);
        super::write(&beside, format!("[wheels]\nradius_m = {:?}\n", CAR.wheel_radius))?;
        remark(format_args!("{}: {rows} rows; {} beside it", path.display(), beside.display()))?;
    }
    Ok(())
}
