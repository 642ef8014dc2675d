//! `gyronet bench-target` counts instructions and models cycles of every kernel, network and parser.

use super::Common;
use gyronet_tools::target::bench::{self, Count, Counts};
use std::io::{self, Write};

/// Count instructions and model cycles of the firmware on a Cortex-M4F, in QEMU.
///
/// The command builds the bench images and runs them. It needs qemu-system-arm and a C compiler. Cycles are modelled
/// from the Cortex-M4's manual at zero wait states, not measured on silicon: `cargo bringup` counts them on a board.
///
/// It prints one line for each kernel, network and sensor parser: `name instructions=N cycles=N stack=BYTES`. Sizes
/// follow: of states, weights, parsers, and of the frames that the parsers got.
///
/// The exit status is 1 if the instruction count of a network's window depends on its input.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Was: cycles with flash wait states under four cache policies.
    #[arg(long, hide = true)]
    policies: bool,
}

/// Runs the command.
pub fn run(args: &Args, common: Common) -> super::Result {
    if args.policies {
        return Err(
            "--policies is gone with the flash model: `cargo bringup` counts cycles on a board".into()
        );
    }
    let workspace = bench::workspace();
    let folder = bench::target_folder();
    let mut counts = Counts::default();
    for image in bench::IMAGES {
        let image = bench::build(&workspace, image, &folder)?;
        counts.extend(bench::measure(&workspace, &image)?);
    }
    let out = &mut io::stdout().lock();
    let written = if common.json { writeln!(out, "{}", json(&counts)) } else { print(out, &counts) };
    // A failed check is reported even if the output could not be written.
    if !counts.constant() {
        return Err("the instruction count of a window depends on its input".into());
    }
    Ok(written?)
}

fn print(out: &mut impl Write, counts: &Counts) -> io::Result<()> {
    for Count { name, instructions, cycles, stack } in &counts.regions {
        writeln!(out, "{name} instructions={instructions} cycles={cycles} stack={stack}")?;
    }
    counts.sizes.iter().try_for_each(|(name, bytes)| writeln!(out, "{name} bytes={bytes}"))
}

fn json(counts: &Counts) -> serde_json::Value {
    let region = |count: &Count| {
        let Count { name, instructions, cycles, stack } = count;
        serde_json::json!({ "name": name, "instructions": instructions, "cycles": cycles, "stack": stack })
    };
    let sizes = counts.sizes.iter().map(|(name, bytes)| (name.clone(), (*bytes).into()));
    serde_json::json!({
        "regions": counts.regions.iter().map(region).collect::<Vec<_>>(),
        "sizes": sizes.collect::<serde_json::Map<_, _>>(),
    })
}
