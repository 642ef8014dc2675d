//! `gyronet import` converts logs of other tools to one drive.

use super::{Common, WriteError, print_json};
use gyronet_tools::drive::stream::Drive;
use gyronet_tools::drive::vehicle::Vehicle;
use gyronet_tools::import::drive::{Logs, Request, Seen};
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

/// Convert logs of other tools to one drive.
///
/// The input is one or more logs: ROS 1 bags, MCAP (ROS 1 and 2), PX4 ULog, candump, Vector ASC and BLF, PEAK TRC,
/// Xsens MT text and CSV. The command prints what it found and the number of unusable records. With --out it writes
/// the drive, a CSV file at 100 Hz that the other commands read.
///
/// The channels of the gyro, the odometry and the GNSS position are found by their type; if several fit, name one. A
/// vehicle file holds what a log does not contain: mounting, wheels, columns, the DBC file. It is `drive.toml` beside
/// the first log `drive.bag`, or `vehicle.toml`, unless --vehicle names another. A copy is written beside the drive,
/// with the drive's name and .toml; every command that reads the drive uses it. The clocks of several files are
/// aligned by the yaw rates that the files have in common.
#[derive(Debug, Clone, clap::Args)]
#[command(after_help = "\
Examples:
  gyronet import drive.bag --out drive.csv
  gyronet import drive.mcap bus.blf --dbc car.dbc --vehicle car.toml --out drive.csv")]
pub struct Args {
    /// Logs of one drive.
    #[arg(value_name = "FILE", required = true)]
    files: Vec<PathBuf>,
    /// Write the drive to this file, at 100 Hz.
    #[arg(long, value_name = "FILE.csv")]
    out: Option<PathBuf>,
    /// Vehicle file [default: the first log's name with .toml, or vehicle.toml, beside that log].
    #[arg(long, value_name = "FILE.toml")]
    vehicle: Option<PathBuf>,
    /// DBC file with the messages and signals of the CAN frames.
    #[arg(long, value_name = "FILE.dbc")]
    dbc: Option<PathBuf>,
    /// Channel of the gyro and the accelerometer.
    #[arg(long, value_name = "CHANNEL")]
    imu: Option<String>,
    /// Channel whose speed replaces the wheels; `none` for no odometry.
    #[arg(long, value_name = "CHANNEL")]
    odometry: Option<String>,
    /// Channel of the GNSS position; `none` for no position.
    #[arg(long, value_name = "CHANNEL")]
    position: Option<String>,
    /// Use the time stamps as they are: the files have one clock.
    #[arg(long)]
    same_clock: bool,
    /// Skip this many seconds at the start.
    #[arg(long, value_name = "SECONDS", default_value_t = 0.0)]
    from: f64,
}

/// Runs the subcommand.
pub fn run(args: &Args, common: Common) -> super::Result {
    if let [layout, folder] = &args.files[..]
        && ["kaist", "nclt"].iter().any(|name| layout.as_os_str() == *name)
    {
        let folder = folder.display();
        return Err(format!("a sequence of a data set is imported by `cargo paper import {folder}`").into());
    }
    if !(0.0..1e6).contains(&args.from) {
        return Err("--from must be a number of seconds after the first sample, 0 or more".into());
    }
    let vehicle = vehicle(args)?;
    let request = Request {
        files: args.files.clone(),
        vehicle: vehicle.clone(),
        same_clock: args.same_clock,
        from: args.from,
    };
    let logs = Logs::read(&request)?;
    let drive = logs.drive(&request)?;
    let (Seen { rows, seconds, .. }, dropped, mut report) = (drive.seen, logs.dropped, drive.report.clone());
    if let Some(path) = &args.out {
        let error = WriteError::to(path);
        drive.write_csv(BufWriter::new(File::create(path).map_err(&error)?)).map_err(&error)?;
        let beside = write_vehicle(vehicle, path)?;
        report.push(format!("{}: {rows} rows; {} beside it", path.display(), beside.display()));
        // Check the drive as other commands read it, to report its faults now.
        if let Err(error) = Drive::open(path) {
            report.push(format!("other commands will refuse it: {error}"));
        }
    }
    let mut out = std::io::stdout().lock();
    if common.json {
        let json = serde_json::json!({
            "seconds": seconds, "rows": rows, "dropped": dropped, "report": report,
        });
        return print_json(&mut out, &json);
    }
    writeln!(out, "{seconds:.2} s, {rows} rows, {dropped} records dropped")?;
    for line in report {
        writeln!(out, "  {line}")?;
    }
    Ok(())
}

/// Writes the vehicle file of a drive whose rows are in the vehicle's axes, and returns the file's path.
fn write_vehicle(mut vehicle: Vehicle, drive: &Path) -> Result<PathBuf, Box<dyn std::error::Error>> {
    vehicle.mounting.applied = true;
    let beside = Vehicle::beside(drive);
    std::fs::write(&beside, toml::to_string(&vehicle)?).map_err(WriteError::to(&beside))?;
    Ok(beside)
}

/// Returns the vehicle file's content, in which arguments replace what the file gives.
fn vehicle(args: &Args) -> Result<Vehicle, Box<dyn std::error::Error>> {
    let first = args.files.first();
    let own = first.map(|file| Vehicle::beside(file)).filter(|path| args.vehicle.is_none() && path.is_file());
    let shared = first.map(|file| file.with_file_name("vehicle.toml")).filter(|path| path.is_file());
    let mut vehicle = match own.as_ref().or(args.vehicle.as_ref()).or(shared.as_ref()) {
        Some(path) => Vehicle::read(path)?,
        None => Vehicle::default(),
    };
    // Only a drive's own file says that its rows are rotated already. Its channel names are those of the original
    // logs.
    vehicle.mounting.applied &= own.is_some();
    if vehicle.mounting.applied {
        vehicle = vehicle.without_names();
    }
    let written = args.out.as_deref().map(|out| std::path::absolute(Vehicle::beside(out))).transpose()?;
    if let Some(read) = &vehicle.path
        && Some(std::path::absolute(read)?) == written
    {
        return Err(
            format!("{}: --out would overwrite it; give the drive another name", read.display()).into()
        );
    }
    let dbc = args.dbc.as_ref().or(vehicle.bus.dbc.as_ref());
    // The copy beside the drive may be in another folder than the DBC file.
    vehicle.bus.dbc = dbc.map(std::path::absolute).transpose()?;
    for (name, argument) in [
        (&mut vehicle.signals.imu, &args.imu),
        (&mut vehicle.signals.odometry, &args.odometry),
        (&mut vehicle.signals.position, &args.position),
    ] {
        *name = argument.clone().or(name.take());
    }
    Ok(vehicle)
}
