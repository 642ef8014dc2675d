//! This module runs the steps of a plan, except those that are already finished.

use super::marker::Marker;
use super::plan::{Argument, Program, Step};
use serde::Serialize;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::time::Instant;
use std::{fs, io};

/// Runs the command of a step.
pub trait Runner {
    /// Returns the path or name of the program.
    fn program(&self, program: Program) -> String;

    /// Returns the files of the program's code; when one changes, the program's steps are run again.
    fn files(&self, program: Program) -> Vec<PathBuf>;

    /// Runs a command, whose first element is the program, and writes its output to the file `log`.
    ///
    /// # Errors
    /// The reason of the failure, in one line.
    fn run(&mut self, program: Program, command: &[String], log: &Path) -> Result<(), String>;
}

/// The outcome of a step.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Outcome {
    /// The step was run, in this time, s.
    Made(f64),
    /// The step was finished in an earlier run, which took this time, s.
    Kept(f64),
    /// The step failed, for this reason.
    Failed(String),
    /// The step was not run, because a step that it needs failed.
    LeftOut(String),
}

/// The names and outcomes of the steps, in order.
pub type Outcomes = Vec<(String, Outcome)>;

/// Returns the path of a step's log.
#[must_use]
pub fn log(out: &Path, step: &str) -> PathBuf {
    out.join("logs").join(step.replace('/', "-") + ".log")
}

fn marker(out: &Path, step: &str) -> PathBuf {
    out.join("steps").join(step.replace('/', "-") + ".json")
}

/// Runs the steps in order. A failed step stops only the steps that need it. `tell` is called with the index and the
/// name of each step that is run.
///
/// # Errors
/// The file system's error if a folder or a marker cannot be written.
pub fn run(
    steps: &[Step],
    out: &Path,
    runner: &mut impl Runner,
    mut tell: impl FnMut(usize, &str),
) -> io::Result<Outcomes> {
    for folder in ["steps", "logs"] {
        fs::create_dir_all(out.join(folder))?;
    }
    let mut hashes: BTreeMap<&str, String> = BTreeMap::new();
    let mut outcomes = Outcomes::new();
    for (number, step) in steps.iter().enumerate() {
        if let Some(needed) = step.needs.as_deref().filter(|needed| !hashes.contains_key(needed)) {
            outcomes.push((step.name.clone(), Outcome::LeftOut(format!("it needs {needed}"))));
            continue;
        }
        let (command, read) = resolve(step, runner.program(step.program), &hashes);
        let inputs = [step.inputs.clone(), runner.files(step.program)].concat();
        let mut now = Marker::of(command, &inputs, read)?;
        let path = marker(out, &step.name);
        let is_there = step.output.as_ref().is_none_or(|output| output.is_file());
        let outcome = match Marker::read(&path).filter(|last| is_there && last.is_same(&now)) {
            Some(last) => Outcome::Kept(last.seconds),
            None => {
                tell(number, &step.name);
                remove(&path)?;
                if let Some(folder) = step.output.as_ref().and_then(|output| output.parent()) {
                    fs::create_dir_all(folder)?;
                }
                let started = Instant::now();
                match runner.run(step.program, &now.command, &log(out, &step.name)) {
                    Ok(()) => {
                        now.seconds = started.elapsed().as_secs_f64();
                        now.write(&path)?;
                        Outcome::Made(now.seconds)
                    }
                    Err(why) => Outcome::Failed(why),
                }
            }
        };
        if matches!(outcome, Outcome::Made(_) | Outcome::Kept(_)) {
            hashes.insert(&step.name, now.hash());
        }
        outcomes.push((step.name.clone(), outcome));
    }
    Ok(outcomes)
}

/// Returns the command of a step, and the finished steps whose results the command reads.
fn resolve(step: &Step, program: String, done: &BTreeMap<&str, String>) -> (Vec<String>, Vec<String>) {
    let (mut command, mut read) = (vec![program], Vec::new());
    let used = |name: &str| done.get(name).map(|hash| format!("{name} {hash}"));
    read.extend(step.needs.as_deref().and_then(used));
    for argument in &step.arguments {
        match argument {
            Argument::Always(text) => command.push(text.clone()),
            Argument::If(name, texts) => {
                if let Some(entry) = used(name) {
                    read.push(entry);
                    command.extend(texts.iter().cloned());
                }
            }
        }
    }
    (command, read)
}

fn remove(path: &Path) -> io::Result<()> {
    match fs::remove_file(path) {
        Err(error) if error.kind() != io::ErrorKind::NotFound => Err(error),
        _ => Ok(()),
    }
}
