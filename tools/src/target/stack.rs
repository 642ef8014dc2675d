//! Computes the deepest stack that a firmware image can need, from its machine code alone.
//!
//! A function's own stack use is the sum of its pushes and subtractions from the stack pointer; its calls are read
//! from its branches. An indirect call may go to any function whose address is anywhere in the image. Recursion, and
//! a stack pointer moved by a register, have no bound and are errors. Every handler of the vector table may interrupt
//! every other handler once, except those of its own priority, each on top of the largest frame that the processor
//! pushes. An RTIC image initialises with interrupts off, so handlers do not add to the stack of the functions that
//! initialise it.
//!
//! The result is an upper bound. The analysis relies on the symbol table: code without a symbol, or addresses
//! computed at run time, would be missed; the images have neither.

mod code;
mod priority;
mod thumb;

use code::Code;
use std::collections::{BTreeMap, HashMap};

/// Bytes that the processor pushes at an exception: registers, floating-point registers, alignment (ARMv7-M, B1.5.6).
const EXCEPTION_FRAME: u32 = 32 + 72 + 4;
const RESET: &str = "Reset";
/// End of the name of the function that RTIC runs with interrupts off; its last step switches them on.
const MASKED: &str = "__rtic_init_resources";

#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum StackError {
    #[error("not a firmware image: {0}")]
    Format(String),
    #[error("recursion: {}", .0.join(" -> "))]
    Recursion(Vec<String>),
    #[error("{function} moves the stack pointer by a register at {address:#010x}")]
    Dynamic { function: String, address: u32 },
    #[error("{function} calls {target:#010x}, where no function begins")]
    Target { function: String, target: u32 },
}

/// The functions of the deepest call chain, outermost first, each with its own stack use in bytes.
pub type Way = Vec<(String, u32)>;

#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Handler {
    /// Priority, higher is more urgent; a handler without a priority may interrupt everything.
    pub priority: Option<u8>,
    /// Stack of the handler in bytes, the processor's frame included.
    pub bytes: u32,
    pub deepest: Way,
}

#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ImageStack {
    /// Bytes of the main program while interrupts are on.
    pub main: u32,
    /// Bytes of the main program while interrupts are still off.
    pub start: u32,
    /// The nested interrupt and exception handlers, the most urgent one first.
    pub handlers: Vec<Handler>,
    pub indirect_calls: usize,
    /// The deepest call chain while interrupts are still off.
    pub deepest: Way,
    /// The deepest call chain while interrupts are on.
    pub deepest_main: Way,
}

impl ImageStack {
    /// Returns the worst-case stack, bytes.
    pub fn worst(&self) -> u32 {
        self.start.max(self.main + self.handlers())
    }

    pub fn handlers(&self) -> u32 {
        self.handlers.iter().map(|handler| handler.bytes).sum()
    }

    pub fn read(elf: &[u8]) -> Result<Self, StackError> {
        let code = Code::read(elf)?;
        let mut depths = HashMap::new();
        let reset = code.named(RESET).ok_or_else(|| StackError::Format(format!("no {RESET}")))?;
        let start = code.depth(reset, &mut Vec::new(), &mut depths)?;
        let mut unmasked = code.masked();
        let main = code.depth(reset, &mut Vec::new(), &mut unmasked)?;
        let mut handlers = Vec::new();
        for (priority, group) in code.vectors.groups(reset) {
            let mut needs = Vec::new();
            for handler in group {
                needs.push((code.depth(handler, &mut Vec::new(), &mut depths)?, handler));
            }
            let Some((depth, handler)) = needs.into_iter().max() else { continue };
            let deepest = code.deepest(handler, &depths);
            handlers.push(Handler { priority, bytes: EXCEPTION_FRAME + depth, deepest });
        }
        let indirect_calls = code.functions.values().map(|function| function.indirect).sum();
        let (deepest, deepest_main) = (code.deepest(reset, &depths), code.deepest(reset, &unmasked));
        Ok(Self { main, start, handlers, indirect_calls, deepest, deepest_main })
    }
}

/// Returns the numbers and priorities of the exceptions that an image lists; higher is more urgent.
pub fn priorities(elf: &[u8]) -> Result<BTreeMap<usize, u8>, StackError> {
    Ok(Code::read(elf)?.vectors.priorities)
}

pub fn functions(elf: &[u8]) -> Result<Vec<String>, StackError> {
    Ok(Code::read(elf)?.functions.into_values().map(|function| function.name).collect())
}
