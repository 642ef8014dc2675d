//! This module computes the cost of a task from its counted activations.

use crate::target::tasks::{Activation, Cycles, Handler, Least};

/// Entering and leaving a handler takes this many cycles: 12 and 10 (Cortex-M4 TRM, 3.9.1), and 17 words of
/// floating-point registers each way.
pub(super) const EXCEPTION: u64 = 12 + 10 + 2 * 17;
/// Reading a line of flash takes this many cycles, five of them wait states.
pub(super) const LINE_READ: u64 = 6;
/// Both caches have this many lines: no activation can cost a preempted task more of them.
pub(super) const LINES: u64 = 64 + 8;
/// Taking the vector costs three lines: the vector itself, read from flash, its place in the cache, and the line that
/// was in use before.
pub(super) const VECTOR: u64 = 3 * LINE_READ;
/// Copying a frame, with the code around it but without `can_frames` itself, takes at most this many cycles.
pub(super) const COPY: u64 = 150;

/// Says how the cost of a task follows from its activations.
pub(super) enum Cost {
    /// The task costs its worst activation.
    Worst,
    /// The task costs the worst activation that moved no more than so many bytes, as on a real line: one in, and two
    /// out if something is sent on it. The emulated line moves all bytes at once.
    Bytes(usize),
    /// The task costs, in 10 ms, the worst activation with one sample, the worst without, the cheapest one for each
    /// sent frame that pends it, and a check of all lines with every tick, because the emulated line delivers many
    /// bytes at a time.
    Sample,
}

/// In 10 ms the output task is pended this many times without work: by ten sent frames and the end of a window.
pub(super) const TURNS: u64 = 10 + 1;
/// In 10 ms there are this many ticks; with each the output task checks every line.
pub(super) const TICKS: u64 = 10;

/// Returns the cycles of one activation with entry, exit, and its cost to the preempted task.
fn whole(cycles: Cycles, fills: u64) -> Cycles {
    let five = cycles.five + EXCEPTION + VECTOR + fills.min(LINES) * LINE_READ;
    Cycles { zero: cycles.zero + EXCEPTION, five }
}

impl Cost {
    /// Returns activations, instructions and modelled cycles in a period.
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
        // For code that never ran, each instruction counts once, at three cycles; there are half as many words as
        // halfwords.
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
                // On a host that is too slow to send samples one by one, the worst of several is used.
                let sample = kind(1).unwrap_or_else(|| whole(cycles, fills)) + kind(0).unwrap_or_default();
                let least = |least: Least| whole(least.cycles, least.fills);
                sample + least(handler.least) * TURNS + least(handler.looking) * TICKS
            }
        };
        (runs, instructions, cycles)
    }

    /// Returns the cycles of each of many activations: one that moves several bytes stands for as many activations.
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
