//! `gyronet bench-target` counts instructions and models cycles of every kernel, network and parser.

use super::Common;
use gyronet_tools::target::bench::{self, Count, Counts};
use gyronet_tools::target::cmsis_nn::{self, Region};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

/// Count instructions and model cycles of the firmware on a Cortex-M4F, in QEMU.
///
/// The command builds the bench images and runs them. It needs qemu-system-arm and a C compiler. Cycles are modelled
/// from the Cortex-M4's manual at zero wait states, not measured on silicon: `cargo bringup` counts them on a board.
///
/// It prints one line for each kernel, network and sensor parser: `name instructions=N cycles=N stack=BYTES`. Sizes
/// follow: of states and weights.
///
/// With --cmsis-nn it prints GyroNet's network by CMSIS-NN beside ours, in the same emulator with the same counter. That
/// needs arm-none-eabi-gcc, and the sources: git clone --depth 1 https://github.com/ARM-software/CMSIS-NN
///
/// The exit status is 1 if the instruction count of a network's window depends on its input.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Compare GyroNet with CMSIS-NN, whose sources are in DIR.
    #[arg(long, value_name = "DIR")]
    cmsis_nn: Option<PathBuf>,
}

pub fn run(args: &Args, common: Common) -> super::Result {
    let folder = bench::target_folder();
    if let Some(sources) = &args.cmsis_nn {
        return compare(&folder, sources, common);
    }
    let counts = measure(&folder)?;
    let out = &mut io::stdout().lock();
    let written = if common.json { writeln!(out, "{}", json(&counts)) } else { print(out, &counts) };
    // A failed check is reported even if the output could not be written.
    if !counts.constant() {
        return Err("the instruction count of a window depends on its input".into());
    }
    Ok(written?)
}

fn measure(folder: &Path) -> Result<Counts, bench::BenchError> {
    bench::measure(&bench::build(bench::IMAGE, folder)?)
}

fn print(out: &mut impl Write, counts: &Counts) -> io::Result<()> {
    for Count { name, instructions, cycles, stack } in &counts.regions {
        writeln!(out, "{name} instructions={instructions} cycles={cycles} stack={stack}")?;
    }
    counts.sizes.iter().try_for_each(|(name, bytes)| writeln!(out, "{name} bytes={bytes}"))
}

fn json(counts: &Counts) -> serde_json::Value {
    let sizes = counts.sizes.iter().map(|(name, bytes)| (name.clone(), (*bytes).into()));
    serde_json::json!({
        "regions": counts.regions,
        "sizes": sizes.collect::<serde_json::Map<_, _>>(),
    })
}

/// Prints GyroNet's window by our kernels and by CMSIS-NN's.
fn compare(folder: &Path, sources: &Path, common: Common) -> super::Result {
    // CMSIS-NN first: where its sources or its compiler are missing, nothing of ours is built.
    let (theirs, compiler) = cmsis_nn::measure(sources)?;
    let counts = measure(folder)?;
    let ours = counts.get("gyronet/window").ok_or("the bench image has printed no window")?;
    let Count { name, instructions, cycles, .. } = ours;
    let out = &mut io::stdout().lock();
    if common.json {
        let row = |name: &str, instructions: u64, cycles: u64| serde_json::json!({ "name": name, "instructions": instructions, "cycles": cycles });
        let theirs = theirs.iter().map(|region| row(&region.name, region.instructions, region.cycles));
        let rows = std::iter::once(row(name, *instructions, *cycles)).chain(theirs);
        writeln!(out, "{}", rows.collect::<serde_json::Value>())?;
        return Ok(());
    }
    writeln!(out, "GyroNet's network on a Cortex-M4, zero wait states; CMSIS-NN by gcc {compiler} -O3")?;
    writeln!(out, "{name} instructions={instructions} cycles={cycles}")?;
    for region in theirs {
        let [more, longer] = [(region.instructions, *instructions), (region.cycles, *cycles)]
            .map(|(theirs, ours)| theirs as f64 / ours.max(1) as f64);
        let Region { name, instructions, cycles } = region;
        writeln!(out, "{name} instructions={instructions} ({more:.2}x) cycles={cycles} ({longer:.2}x)")?;
    }
    Ok(())
}
