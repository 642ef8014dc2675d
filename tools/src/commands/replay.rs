//! `gyronet replay`: a recording through the integer pipeline, its CAN frames to a log.

use super::networks::Weights;
use super::{Common, WriteError, progress};
use gyronet::can::config::Config;
use gyronet::can::feeds::Feeds;
use gyronet::model::GyroNet;
use gyronet_tools::drive::Drive;
use gyronet_tools::recording::Recording;
use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

/// Run a recorded drive through the pipeline that is flashed, and write the CAN frames that it
/// emits as a candump log, with the recording's own time stamps.
///
/// The log goes to stdout unless --out names a file; the summary goes to stderr. can-utils'
/// canplayer and python-can can play the log.
#[derive(Debug, Clone, clap::Args)]
pub struct Args {
    /// Recording.
    #[arg(value_name = "FILE")]
    file: PathBuf,
    /// Where the log goes.
    #[arg(long, value_name = "FILE.log")]
    out: Option<PathBuf>,
    /// Weight file, instead of the one that comes with the library.
    #[arg(long, value_name = "BLOB")]
    weights: Option<PathBuf>,
}

/// Runs the subcommand.
pub fn run(args: &Args, common: Common) -> super::Result {
    let weights = Weights::open(args.weights.as_deref())?;
    let mut network = GyroNet::new(weights.blob()?);
    let recording = Recording::read(&args.file)?;
    let bar = progress::bar(common, recording.rows.len(), recording.name());
    let drive = Drive::run(&recording, &mut network, || bar.inc(1));
    bar.finish_and_clear();
    let drive = drive?;
    let mut feeds = Feeds::new(Config::DEFAULT);
    let frames = match &args.out {
        Some(path) => write_file(&drive, &mut feeds, path)?,
        None => drive.log(&mut feeds, BufWriter::new(io::stdout().lock()))?,
    };
    let mut err = io::stderr().lock();
    writeln!(err, "{}: {frames} frames in {:.2} s", recording.path, recording.seconds())?;
    let statuses = drive.status_counts().map(|(status, count)| format!("{status:?} {count}").to_lowercase());
    writeln!(err, "status: {}", statuses.join(", "))?;
    writeln!(err, "events: {}", events(&drive, &feeds))?;
    Ok(())
}

/// Writes a drive's frames to a file.
pub(super) fn write_file(drive: &Drive, feeds: &mut Feeds, path: &Path) -> Result<u64, WriteError> {
    let error = WriteError::to(path);
    let file = File::create(path).map_err(&error)?;
    drive.log(feeds, BufWriter::new(file)).map_err(&error)
}

/// All counters that are not zero.
fn events(drive: &Drive, feeds: &Feeds) -> String {
    let c = &drive.counters;
    let all = [
        ("samples", c.samples),
        ("windows", c.windows),
        ("missing", c.missing),
        ("misplaced", c.misplaced),
        ("clock jumps", c.clock_jumps),
        ("clipped", c.clipped),
        ("moving", c.moving),
        ("clamped inputs", c.clamped_inputs),
        ("implausible", c.implausible),
        ("late", c.late),
        ("out of range", feeds.out_of_range()),
    ];
    let seen: Vec<String> =
        all.iter().filter(|(_, count)| *count > 0).map(|(name, count)| format!("{name} {count}")).collect();
    seen.join(", ")
}
