//! This module finds the addresses of an image's handlers, for the plugin that counts them.

use super::{Handler, KINDS, Least};
use crate::target::stack;
use object::{Object, ObjectSymbol};
use std::path::Path;

/// Function that the output task runs for each sample.
const WATCHED: &str = "gyronet::coprocessor::Coprocessor::imu";
/// Function that the output task runs to check all lines.
const LOOKING: &str = "output::Output::poll_inputs";
/// The exception numbers and names of the handlers (RM0090, table 62), and the data register that a serial line's
/// handler reads and writes (RM0090, table 1 and 30.6.2).
const VECTORS: [(usize, &str, u32); 10] = [
    (15, "SysTick", 0),
    (16 + 1, "PVD", 0),
    (16 + 19, "CAN1_TX", 0),
    (16 + 20, "CAN1_RX0", 0),
    (16 + 37, "USART1", 0x4001_1004),
    (16 + 38, "USART2", 0x4000_4404),
    (16 + 39, "USART3", 0x4000_4804),
    (16 + 52, "UART4", 0),
    (16 + 53, "UART5", 0),
    (16 + 71, "USART6", 0x4001_1404),
];

/// Holds the handlers, each with the plugin's option for it, and the addresses of the watched functions.
pub struct Symbols {
    pub handlers: Vec<(Handler, String)>,
    pub watched: u32,
    pub looking: u32,
}

impl Symbols {
    /// Reads the symbols of an image; the error names the missing symbol.
    pub fn read(image: &Path) -> Result<Self, String> {
        let bad = |what: &dyn std::fmt::Display| format!("{}: {what}", image.display());
        let bytes = std::fs::read(image).map_err(|error| bad(&error))?;
        let elf = object::File::parse(&*bytes).map_err(|error| bad(&error))?;
        let symbol = |name: &str| elf.symbols().find(|symbol| symbol.name().is_ok_and(|n| n == name));
        let mut handlers = Vec::new();
        for (vector, priority) in stack::priorities(&bytes).map_err(|error| bad(&error))? {
            let known = VECTORS.iter().find(|(number, ..)| *number == vector);
            let (_, name, data) = known.ok_or_else(|| bad(&format!("vector {vector} has no name here")))?;
            let symbol = symbol(name).ok_or_else(|| bad(&format!("no handler {name}")))?;
            let (start, len) = (symbol.address() as u32 & !1, symbol.size() as u32);
            // A function marked `#[interrupt]` has a symbol of its own, unless it is inlined.
            let marked = format!("__cortex_m_rt_{name}");
            let is_body = |symbol: &object::Symbol<'_, '_>| symbol.name().is_ok_and(|n| n.contains(&marked));
            let body: u64 = elf.symbols().filter(is_body).map(|symbol| symbol.size()).sum();
            let handler = Handler {
                name: (*name).to_owned(),
                priority,
                activations: [None; KINDS],
                least: Least::default(),
                looking: Least::default(),
                code: (u64::from(len) + body) / 2,
            };
            handlers.push((handler, format!(",handler={name}:{start:x}:{:x}:{data:x}", start + len)));
        }
        let address = |function: &str| {
            let is_it = |mangled| format!("{:#}", rustc_demangle::demangle(mangled)).ends_with(function);
            let symbol = elf.symbols().find(|symbol| symbol.name().is_ok_and(is_it));
            symbol.map(|symbol| symbol.address() as u32 & !1).ok_or_else(|| bad(&format!("no {function}")))
        };
        let (watched, looking) = (address(WATCHED)?, address(LOOKING)?);
        Ok(Self { handlers, watched, looking })
    }
}
