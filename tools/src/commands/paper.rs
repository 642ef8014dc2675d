//! `gyronet paper` repeats the paper's complete evaluation, from the data sets' files to its tables.

use super::{Common, WriteError, print_json, remark};
use gyronet_tools::paper::rerun::plan::{Effort, Program, plan};
use gyronet_tools::paper::rerun::report::{Report, Set};
use gyronet_tools::paper::rerun::run::{self, Runner};
use gyronet_tools::paper::rerun::split::Split;
use gyronet_tools::paper::sequence;
use gyronet_tools::simulate::layout::Layout;
use std::fs::{self, File};
use std::io::{BufRead, BufReader, Write};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// Repeat the paper's evaluation: train, test and compare on its data sets.
///
/// The command finds the paper's sequences by name (KAIST_ROOT/urban06 to urban37, NCLT_ROOT/2012-01-08 to
/// 2013-04-05) and splits them as the paper does. It trains and quantises GyroNet and FoGNet, trains and runs the
/// rivals lwoi and RINS-W, and computes all tables and figures. DIR/report.md has the results; it lists the sequences
/// that are missing and those that were left out, with the reason. The exit status is 1 if a step failed.
///
/// Run the command again to continue where it stopped: each finished step leaves a marker that records its inputs,
/// and is repeated only if they have changed. Commands, logs and times are below DIR.
///
/// Training needs a Python with the packages of tools/train/requirements.txt.
#[derive(Debug, Clone, clap::Args)]
#[command(after_help = "\
Examples:
  gyronet paper KAIST NCLT --out REPORT --python .venv/bin/python
  gyronet paper KAIST --out TRIAL --quick      # tries every step, trains nothing well")]
pub struct Args {
    /// Folder with the sequences of KAIST Urban.
    #[arg(value_name = "KAIST_ROOT")]
    kaist: PathBuf,
    /// Folder with the sequences of NCLT.
    #[arg(value_name = "NCLT_ROOT")]
    nclt: Option<PathBuf>,
    /// Write everything to this folder; report.md is the report.
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Python for training [default: GYRONET_PYTHON, or python3].
    #[arg(long, value_name = "FILE")]
    python: Option<String>,
    /// Train only briefly, to try every step; the report says so.
    #[arg(long)]
    quick: bool,
    /// Train lwoi on every Nth window [default: 2]; its memory grows with the square of the number of windows.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1000))]
    lwoi_every: Option<u32>,
}

/// The folder of the Python code.
const TRAIN: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/train");
/// The Python packages that training needs.
const PACKAGES: &str = "torch, numpy, safetensors, scipy, gpytorch, tqdm";

/// Runs the subcommand.
pub fn run(args: &Args, common: Common) -> super::Result {
    let roots = [(Layout::Kaist, Some(&args.kaist)), (Layout::Nclt, args.nclt.as_ref())];
    let mut splits = Vec::new();
    for (layout, root) in roots {
        if let Some(root) = root {
            splits.push(Split::find(layout, root)?);
        }
    }
    let out = std::path::absolute(&args.out)?;
    let mut runner = Processes::new(args, common)?;
    let effort = if args.quick { Effort::TRIAL } else { Effort::FULL };
    let effort = Effort { lwoi_every: args.lwoi_every.unwrap_or(effort.lwoi_every), ..effort };
    let mut report = Report { effort, sets: Vec::new() };
    for mut split in splits {
        for member in &mut split.members {
            member.folder = std::path::absolute(&member.folder)?;
        }
        let steps = plan(&split, effort, &out, sequence::files);
        let steps = run::run(&steps, &out, &mut runner, |number, name| {
            // The line only shows progress, so an error of standard error is ignored.
            let _ = remark(common, format_args!("step {} of {}: {name}", number + 1, steps.len()));
        });
        report.sets.push(Set { split, steps: steps.map_err(WriteError::to(&out))? });
    }
    let path = out.join("report.md");
    fs::write(&path, report.markdown(&out)?).map_err(WriteError::to(&path))?;
    let mut stdout = std::io::stdout().lock();
    if common.json {
        print_json(&mut stdout, &report)?;
    } else {
        report.remarks().iter().try_for_each(|line| writeln!(stdout, "{line}"))?;
        writeln!(stdout, "{}", path.display())?;
    }
    if report.is_whole() { Ok(()) } else { Err(format!("some steps failed: see {}", path.display()).into()) }
}

/// A [`Runner`] that runs the steps as processes.
struct Processes {
    gyronet: String,
    python: String,
    code: Vec<PathBuf>,
    common: Common,
}

impl Processes {
    fn new(args: &Args, common: Common) -> Result<Self, Box<dyn std::error::Error>> {
        let python = args.python.clone().or_else(|| std::env::var("GYRONET_PYTHON").ok());
        let python = python.unwrap_or_else(|| "python3".into());
        let check = Command::new(&python).args(["-c", &format!("import {PACKAGES}")]).output();
        let check = check.map_err(|error| format!("{python}: {error}; name a Python with --python"))?;
        if !check.status.success() {
            let text = String::from_utf8_lossy(&check.stderr);
            let why = text.lines().last().unwrap_or("it failed");
            return Err(format!(
                "{python}: {why}; install tools/train/requirements.txt, or name a Python with --python"
            )
            .into());
        }
        let folder = Path::new(TRAIN).join("gyronet_train");
        let mut code = Vec::new();
        for entry in fs::read_dir(&folder).map_err(WriteError::to(&folder))? {
            code.push(entry?.path());
        }
        code.retain(|path| path.extension().is_some_and(|extension| extension == "py"));
        code.sort();
        let gyronet = std::env::current_exe()?.display().to_string();
        Ok(Self { gyronet, python, code, common })
    }
}

impl Runner for Processes {
    fn program(&self, program: Program) -> String {
        match program {
            Program::Gyronet => self.gyronet.clone(),
            Program::Python => self.python.clone(),
        }
    }

    fn files(&self, program: Program) -> Vec<PathBuf> {
        match program {
            // Otherwise a new build of this command would repeat days of training.
            Program::Gyronet => Vec::new(),
            Program::Python => self.code.clone(),
        }
    }

    fn run(&mut self, program: Program, command: &[String], log: &Path) -> Result<(), String> {
        self.process(program, command, log).map_err(|error| error.to_string())
    }
}

impl Processes {
    /// Runs a process. Its output is written to the log, and Python's output and all remarks also to our standard
    /// error.
    fn process(&self, program: Program, command: &[String], log: &Path) -> super::Result {
        let error = WriteError::to(log);
        let mut file = File::create(log).map_err(&error)?;
        let (reader, writer) = std::io::pipe()?;
        let [name, arguments @ ..] = command else { return Err("no command".into()) };
        let stdout: Stdio = match program {
            Program::Gyronet => file.try_clone().map_err(&error)?.into(),
            Program::Python => writer.try_clone()?.into(),
        };
        let mut child = Command::new(name)
            .args(arguments)
            .env("PYTHONPATH", TRAIN)
            .env("PYTHONUNBUFFERED", "1")
            .stdin(Stdio::null())
            .stdout(stdout)
            .stderr(writer)
            .spawn()
            .map_err(|error| format!("{name}: {error}"))?;
        let mut last = String::new();
        for line in BufReader::new(reader).lines() {
            let line = line?;
            // The remarks of a gyronet step are not part of its result.
            if program == Program::Python {
                writeln!(file, "{line}").map_err(&error)?;
            }
            remark(self.common, format_args!("  {line}"))?;
            if !line.trim().is_empty() {
                last = line;
            }
        }
        let status = child.wait()?;
        if status.success() {
            return Ok(());
        }
        Err(if last.is_empty() { format!("{name}: {status}") } else { last }.into())
    }
}
