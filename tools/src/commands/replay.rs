//! `gyronet replay` runs a drive through the board's code and writes its CAN log.

use super::weights::Unit;
use super::{Common, named, print_json, progress};
use gyronet::coprocessor::{Config, Coprocessor, TimedFrame};
use gyronet::health::Status;
use gyronet::model::GyroNet;
use gyronet_tools::board::{Board, Step};
use gyronet_tools::drive::candump::Log;
use gyronet_tools::drive::error::DataError;
use gyronet_tools::drive::export;
use gyronet_tools::drive::replay::{Steps, initialise};
use gyronet_tools::drive::stream::Drive;
use std::collections::BTreeMap;
use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

/// Write the CAN messages that a board would send on a recorded drive.
///
/// The command runs the drive through the pipeline that is flashed, with its wheels and courses: with courses it may begin
/// in motion. The log has the format of `candump -L`;
/// can-utils' canplayer and python-can can play it. All files are in time of day if the vehicle file has the start of
/// the recording (`gyronet import` writes it), else in the recording's time. It is written to standard output, unless
/// --out names a file or --csv or --tum is given. The summary is written to standard error; with --json it is
/// written to standard output if the log is not.
#[derive(Debug, Clone, clap::Args)]
#[command(after_help = "\
Examples:
  gyronet replay drive.csv --out can.log
  gyronet replay drive.csv | head
  gyronet replay drive.csv --out can.log --csv rates.csv --tum path.tum")]
pub struct Args {
    /// Recorded drive.
    #[arg(value_name = "FILE")]
    file: PathBuf,
    /// Write the log to this file [default: standard output].
    #[arg(long, value_name = "FILE.log")]
    out: Option<PathBuf>,
    /// Write the rates, the yaw and its expected error to this table, one line per sample.
    #[arg(long, value_name = "FILE.csv")]
    csv: Option<PathBuf>,
    /// Write the path computed from the wheels and the delayed yaw to this file, in the TUM format that evo reads.
    #[arg(long, value_name = "FILE.tum")]
    tum: Option<PathBuf>,
    #[command(flatten)]
    unit: Unit,
}

/// A file that is written while the drive is read.
struct Output<'a>(BufWriter<File>, &'a Path);

impl<'a> Output<'a> {
    fn new(path: &'a Path) -> Result<Self, DataError> {
        Ok(Self(File::create(path).map(BufWriter::new).map_err(named(path))?, path))
    }

    fn write(&mut self, write: impl FnOnce(&mut BufWriter<File>) -> io::Result<()>) -> Result<(), DataError> {
        write(&mut self.0).map_err(named(self.1))
    }
}

pub fn run(args: &Args, common: Common) -> super::Result {
    let weights = args.unit.sent.open()?;
    let drive = args.unit.drive(Drive::open_with_courses(&args.file), common);
    let drive = drive.map_err(|error| -> Box<dyn std::error::Error> { error })?;
    if !drive.facts.has_course {
        // A drive that cannot be replayed leaves no file behind.
        initialise(&drive)?;
    }
    let writes_elsewhere = [&args.csv, &args.tum].into_iter().any(Option::is_some);
    let log: Box<dyn Write> = match &args.out {
        Some(path) => Box::new(BufWriter::new(File::create(path).map_err(named(path))?)),
        None if writes_elsewhere => Box::new(io::sink()),
        None => Box::new(BufWriter::new(io::stdout().lock())),
    };
    let log_error = |error: io::Error| -> Box<dyn std::error::Error> {
        match &args.out {
            Some(path) => named(path)(error).into(),
            None => error.into(),
        }
    };
    let mut log = Log::new(log);
    let mut table = args.csv.as_deref().map(Output::new).transpose()?;
    if let Some(table) = &mut table {
        table.write(|out| writeln!(out, "{}", export::HEADER))?;
    }
    let mut tum = match &args.tum {
        None => None,
        Some(path) => {
            let speeds = drive
                .speeds()
                .ok_or_else(|| format!("{}: --tum needs wheels, since a path needs a speed", drive.path))?;
            Some((export::Tum::new(speeds), Output::new(path)?))
        }
    };

    let start_us = drive.vehicle.recording.start.map_or(0, |start| (1e6 * start).round() as u64);
    let mut statuses = BTreeMap::from(STATUSES.map(|status| (status_name(status), 0u64)));
    let board = Board::new(Config::DEFAULT, drive.wheels(), GyroNet::new(weights.blob()?));
    let board = if drive.facts.has_course { board.moving(true) } else { board };
    let mut steps = Steps::new(&drive, board)?;
    let bar = progress::bar(common, drive.facts.rows, drive.name());
    for step in &mut steps {
        let mut step: Step = step?;
        step.time.0 += start_us;
        step.frames.iter_mut().for_each(|sent| sent.time.0 += start_us);
        bar.inc(1);
        for TimedFrame { frame, time } in &step.frames {
            log.frame(*time, frame).map_err(log_error)?;
        }
        if let Some(table) = &mut table {
            table.write(|out| export::line(&step, out))?;
        }
        if let Some((tum, path)) = &mut tum {
            path.write(|out| tum.pose(&step, out))?;
        }
        statuses.entry(status_name(step.vehicle.live.status)).and_modify(|count| *count += 1);
    }
    bar.finish_and_clear();
    let frames = log.finish().map_err(log_error)?;
    for mut output in table.into_iter().chain(tum.map(|(_, path)| path)) {
        output.write(BufWriter::flush)?;
    }
    let coprocessor = steps.board().coprocessor();
    let events = events(coprocessor);
    if common.json {
        let summary = serde_json::json!({
            "recording": drive.path,
            "seconds": drive.facts.seconds(),
            "frames": frames,
            "status": statuses,
            "events": events.into_iter().collect::<BTreeMap<_, _>>(),
        });
        if args.out.is_some() || writes_elsewhere {
            print_json(&mut io::stdout().lock(), &summary)?;
        } else {
            print_json(&mut io::stderr().lock(), &summary)?;
        }
    } else if !common.quiet {
        let mut err = io::stderr().lock();
        writeln!(err, "{}: {frames} frames in {:.2} s", drive.path, drive.facts.seconds())?;
        let named = STATUSES.map(status_name).map(|name| format!("{name} {}", statuses[&name]));
        writeln!(err, "status: {}", named.join(", "))?;
        let events: Vec<String> = events.iter().map(|(name, count)| format!("{name} {count}")).collect();
        writeln!(err, "events: {}", events.join(", "))?;
    }
    Ok(())
}

const STATUSES: [Status; 4] = [Status::Init, Status::Degraded, Status::Ready, Status::Clipped];

fn status_name(status: Status) -> String {
    format!("{status:?}").to_lowercase()
}

fn events(coprocessor: &Coprocessor) -> Vec<(&'static str, u32)> {
    let (c, courses) = (coprocessor.pipeline().counters(), coprocessor.pipeline().course_counters());
    let all = [
        ("samples", c.samples),
        ("windows", c.windows),
        ("missing", c.missing),
        ("misplaced", c.misplaced),
        ("clock jumps", c.clock_jumps),
        ("invalid", c.invalid),
        ("moving", c.moving),
        ("clamped inputs", c.clamped_inputs),
        ("implausible", c.implausible),
        ("late", c.late),
        ("courses used", courses.used),
        ("courses refused", courses.refused),
        ("out of range", coprocessor.input_counters().out_of_range),
    ];
    all.into_iter().filter(|(_, count)| *count > 0).collect()
}
