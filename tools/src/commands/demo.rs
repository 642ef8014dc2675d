//! `gyronet demo`: all results of one drive.

use super::{Common, named, paint, print_json, progress, remarked, weights};
use gyronet::coprocessor::{Config, TimedFrame};
use gyronet::model::GyroNet;
use gyronet_tools::board::Board;
use gyronet_tools::bundled;
use gyronet_tools::demo::{Demo, Learnt, Trajectories, Tunnel};
use gyronet_tools::drive::candump::Log;
use gyronet_tools::drive::error::{DataError, DataFault};
use gyronet_tools::drive::replay::Steps;
use gyronet_tools::drive::stream::Drive;
use gyronet_tools::drive::word;
use gyronet_tools::evaluate::outage::EVERY_S;
use gyronet_tools::evaluate::rates::Rates;
use gyronet_tools::evaluate::report::{MARKS, Table};
use gyronet_tools::evaluate::rest;
use gyronet_tools::plot::page::grouped;
use std::error::Error;
use std::fs::File;
use std::io::{BufWriter, Write};
use std::panic::resume_unwind;
use std::path::PathBuf;

/// Show all results of one drive: a table of errors, a page, a CAN log.
///
/// The page (demo.html) needs only a browser. Its charts of yaw, errors and path, and of the bias, gain and tilt that the
/// board learns, can be zoomed. Its table has all methods; the terminal shows the best classical ones of each column,
/// static initialisation without and with zero-rate updates, and ours. Without FILE the command takes the simulated drive that comes with it.
#[derive(Debug, Clone, clap::Args)]
#[command(after_help = "\
Examples:
  gyronet demo                                  # the simulated drive
  gyronet demo drive.csv --out report           # yours; see `gyronet --help` for its columns")]
pub struct Args {
    /// Recorded drive (CSV); errors need its column ref_gyr_z or ref_yaw, and a path needs wheelN_rate or gnss_speed.
    #[arg(value_name = "FILE")]
    file: Option<PathBuf>,
    /// Folder for demo.html and can.log [default: target/demo].
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    #[command(flatten)]
    sent: weights::Sent,
}

pub fn run(args: &Args, common: Common) -> super::Result {
    // What the courses show takes as long as everything else.
    std::thread::scope(|scope| {
        let with_courses = scope.spawn(|| with_courses(args));
        results(args, common, || with_courses.join().unwrap_or_else(|panic| resume_unwind(panic)))
    })
}

type WithCourses = Result<(Option<Tunnel>, Learnt), Box<dyn Error + Send + Sync>>;

/// The table of errors has no courses: a course is an input of ours, and the classical methods have none.
fn with_courses(args: &Args) -> WithCourses {
    let weights = args.sent.open()?;
    let mut network = GyroNet::new(weights.blob()?);
    let mut run = |drive: Drive<'_>, every_s| -> WithCourses {
        let tunnel = Tunnel::new(&drive, &mut network, every_s)?;
        Ok((tunnel, Learnt::new(&drive, network.clone())?))
    };
    match &args.file {
        Some(path) => run(Drive::open_moving(path)?, EVERY_S),
        // A first try takes little time.
        None => run(Drive::from(&bundled::demo_drive(true)?), 5 * EVERY_S),
    }
}

fn results(args: &Args, common: Common, with_courses: impl FnOnce() -> WithCourses) -> super::Result {
    let weights = args.sent.open()?;
    let bundled = bundled::demo_drive(false)?;
    let drive = match &args.file {
        Some(path) => remarked(Drive::open_moving(path)?, common)?,
        None => Drive::from(&bundled),
    };
    let bar = progress::bar(common, drive.facts.rows, drive.name());
    let mut rates = Rates::of(&drive);
    let errors = args.sent.errors(&drive, None, |sample| {
        rates.add(sample);
        bar.inc(1);
    });
    bar.finish_and_clear();
    let errors = match errors {
        Ok(errors) => Some(errors),
        // A drive without a reference still has its log and its page.
        Err(error)
            if matches!(error.downcast_ref(), Some(DataError { fault: DataFault::NoReference, .. })) =>
        {
            None
        }
        Err(error) => return Err(error),
    };

    // What begins in motion has a simulated standstill before it, as in the errors.
    let starts_moving = errors.as_ref().is_some_and(|errors| errors.simulated_rest);
    let rested = if starts_moving { rest::before(&drive)? } else { None };
    let drive = rested.as_ref().unwrap_or(&drive);

    let folder = args.out.clone().unwrap_or_else(|| "target/demo".into());
    std::fs::create_dir_all(&folder).map_err(named(&folder))?;
    let [log, page] = ["can.log", "demo.html"].map(|name| folder.join(name));
    let file = File::create(&log).map_err(named(&log))?;
    let mut log_file = Log::new(BufWriter::new(file));
    let board = Board::new(Config::DEFAULT, drive.wheels(), GyroNet::new(weights.blob()?));
    for step in Steps::new(drive, board)? {
        for TimedFrame { frame, time } in &step?.frames {
            log_file.frame(*time, frame)?;
        }
    }
    let frames = log_file.finish()?;
    let simulated = args.file.is_none();
    let (tunnel, learnt) = with_courses().map_err(|error| -> Box<dyn Error> { error })?;
    let (errors, tunnel, trajectories) = (errors.as_ref(), tunnel.as_ref(), Trajectories::new(drive, &rates));
    let demo =
        Demo { drive, simulated, rates: &rates, errors, trajectories, tunnel, learnt: &learnt, frames };
    std::fs::write(&page, demo.page()).map_err(named(&page))?;

    let mut out = std::io::stdout().lock();
    if common.json {
        let mut json = demo.summary();
        json["files"] = serde_json::json!({ "page": page, "log": log });
        print_json(&mut out, &json)?;
        return Ok(());
    }
    let seconds = drive.facts.seconds();
    if simulated {
        let mark = console::style("A SIMULATED drive").yellow().bold();
        writeln!(
            out,
            "{mark} of {seconds:.0} s, of another vehicle than the model was trained on: it shows what the board"
        )?;
        writeln!(out, "does, not what you gain. Your own drive: cargo demo DRIVE.csv\n")?;
    } else {
        let note = if starts_moving { "; starts in motion: 3 s at rest are simulated before it" } else { "" };
        writeln!(out, "{}, {seconds:.0} s{note}\n", drive.name())?;
    }
    match errors {
        Some(errors) => {
            let table = Table { rows: &errors.methods, few: true };
            writeln!(out, "{}  {MARKS}\n", paint::report(&table.to_string()))?;
        }
        None => writeln!(out, "No reference (ref_gyr_z or ref_yaw), so no errors.\n")?,
    }
    match (tunnel, &args.file) {
        (Some(tunnel), _) => writeln!(out, "{}", paint::report(&tunnel.to_string()))?,
        (None, Some(file)) => {
            let file = word(file);
            writeln!(out, "No tunnel: cargo gyronet evaluate {file} --outage 60 says what it lacks.\n")?;
        }
        (None, None) => {}
    }
    writeln!(out, "every result, as a page   {}", page.display())?;
    writeln!(
        out,
        "{:<25} {} (cantools decode tools/gyronet.dbc reads it)",
        format!("{} CAN frames", grouped(frames)),
        log.display()
    )?;
    Ok(())
}
