//! `gyronet simulate` writes simulated drives.

use super::{Common, named, print_json, remark};
use gyronet_tools::simulate::warming::{self, Trip};
use gyronet_tools::simulate::{Config, csv, gnss};
use std::fs::File;
use std::io::BufWriter;
use std::path::PathBuf;

/// Write a simulated drive whose sensor errors are known.
///
/// A car stands, pulls away, follows bends, turns and stops; a MEMS sensor with known errors measures its motion.
///
/// The CSV file has the columns that the other commands read, and the truth in ref_gyr_*: roll and pitch rates of the car,
/// and in ref_gyr_z the rate of its heading, about the vertical. The same seed gives the same file on every machine.
///
/// With --trip the sensor warms up, its bias follows its temperature (temp_c), and each device has a bias of its own.
/// Half an hour on a motorway without a stop shows how far the heading drifts meanwhile.
#[derive(Debug, Clone, clap::Args)]
#[command(after_help = "\
Examples:
  gyronet simulate --out drive.csv
  gyronet simulate --seconds 600 --seed 7 --out drive.csv
  gyronet simulate --seconds 1200 --tilt 7,0 --out tilted.csv
  gyronet simulate --seconds 1800 --gnss 0.5 --out gnss.csv
  gyronet simulate --trip motorway --device 3 --seconds 2160 --out motorway.csv")]
pub struct Args {
    /// Write the drive to this file.
    #[arg(long, value_name = "FILE.csv")]
    out: PathBuf,
    /// Length of the drive, s (10 to 36000).
    #[arg(long, default_value_t = 90, value_parser = clap::value_parser!(u32).range(10..=36_000))]
    seconds: u32,
    /// Seed of the route, the road, the noise and the bias at power-on.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Tilt the sensor: roll and pitch of its mounting, deg.
    #[arg(long, value_name = "ROLL,PITCH", value_delimiter = ',', num_args = 1, allow_hyphen_values = true)]
    tilt: Vec<f64>,
    /// Let the sensor warm up on this trip.
    #[arg(long)]
    trip: Option<Trip>,
    /// Seed of the errors that all trips of a sensor share.
    #[arg(long, default_value_t = 1, requires = "trip")]
    device: u64,
    /// Add the courses of a GNSS receiver with this latency, s (0 to 2).
    #[arg(long, value_name = "LATENCY", value_parser = latency)]
    gnss: Option<f64>,
    /// Let somebody turn the course slowly from this time on, s.
    #[arg(long, value_name = "SECONDS", requires = "gnss")]
    spoofed_from: Option<f64>,
}

fn latency(text: &str) -> Result<f64, String> {
    let latency = text.parse().ok().filter(|latency| (0.0..=2.0).contains(latency));
    latency.ok_or_else(|| "not 0 to 2 s".to_owned())
}

pub fn run(args: &Args, common: Common) -> super::Result {
    let warming = args.trip.map(|trip| warming::Config { trip, device: args.device });
    let gnss = args.gnss.map(|latency_s| gnss::Config { latency_s, spoofed_from_s: args.spoofed_from });
    let mut config = Config { warming, gnss, seconds: args.seconds, seed: args.seed, ..Config::DEFAULT };
    config.mems.mount = match *args.tilt {
        [] => [0.0; 2],
        [roll, pitch] => [pitch, roll].map(f64::to_radians),
        _ => return Err("--tilt takes two angles, ROLL,PITCH".into()),
    };
    let error = named(&args.out);
    let file = File::create(&args.out).map_err(&error)?;
    let samples = csv::write(&config, BufWriter::new(file)).map_err(&error)?;
    let (path, seed) = (args.out.display(), args.seed);
    if common.json {
        let written = serde_json::json!({ "path": args.out, "samples": samples, "seed": seed });
        return print_json(&mut std::io::stdout().lock(), &written);
    }
    Ok(remark(common, format_args!("{path}: {samples} samples, seed {seed}"))?)
}
