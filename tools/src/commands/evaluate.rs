//! `gyronet evaluate` computes the heading errors of each method on recorded drives.

use super::{Common, drives, named, paint, print_json, progress, weights};
use gyronet::model::GyroNet;
use gyronet::pipeline::PipelineConfig;
use gyronet_tools::bundled;
use gyronet_tools::drive::recording;
use gyronet_tools::drive::stream::Drive;
use gyronet_tools::evaluate::outage::{self, Outage};
use gyronet_tools::evaluate::outage_chart;
use gyronet_tools::evaluate::outage_table::Outages;
use gyronet_tools::evaluate::report::Report;
use indicatif::ProgressBar;
use std::io::Write;
use std::path::{Path, PathBuf};

/// Measure the heading error of every method on recorded drives.
///
/// The input is drives with a reference: a yaw rate (ref_gyr_z), or a course (ref_yaw), which can judge only errors
/// over a minute and more. Wheel rates in a drive replace the wheel frames of the vehicle's bus. A drive with a
/// course that starts moving gets a simulated standstill, and the output says so.
///
/// For each drive, and as a mean of each folder, the command first prints the error of the delayed rate, relative
/// to that of the best classical method with the same inputs and no more delay. The classical methods are the raw
/// gyro, static initialisation, zero-rate updates, a linear-phase low pass, and VQF. Against a yaw rate it also
/// prints the share of the good seconds whose error lies inside the expected error that is sent with the delayed rate,
/// driving straight (and standing) and turning.
///
/// One row for each method follows: the error over 1 s, 60 s and the drive (RMS and at the end) in degrees, in JSON in
/// rad with the delay. The linear window is an estimate of all windows after static initialisation. The last two rows are the rates that the board
/// sends: the live rate, with the sample (Bosch TX1), and the delayed rate, in its own yaw messages.
#[derive(Debug, Clone, clap::Args)]
#[command(after_help = "\
Examples:
  gyronet evaluate trial09.csv trial11.csv
  gyronet evaluate */*.csv --json               # all drives, and the mean of each folder
  gyronet evaluate drive.csv --weights mine.blob --json
  gyronet evaluate drive.csv --outage 30,60,120 # the heading after a loss of GNSS
  gyronet evaluate */*.csv --outage 60 --pictures tunnel")]
pub struct Args {
    /// Recorded drives with ref_gyr_z or ref_yaw.
    #[arg(required = true, value_name = "FILE")]
    files: Vec<PathBuf>,
    /// Print the heading error after a loss of GNSS for so many seconds, which begins every 2 s, after 60 s of driving with
    /// a course, and after 20 s. The drives have `course` and `gnss_speed`, or `gnss_lat` and `gnss_lon`, besides a
    /// reference; they may begin in motion.
    #[arg(long, value_name = "SECONDS", value_delimiter = ',', value_parser = clap::value_parser!(u16).range(1..=3600))]
    #[arg(conflicts_with = "gyronet")]
    outage: Vec<u16>,
    /// With --outage, write pictures of the median and of the worst outage into this folder: median.svg, worst.svg.
    #[arg(long, value_name = "FOLDER", requires = "outage")]
    pictures: Option<PathBuf>,
    /// With --outage, do without these in gyronet's rows: the gain that courses show, the vertical that standstills and
    /// turns show. What the bias by courses is worth shows against zero-rate updates after a rest, what the model is worth
    /// against the row without it.
    #[arg(long, value_name = "PART", value_delimiter = ',', requires = "outage")]
    without: Vec<Part>,
    /// Add rows for the paper's GyroNet, in f32 and in integers; they take twenty times as long as all others together.
    #[arg(long)]
    gyronet: bool,
    #[command(flatten)]
    unit: weights::Unit,
}

/// What the board learns, and can be told not to.
#[derive(Debug, Clone, Copy, clap::ValueEnum)]
enum Part {
    Gain,
    Level,
}

impl Args {
    fn pipeline(&self) -> PipelineConfig {
        let mut pipeline = PipelineConfig::DEFAULT;
        for part in &self.without {
            match part {
                Part::Gain => pipeline.course.gain = 0.0,
                Part::Level => pipeline.levelling = false,
            }
        }
        pipeline
    }
}

pub fn run(args: &Args, common: Common) -> super::Result {
    if !args.outage.is_empty() {
        return outages(args, common);
    }
    let checkpoint = args.gyronet.then(bundled::checkpoint).transpose()?;
    let judge = |file: &Path, bar: &ProgressBar| {
        let drive = args.unit.drive(Drive::open_moving(file), common)?;
        bar.set_length(drive.facts.rows as u64);
        bar.reset();
        args.unit.sent.errors(&drive, checkpoint.as_ref(), |_| bar.inc(1))
    };
    let report = Report::new(drives::errors(&args.files, common, judge)?);
    let mut out = std::io::stdout().lock();
    if common.json {
        return print_json(&mut out, &report);
    }
    Ok(write!(out, "{}", paint::report(&report.to_string()))?)
}

type Found<'a> = (&'a Path, Vec<Outage>);

/// Hides the courses of each drive from every start on.
fn outages(args: &Args, common: Common) -> super::Result {
    let weights = args.unit.sent.open()?;
    let lengths: Vec<usize> = args.outage.iter().copied().map(usize::from).collect();
    let mut sets: Vec<(String, Vec<Found<'_>>)> = Vec::new();
    for file in &args.files {
        let drive = Drive::open_moving(file)?;
        let mut network = GyroNet::new(weights.blob()?);
        let bar = progress::bar(common, drive.facts.rows, drive.name());
        let found =
            outage::run(&drive, &mut network, &lengths, outage::EVERY_S, args.pipeline(), || bar.inc(1));
        bar.finish_and_clear();
        let (found, driven_s) = found?;
        if found.is_empty() {
            let (path, [_, needed]) = (&drive.path, outage::AFTER_S);
            let remark = format_args!(
                "{path}: no start: {driven_s:.0} s with a course that the board uses; {needed} s are needed, then the \
                 outage, with a reference at both ends"
            );
            super::remark(common, remark)?;
            continue;
        }
        let set = recording::set(file);
        match sets.iter_mut().find(|(own, _)| *own == set) {
            Some((_, drives)) => drives.push((file, found)),
            None => sets.push((set, vec![(file, found)])),
        }
    }
    if sets.is_empty() {
        return Err(outage::no_start(lengths.into_iter().min().unwrap_or_default()).into());
    }
    let drives = sets.iter().flat_map(|(_, drives)| drives);
    if let Some(folder) = &args.pictures {
        pictures(folder, drives.clone(), &mut GyroNet::new(weights.blob()?), args.pipeline())?;
    }
    let mut out = std::io::stdout().lock();
    let without: String =
        args.without.iter().map(|part| format!(", without {part:?}").to_lowercase()).collect();
    let table = |(set, drives): &(String, Vec<Found<'_>>)| {
        Outages::new(&format!("{set}{without}"), &lengths, drives.iter().map(|(_, found)| found.as_slice()))
    };
    let each: Vec<Outages> = sets.iter().map(table).collect();
    let all = Outages::new(&format!("all{without}"), &lengths, drives.map(|(_, found)| found.as_slice()));
    if common.json {
        let Outages { outage, outage_after_20_s, .. } = all;
        let json =
            serde_json::json!({ "outage": outage, "outage_after_20_s": outage_after_20_s, "sets": each });
        return print_json(&mut out, &json);
    }
    for set in each.iter().chain((each.len() > 1).then_some(&all)) {
        write!(out, "{set}")?;
    }
    Ok(())
}

fn pictures<'a>(
    folder: &Path,
    drives: impl Iterator<Item = &'a Found<'a>> + Clone,
    network: &mut GyroNet<'_>,
    ours: PipelineConfig,
) -> super::Result {
    let all = drives.clone().flat_map(|(_, found)| found);
    let chosen = outage_chart::typical(all).ok_or("no outage to draw: too little course or reference")?;
    std::fs::create_dir_all(folder).map_err(named(folder))?;
    for ((outage, which), name) in chosen.into_iter().zip(["median.svg", "worst.svg"]) {
        let is_of = |(_, found): &&Found<'_>| found.iter().any(|own| std::ptr::eq(own, outage));
        let Some((file, _)) = drives.clone().find(is_of) else { continue };
        let drive = Drive::open_moving(file)?;
        let points = outage::trace(&drive, network, outage, ours)?;
        let title = format!("{}, drive {}", recording::set(file), drive.name());
        let file = folder.join(name);
        std::fs::write(&file, outage_chart::svg(&title, &which, outage, &points)).map_err(named(&file))?;
    }
    Ok(())
}
