//! This module counts the cost of every task and interrupt of the flashed image while the image runs in the emulator.
//! The image receives samples one by one, with wheel speeds, requests on the service line and a host's commands in
//! between.

mod drive;
mod symbols;

use crate::target::bench::{BenchError, field};
use crate::target::emulator::EmulatorError;
use crate::target::largest_model;
use std::path::Path;
use symbols::Symbols;

/// Number of kinds of a handler's activations. Kind k moved k bytes or processed k samples; the last kind includes
/// larger numbers.
pub const KINDS: usize = 5;

/// Holds all counts of an image.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Tasks {
    /// The image's handlers.
    pub handlers: Vec<Handler>,
    /// The longest time with all interrupts off.
    pub all_off: Cycles,
    /// The longest time for which the idle task blocked the output task.
    pub some_off: Cycles,
}

/// Modelled cycles: the largest number at zero wait states, and the largest on an STM32F405 at 168 MHz.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Cycles {
    /// Cycles at zero wait states.
    pub zero: u64,
    /// Cycles with flash at 5 wait states and empty caches at the start.
    pub five: u64,
}

/// The cheapest activation of a handler, without what preempts it; zero if there was none.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Least {
    /// The cycles of the cheapest activation.
    pub cycles: Cycles,
    /// Lines that it loaded into the caches.
    pub fills: u64,
}

impl std::fmt::Display for Least {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} fills={}", self.cycles, self.fills)
    }
}

impl Cycles {
    /// Returns the larger value of each field.
    #[must_use]
    pub fn max(self, other: Self) -> Self {
        Self { zero: self.zero.max(other.zero), five: self.five.max(other.five) }
    }
}

impl std::ops::Add for Cycles {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self { zero: self.zero + other.zero, five: self.five + other.five }
    }
}

impl std::ops::Mul<u64> for Cycles {
    type Output = Self;

    fn mul(self, times: u64) -> Self {
        Self { zero: self.zero * times, five: self.five * times }
    }
}

impl std::fmt::Display for Cycles {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "cycles={} cycles_5ws={}", self.zero, self.five)
    }
}

/// Describes an interrupt handler of the image.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Handler {
    /// The name in the vector table.
    pub name: String,
    /// Priority; higher is more urgent.
    pub priority: u8,
    /// The worst activation of each kind.
    pub activations: [Option<Activation>; KINDS],
    /// The cheapest activation.
    pub least: Least,
    /// The cheapest activation that checks all lines and processes no sample, if there is one.
    pub looking: Least,
    /// Size of the handler's code in halfwords, without the functions that it calls.
    pub code: u64,
}

/// Worst-case costs of a handler's activations of one kind, without what preempts them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Activation {
    /// Number of activations.
    pub runs: u64,
    /// Instructions of the longest activation.
    pub instructions: u64,
    /// Cycles of the most expensive activation.
    pub cycles: Cycles,
    /// Largest number of lines that an activation loaded into the caches.
    pub fills: u64,
}

impl std::fmt::Display for Handler {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "task/{} priority={}", self.name, self.priority)?;
        if self.least.cycles.zero == 0 {
            write!(f, " runs=0")?;
        }
        for (kind, activation) in self.activations.iter().enumerate() {
            if let Some(Activation { runs, instructions, cycles, fills }) = activation {
                let more = if kind == KINDS - 1 { "+" } else { "" };
                write!(f, " [{kind}{more}: runs={runs} instructions={instructions} {cycles} fills={fills}]")?;
            }
        }
        if self.least.cycles.zero > 0 {
            write!(f, " least: {}", self.least)?;
        }
        if self.looking.cycles.zero > 0 {
            write!(f, " looking: {}", self.looking)?;
        }
        Ok(())
    }
}

impl std::fmt::Display for Tasks {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        self.handlers.iter().try_for_each(|handler| writeln!(f, "{handler}"))?;
        write!(f, "interrupts off: {}; output blocked by idle: {}", self.all_off, self.some_off)
    }
}

/// Runs the image with the plugin and the largest model, and returns the counts of all its handlers.
///
/// # Errors
/// [`BenchError`], also when the image does not answer.
pub fn measure(image: &Path, plugin: &Path) -> Result<Tasks, BenchError> {
    let Symbols { handlers, watched, looking } = Symbols::read(image).map_err(BenchError::Line)?;
    let mut options = format!("{},watch={watched:x},look={looking:x}", plugin.display());
    handlers.iter().for_each(|(_, option)| options += option);
    let (mut all_off, mut some_off) = (Cycles::default(), Cycles::default());
    let mut found: Vec<Handler> = handlers.into_iter().map(|(handler, _)| handler).collect();
    let failed = |error: EmulatorError| BenchError::Failed {
        program: image.display().to_string(),
        output: error.to_string(),
    };
    let folder = tempfile::tempdir().map_err(|error| BenchError::Line(error.to_string()))?;
    let loaded =
        largest_model::arguments(folder.path()).map_err(|error| BenchError::Line(error.to_string()))?;
    let printed = drive::run(image, &options, &loaded).map_err(failed)?;
    for line in printed.lines() {
        let (what, rest) = line.split_once(' ').unwrap_or_default();
        let number = |key| field(line, key).ok_or_else(|| BenchError::Line(line.to_owned()));
        if what == "LOCKED" {
            all_off = Cycles { zero: number("all=")?, five: number("all_waited=")? };
            some_off = Cycles { zero: number("some=")?, five: number("some_waited=")? };
        }
        let name = rest.split(' ').next().unwrap_or_default();
        let Some(handler) = found.iter_mut().find(|handler| handler.name == name) else { continue };
        if what == "HANDLER" {
            let least = |zero, five, fills| {
                let cycles = Cycles { zero: number(zero)?, five: number(five)? };
                Ok::<_, BenchError>(Least { cycles, fills: number(fills)? })
            };
            handler.least = least("least=", "least_waited=", "least_fills=")?;
            handler.looking = least("looking=", "looking_waited=", "looking_fills=")?;
        } else if let Some(activation) = handler.activations.get_mut(number("seen=")? as usize) {
            *activation = Some(Activation {
                runs: number("runs=")?,
                instructions: number("insns=")?,
                cycles: Cycles { zero: number("cycles=")?, five: number("waited=")? },
                fills: number("fills=")?,
            });
        }
    }
    Ok(Tasks { handlers: found, all_off, some_off })
}
