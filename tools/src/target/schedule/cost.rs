//! This module computes the cost of a task from its counted activations.

use crate::target::tasks::{Activation, Cycles, Handler, Least};

/// Cycles to enter and leave a handler: 12 and 10 (Cortex-M4 TRM, 3.9.1), and 17 words of floating-point registers
/// each way.
pub(super) const EXCEPTION: u64 = 12 + 10 + 2 * 17;
/// Cycles to read a line of flash, five of them wait states.
pub(super) const LINE_READ: u64 = 6;
/// Number of lines in both caches: no activation can cost a preempted task more lines.
pub(super) const LINES: u64 = 64 + 8;
/// Cycles to take the vector. It costs three lines: the vector itself, read from flash, its place in the cache, and
/// the line that was in use before.
pub(super) const VECTOR: u64 = 3 * LINE_READ;
/// Upper limit of the cycles to copy a frame, with the code around it but without `can_frames` itself.
pub(super) const COPY: u64 = 150;

/// The rule that computes a task's cost from its activations.
pub(super) enum Cost {
    /// The task costs its worst activation.
    Worst,
    /// The task costs the worst activation that moved at most this many bytes, as on a real line: one received, and
    /// two sent if the line is used for sending. The emulated line moves all bytes at once.
    Bytes(usize),
    /// The task costs, in 10 ms, the worst activation with one sample, the worst without a sample, the cheapest one
    /// for each sent frame that pends the task, and a check of all lines with every tick, because the emulated line
    /// delivers many bytes at a time.
    Sample,
}

/// Number of times in 10 ms that the output task is pended without work: by ten sent frames and the end of a window.
pub(super) const TURNS: u64 = 10 + 1;
/// Number of ticks in 10 ms; at each tick the output task checks all lines.
pub(super) const TICKS: u64 = 10;

/// Returns the cycles of one activation, including entry, exit, and its cost to the preempted task.
fn whole(cycles: Cycles, fills: u64) -> Cycles {
    let five = cycles.five + EXCEPTION + VECTOR + fills.min(LINES) * LINE_READ;
    Cycles { zero: cycles.zero + EXCEPTION, five }
}

impl Cost {
    /// Returns the number of activations, the instructions, and the modelled cycles per period.
    pub(super) fn of(&self, handler: &Handler) -> (u64, u64, Cycles) {
        let kinds = if let Self::Bytes(most) = self { 1 + most } else { handler.activations.len() };
        let ran = || handler.activations.iter().take(kinds).flatten();
        let runs = ran().map(|activation| activation.runs).sum();
        let worst = ran().copied().reduce(|a, b| Activation {
            runs,
            instructions: a.instructions.max(b.instructions),
            cycles: a.cycles.max(b.cycles),
            fills: a.fills.max(b.fills),
        });
        // For code that never ran, each halfword counts as an instruction of three cycles, and a flash line holds
        // eight.
        let worst = worst.unwrap_or_else(|| {
            let (zero, lines) = (3 * handler.code + COPY, handler.code / 8 + 1);
            let cycles = Cycles { zero, five: zero + 2 * lines * LINE_READ };
            Activation { runs, instructions: handler.code, cycles, fills: lines }
        });
        let Activation { instructions, cycles, fills, .. } = worst;
        let cycles = match self {
            Self::Worst | Self::Bytes(_) => whole(cycles, fills),
            Self::Sample => {
                let kind = |kind: usize| handler.activations[kind].map(|ran| whole(ran.cycles, ran.fills));
                // If the host is too slow to send samples one by one, use the worst activation of several samples.
                let sample = kind(1).unwrap_or_else(|| whole(cycles, fills)) + kind(0).unwrap_or_default();
                let least = |least: Least| whole(least.cycles, least.fills);
                sample + least(handler.least) * TURNS + least(handler.looking) * TICKS
            }
        };
        (runs, instructions, cycles)
    }

    /// Returns the cycles of each of many activations: an activation that moves several bytes counts as several.
    pub(super) fn each(&self, handler: &Handler) -> Option<Cycles> {
        let Self::Bytes(most) = self else { return None };
        let ran = handler.activations.iter().enumerate().take(1 + most);
        let each = ran.filter_map(|(bytes, ran)| {
            let Cycles { zero, five } = ran.map(|ran| whole(ran.cycles, ran.fills))?;
            let bytes = bytes.max(1) as u64;
            Some(Cycles { zero: zero.div_ceil(bytes), five: five.div_ceil(bytes) })
        });
        each.reduce(Cycles::max)
    }
}
