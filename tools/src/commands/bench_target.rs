//! `gyronet bench-target` counts instructions and models cycles of every kernel, network and parser.

use super::Common;
use gyronet_tools::target::bench::{self, Count, Counts};
use gyronet_tools::target::parser_load::ParserLoad;
use gyronet_tools::target::schedule::Schedule;
use gyronet_tools::target::size::ImageSize;
use gyronet_tools::target::tasks::{self, Cycles, Tasks};
use std::io::{self, Write};
use std::path::Path;

/// Count instructions and model cycles of the firmware on a Cortex-M4F, in QEMU.
///
/// The command builds the images and runs them. It needs qemu-system-arm, and a C compiler for the cycles. Cycles are
/// modelled, not measured on silicon: at zero wait states, and on an STM32F405 at 168 MHz with five.
///
/// It prints one line for each kernel, network and sensor parser: `name instructions=N cycles=N cycles_5ws=N
/// stack=BYTES`. Sizes follow, then each parser's cost per byte and its share of the processor's time. A table of all
/// tasks and interrupts of the flashed image, counted while it runs, ends the output. It says whether each task meets
/// its deadline at 168 MHz and 5 wait states with a quarter of the deadline to spare.
///
/// The exit status is 1 if the instruction count of a network's window depends on its input, or if a task can miss
/// its deadline.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Print only the cycles under each policy of the flash accelerator that ST's manual leaves open.
    #[arg(long)]
    policies: bool,
}

/// CMSIS-NN s8 on the same networks: instructions and modelled cycles (gcc 12.2 -O3).
const CMSIS_NN_S8: [(&str, u64, u64); 3] = [
    ("gyronet/window", 3_484_464, 4_382_365),
    ("gyronet/newest", 2_437_867, 3_060_000),
    ("fognet/window", 63_790_273, 81_700_000),
];

/// Runs the command.
pub fn run(args: &Args, common: Common) -> super::Result {
    let workspace = bench::workspace();
    let folder = bench::target_folder();
    if args.policies {
        return policies(&workspace, &folder);
    }
    let mut counts = Counts::default();
    for image in bench::IMAGES {
        let image = bench::build(&workspace, image, &folder)?;
        counts.extend(bench::measure(&workspace, &image)?);
    }
    let image = bench::build(&workspace, "coprocessor", &folder)?;
    let coprocessor = ImageSize::read(&image)?;
    let tasks = if counts.exact() { Some(schedule(&workspace, &image, &counts)?) } else { None };
    let out = &mut io::stdout().lock();
    let written = if common.json {
        writeln!(out, "{}", json(&counts, &coprocessor, tasks.as_ref().map(|(_, schedule)| schedule)))
    } else {
        print(out, &counts, &coprocessor, tasks.as_ref())
    };
    // A failed check is reported even if the output could not be written.
    if !counts.constant() {
        return Err("the instruction count of a window depends on its input".into());
    }
    if tasks.is_some_and(|(_, schedule)| !schedule.met()) {
        return Err("a task of the image can miss its deadline".into());
    }
    Ok(written?)
}

/// Prints the cycles of the networks, the pipeline and the parsers under each policy, one region per line.
fn policies(workspace: &Path, folder: &Path) -> super::Result {
    let out = &mut io::stdout().lock();
    let names = bench::POLICIES.map(|(name, _)| name);
    writeln!(out, "cycles at 5 wait states: {}", names.join("; "))?;
    for image in bench::IMAGES {
        let image = bench::build(workspace, image, folder)?;
        let counts = bench::measure_policies(workspace, &image)?;
        let Some((first, others)) = counts.split_first() else { continue };
        let mut before = "";
        for (k, count) in first.regions.iter().enumerate() {
            let Some(cycles) = count.cycles_5ws.filter(|_| before != count.name) else { continue };
            write!(out, "{}: {cycles}", count.name)?;
            for other in others {
                let cycles = other.regions.get(k).and_then(|other| other.cycles_5ws).unwrap_or_default();
                write!(out, "; {cycles}")?;
            }
            writeln!(out)?;
            before = &count.name;
        }
    }
    Ok(())
}

/// The costs of the image's handlers, and the schedule with their response times.
type Timing = (Tasks, Schedule);

/// Counts the tasks of the flashed image while it runs the largest model, and computes their response times.
fn schedule(workspace: &Path, image: &Path, counts: &Counts) -> Result<Timing, Box<dyn std::error::Error>> {
    let plugin = bench::plugin(workspace).ok_or("the instruction counter cannot be built")?;
    let tasks = tasks::measure(image, &plugin)?;
    let fognet = counts.get("fognet/window").and_then(|count| {
        let cycles = Cycles { zero: count.cycles?, five: count.cycles_5ws? };
        Some((count.instructions, cycles))
    });
    let schedule = Schedule::new(&tasks, fognet);
    let schedule = schedule.ok_or("the image has a task that is not in the table of deadlines")?;
    Ok((tasks, schedule))
}

fn print(
    out: &mut impl Write,
    counts: &Counts,
    coprocessor: &ImageSize,
    tasks: Option<&Timing>,
) -> io::Result<()> {
    for Count { name, instructions, cycles, cycles_5ws, stack } in &counts.regions {
        match cycles.zip(*cycles_5ws) {
            Some((zero, five)) => {
                let cycles = Cycles { zero, five };
                writeln!(out, "{name} instructions={instructions} {cycles} stack={stack}")?
            }
            None => writeln!(out, "{name} instructions={instructions} stack={stack}")?,
        }
    }
    for (name, bytes) in &counts.sizes {
        writeln!(out, "{name} bytes={bytes}")?;
    }
    let ImageSize { flash, kernels, static_ram, ccm } = coprocessor;
    writeln!(out, "coprocessor/flash bytes={flash}")?;
    writeln!(out, "coprocessor/static_ram bytes={static_ram}")?;
    writeln!(out, "coprocessor/ccm bytes={ccm}")?;
    writeln!(out, "kernels/code bytes={kernels}")?;
    for load in ParserLoad::all(counts) {
        writeln!(out, "{load}")?;
    }
    for (name, instructions, cycles) in CMSIS_NN_S8 {
        if let Some(count) = counts.get(name) {
            let fewer = |peer: u64, ours: u64| peer as f64 / ours.max(1) as f64;
            write!(
                out,
                "{name} against CMSIS-NN s8: {:.2}x fewer instructions",
                fewer(instructions, count.instructions)
            )?;
            match count.cycles {
                Some(ours) => writeln!(out, ", {:.2}x fewer modelled cycles", fewer(cycles, ours))?,
                None => writeln!(out)?,
            }
        }
    }
    if let Some((tasks, schedule)) = tasks {
        writeln!(out, "{tasks}\n{schedule}")?;
    }
    if !counts.exact() {
        writeln!(
            out,
            "no C compiler or no plugins: instructions from SysTick, +-6; cycles and deadlines left out"
        )?;
    }
    Ok(())
}

fn json(counts: &Counts, coprocessor: &ImageSize, schedule: Option<&Schedule>) -> serde_json::Value {
    let regions: Vec<_> = counts
        .regions
        .iter()
        .map(|count| {
            serde_json::json!({
                "name": count.name,
                "instructions": count.instructions,
                "cycles": count.cycles,
                "cycles_5ws": count.cycles_5ws,
                "stack": count.stack,
            })
        })
        .collect();
    let sizes: serde_json::Map<String, serde_json::Value> =
        counts.sizes.iter().map(|(name, bytes)| (name.clone(), (*bytes).into())).collect();
    serde_json::json!({
        "regions": regions,
        "sizes": sizes,
        "parsers": ParserLoad::all(counts),
        "flash": coprocessor.flash,
        "static_ram": coprocessor.static_ram,
        "ccm": coprocessor.ccm,
        "kernels": coprocessor.kernels,
        "tasks": schedule,
    })
}
