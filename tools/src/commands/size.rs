//! `gyronet size` compares the sizes of the firmware image with their budgets.

use super::Common;
use gyronet_tools::drive::error::{DataError, read};
use gyronet_tools::target::bench;
use gyronet_tools::target::size::{BUDGETS, ImageSize};
use gyronet_tools::target::stack::{Handler, ImageStack, Way};
use std::io::{self, Write};
use std::path::PathBuf;

/// Measure flash, static RAM and worst-case stack of the firmware image.
///
/// The command builds the image, or reads --elf, and prints each size and its budget in bytes. Static RAM is the SRAM
/// of statics and of code that runs from RAM; that code counts as flash too. The stack is an upper bound from the
/// machine code, with nested handlers of all priorities. The deepest call chains follow, with the stack of each
/// function. The exit status is 1 if a budget is exceeded.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Measure this ELF file [default: build the image].
    #[arg(long, value_name = "FILE")]
    elf: Option<PathBuf>,
}

pub fn run(args: &Args, common: Common) -> super::Result {
    let elf = match &args.elf {
        Some(elf) => elf.clone(),
        None => bench::build("coprocessor", &bench::target_folder())?,
    };
    let image = read(&elf)?;
    let size = ImageSize::read(&image).map_err(|error| DataError::because(elf.display(), error))?;
    let stack = ImageStack::read(&image)?;
    let measured = [size.flash, size.static_ram, stack.worst().into()];
    let rows: Vec<Row> = ["flash", "static_ram", "stack"].into_iter().zip(measured).zip(BUDGETS).collect();
    let out = &mut io::stdout().lock();
    let written = if common.json {
        writeln!(out, "{:#}", json(&rows, &stack))
    } else {
        print_sizes(out, &rows, &stack)
    };
    let over = rows.iter().filter(|((_, bytes), budget)| bytes > budget);
    let over: Vec<_> = over.map(|((name, _), _)| *name).collect();
    // A failed check is reported even if the output could not be written.
    if over.is_empty() { Ok(written?) } else { Err(format!("over budget: {}", over.join(", ")).into()) }
}

/// Name, bytes, budget.
type Row = ((&'static str, u64), u64);

fn json(rows: &[Row], stack: &ImageStack) -> serde_json::Value {
    let rows = rows.iter().map(|((name, bytes), budget)| {
        (String::from(*name), serde_json::json!({ "bytes": bytes, "budget": budget }))
    });
    let handlers = stack.handlers.iter().map(|handler| {
        serde_json::json!({ "priority": handler.priority, "bytes": handler.bytes, "deepest": handler.deepest })
    });
    let mut json = serde_json::Value::Object(rows.collect());
    json["stack_start"] = serde_json::json!({ "bytes": stack.start, "deepest": stack.deepest });
    json["stack_main"] = serde_json::json!({ "bytes": stack.main, "deepest": stack.deepest_main });
    json["stack_handlers"] = handlers.collect();
    json["indirect_calls"] = stack.indirect_calls.into();
    json
}

fn print_sizes(out: &mut impl Write, rows: &[Row], stack: &ImageStack) -> io::Result<()> {
    for ((name, bytes), budget) in rows {
        writeln!(out, "{name} bytes={bytes} budget={budget}")?;
    }
    print(out, "start", stack.start, &stack.deepest)?;
    print(out, "main", stack.main, &stack.deepest_main)?;
    writeln!(out, "stack/handlers bytes={}", stack.handlers())?;
    for Handler { priority, bytes, deepest } in &stack.handlers {
        let name = priority.map_or(String::from("fault"), |priority| format!("priority {priority}"));
        print(out, &name, *bytes, deepest)?;
    }
    writeln!(out, "indirect calls: {}", stack.indirect_calls)
}

fn print(out: &mut impl Write, name: &str, bytes: u32, deepest: &Way) -> io::Result<()> {
    writeln!(out, "stack/{name} bytes={bytes}")?;
    for (name, own) in deepest {
        writeln!(out, "  {own:5} {name}")?;
    }
    Ok(())
}
