//! What every task and interrupt of the flashed image costs, counted while it runs in the
//! emulator: one sample after the other goes in, with wheel speeds, questions on the service
//! line and a host's commands beside it.

mod drive;
mod symbols;

use crate::emulator::EmulatorError;
use crate::target_bench::{BenchError, field};
use std::path::Path;
use symbols::Symbols;

/// Kinds of activations of a handler: by how many bytes it has moved, or samples processed; the last
/// one is as many or more.
pub const KINDS: usize = 5;

/// Everything that was counted of an image.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Tasks {
    /// Its handlers.
    pub handlers: Vec<Handler>,
    /// Modelled cycles for which all interrupts were off, at worst.
    pub all_off: u64,
    /// Modelled cycles for which idle kept the output task out, at worst.
    pub some_off: u64,
}

/// One interrupt handler of the image.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Handler {
    /// As the vector table names it.
    pub name: String,
    /// The larger the more urgent.
    pub priority: u8,
    /// Of each kind, the worst.
    pub activations: [Option<Activation>; KINDS],
    /// Modelled cycles of the cheapest activation.
    pub least: u64,
    /// Halfwords of its code, what it calls left out.
    pub code: u64,
}

/// The worst of the activations of a handler, preemption left out.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Activation {
    /// How many there were.
    pub runs: u64,
    /// Instructions of the longest one.
    pub instructions: u64,
    /// Modelled cycles of the most expensive one.
    pub cycles: u64,
}

impl std::fmt::Display for Handler {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "task/{} priority={}", self.name, self.priority)?;
        if self.least == 0 {
            write!(f, " runs=0")?;
        }
        for (kind, activation) in self.activations.iter().enumerate() {
            if let Some(Activation { runs, instructions, cycles }) = activation {
                let more = if kind == KINDS - 1 { "+" } else { "" };
                write!(f, " [{kind}{more}: runs={runs} instructions={instructions} cycles={cycles}]")?;
            }
        }
        if self.least > 0 {
            write!(f, " least={}", self.least)?;
        }
        Ok(())
    }
}

impl std::fmt::Display for Tasks {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        self.handlers.iter().try_for_each(|handler| writeln!(f, "{handler}"))?;
        write!(
            f,
            "interrupts off: cycles={}; output kept out by idle: cycles={}",
            self.all_off, self.some_off
        )
    }
}

/// Runs the image with the plugin; all of its handlers.
///
/// # Errors
/// [`BenchError`], also when the image does not answer.
pub fn measure(image: &Path, plugin: &Path) -> Result<Tasks, BenchError> {
    let Symbols { handlers, watched } = Symbols::read(image).map_err(BenchError::Line)?;
    let mut options = format!("{},watch={watched:x}", plugin.display());
    handlers.iter().for_each(|(_, option)| options += option);
    let (mut all_off, mut some_off) = (0, 0);
    let mut found: Vec<Handler> = handlers.into_iter().map(|(handler, _)| handler).collect();
    let failed = |error: EmulatorError| BenchError::Failed {
        program: image.display().to_string(),
        output: error.to_string(),
    };
    let printed = drive::run(image, &options).map_err(failed)?;
    for line in printed.lines() {
        let (what, rest) = line.split_once(' ').unwrap_or_default();
        let number = |key| field(line, key).ok_or_else(|| BenchError::Line(line.to_owned()));
        if what == "LOCKED" {
            (all_off, some_off) = (number("all=")?, number("some=")?);
        }
        let name = rest.split(' ').next().unwrap_or_default();
        let Some(handler) = found.iter_mut().find(|handler| handler.name == name) else { continue };
        if what == "HANDLER" {
            handler.least = number("least=")?;
        } else if let Some(activation) = handler.activations.get_mut(number("seen=")? as usize) {
            let (runs, instructions, cycles) = (number("runs=")?, number("insns=")?, number("cycles=")?);
            *activation = Some(Activation { runs, instructions, cycles });
        }
    }
    Ok(Tasks { handlers: found, all_off, some_off })
}
