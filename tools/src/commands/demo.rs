//! `gyronet demo`: all results of one drive.

use super::{Common, WriteError, print_json, read_drive, weights, write_log};
use gyronet::can::config::Config;
use gyronet_tools::bundled;
use gyronet_tools::demo::picture;
use gyronet_tools::demo::{Demo, ShortTable};
use gyronet_tools::evaluate::report::{DriveErrors, EvaluateError};
use gyronet_tools::plot::page::grouped;
use std::io::Write;
use std::path::{Path, PathBuf};

/// Show all results of one drive: a table of errors, a page, a CAN log.
///
/// The page (demo.html) needs only a browser. It has charts of yaw, errors and path that can be zoomed, the table
/// of methods, decoded CAN messages, time and memory. Without FILE the command takes the simulated drive that
/// comes with it.
#[derive(Debug, Clone, clap::Args)]
#[command(after_help = "\
Examples:
  gyronet demo                                  # the simulated drive
  gyronet demo drive.csv --out report           # yours; see `gyronet --help` for its columns")]
pub struct Args {
    /// Recorded drive (CSV, 100 Hz); errors need its column ref_gyr_z or ref_yaw, and a path needs wheelN_rate.
    #[arg(value_name = "FILE")]
    file: Option<PathBuf>,
    /// Folder for demo.html, yaw.svg and can.log [default: target/demo].
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    #[arg(long, hide = true)]
    image: bool,
    #[command(flatten)]
    networks: weights::Files,
}

/// Runs the subcommand.
pub fn run(args: &Args, common: Common) -> super::Result {
    if args.image {
        return Err("--image is gone: the image as flashed runs on the virtual board, `cargo test -p gyronet-host-tests \
                    --test board`; `gyronet size` prints its size and `gyronet bench-target` its instructions"
            .into());
    }
    let (recording, title) = match &args.file {
        Some(path) => {
            let recording = read_drive(path, common)?;
            let title = format!("Yaw of a recorded drive, {}", recording.name());
            (recording, title)
        }
        None => (bundled::demo_drive()?, String::from("Yaw of a simulated drive")),
    };
    let rates = args.networks.rates(&recording, common)?;
    let errors = match DriveErrors::new(&recording, &rates) {
        Ok(errors) => Some(errors),
        // A drive without a reference still has its log and its picture.
        Err(EvaluateError::NoReference { .. }) => None,
        Err(error) => return Err(error.into()),
    };

    let folder = args.out.clone().unwrap_or_else(default_folder);
    std::fs::create_dir_all(&folder).map_err(WriteError::to(&folder))?;
    let [log, picture, page] = ["can.log", "yaw.svg", "demo.html"].map(|name| folder.join(name));
    let frames = write_log(&rates.drive, &log)?;
    std::fs::write(&picture, picture::svg(&title, &rates)?).map_err(WriteError::to(&picture))?;
    let simulated = args.file.is_none();
    let demo = Demo::new(&recording, simulated, &rates, errors.as_ref(), (Config::DEFAULT, frames));
    std::fs::write(&page, demo.page()).map_err(WriteError::to(&page))?;

    let mut out = std::io::stdout().lock();
    if common.json {
        let mut json = serde_json::to_value(demo.summary())?;
        json["files"] = serde_json::json!({ "page": page, "picture": picture, "log": log });
        print_json(&mut out, &json)?;
        return Ok(());
    }
    let seconds = recording.seconds();
    if simulated {
        let mark = console::style("A SIMULATED drive").yellow().bold();
        writeln!(
            out,
            "{mark} of {seconds:.0} s, of another vehicle than the model was trained on: it shows what the board"
        )?;
        writeln!(out, "does, not what you gain. Your own drive: cargo demo DRIVE.csv\n")?;
    } else {
        writeln!(out, "{}, {seconds:.0} s\n", recording.name())?;
    }
    match &errors {
        Some(errors) => writeln!(out, "{}", ShortTable(errors))?,
        None => writeln!(out, "No reference (ref_gyr_z or ref_yaw), so no errors.\n")?,
    }
    writeln!(out, "every result, as a page   {}", page.display())?;
    writeln!(out, "yaw and its error         {}", picture.display())?;
    writeln!(
        out,
        "{:<25} {} (cargo gyronet monitor FILE decodes it)",
        format!("{} CAN frames", grouped(frames)),
        log.display()
    )?;
    Ok(())
}

/// Returns `target/demo` of the workspace when cargo runs the command, else of the working directory.
fn default_folder() -> PathBuf {
    let workspace = std::env::var_os("CARGO_MANIFEST_DIR")
        .and_then(|manifest| Some(Path::new(&manifest).parent()?.to_owned()));
    // A short path where the user stands in the workspace.
    let elsewhere = workspace.filter(|folder| std::env::current_dir().is_ok_and(|here| here != *folder));
    elsewhere.unwrap_or_default().join("target/demo")
}
