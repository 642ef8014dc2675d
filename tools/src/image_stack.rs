//! The deepest stack that a firmware image can need, from its machine code alone.
//!
//! Every function's own need is what its pushes and subtractions from the stack pointer add up
//! to; what it calls is read from its branches. A call through a register may go to any
//! function whose address stands anywhere in the image. Recursion, and a stack pointer moved by
//! a register, have no bound and are errors. Interrupts: every handler of the vector table may
//! interrupt every other one once, each behind the largest frame that the processor pushes. Not
//! so while an RTIC image initialises: that runs with interrupts off, until its own frame is left.
//!
//! The result is an upper bound. It trusts the symbol table: code that no symbol covers, or
//! addresses computed at run time, would escape it; the images have neither.

mod thumb;

use object::{Object, ObjectSection, ObjectSymbol, SymbolKind};
use std::collections::{BTreeMap, BTreeSet, HashMap};
use thumb::Effect;

/// What the processor pushes at an exception: registers, floating-point registers, alignment
/// (ARMv7-M, B1.5.6).
const EXCEPTION_FRAME: u32 = 32 + 72 + 4;
/// Where the image starts, and the handlers that end it.
const RESET: &str = "Reset";
/// What RTIC runs with interrupts off; it switches them on as its last step.
const MASKED: &str = "__rtic_init_resources";

/// Why there is no bound.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum StackError {
    /// Not an ELF file of the kind.
    #[error("not a firmware image: {0}")]
    Format(String),
    /// A function calls itself, by way of others or not.
    #[error("recursion: {}", .0.join(" -> "))]
    Recursion(Vec<String>),
    /// The stack pointer is moved by a register.
    #[error("{function} moves the stack pointer by a register at {address:#010x}")]
    Dynamic {
        /// Which one.
        function: String,
        /// Where.
        address: u32,
    },
    /// A call to where no function is.
    #[error("{function} calls {target:#010x}, where no function begins")]
    Target {
        /// Which one.
        function: String,
        /// Where to.
        target: u32,
    },
}

/// The deepest stack of an image.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ImageStack {
    /// Of the main program, when handlers can come.
    pub main: u32,
    /// Of the main program, before they can.
    pub start: u32,
    /// Of all interrupt and exception handlers, one inside the other, frames included.
    pub handlers: u32,
    /// Calls through a register.
    pub indirect_calls: usize,
    /// Functions on the main program's deepest way, outermost first, each with its own need.
    pub deepest: Vec<(String, u32)>,
}

impl ImageStack {
    /// At worst.
    #[must_use]
    pub fn worst(&self) -> u32 {
        self.start.max(self.main + self.handlers)
    }

    /// Reads an image.
    ///
    /// # Errors
    /// [`StackError`].
    pub fn read(elf: &[u8]) -> Result<Self, StackError> {
        let code = Code::read(elf)?;
        let mut depths = HashMap::new();
        let reset = code.named(RESET).ok_or_else(|| StackError::Format(format!("no {RESET}")))?;
        let start = code.depth(reset, &mut Vec::new(), &mut depths)?;
        let mut unmasked = code.masked();
        let main = code.depth(reset, &mut Vec::new(), &mut unmasked)?;
        let mut handlers = 0;
        for handler in code.handlers.iter().filter(|handler| **handler != reset) {
            handlers += EXCEPTION_FRAME + code.depth(*handler, &mut Vec::new(), &mut depths)?;
        }
        let indirect_calls = code.functions.values().map(|function| function.indirect).sum();
        Ok(Self { main, start, handlers, indirect_calls, deepest: code.deepest(reset, &depths) })
    }
}

/// Names of functions in an image.
///
/// # Errors
/// [`StackError::Format`].
pub fn functions(elf: &[u8]) -> Result<Vec<String>, StackError> {
    Ok(Code::read(elf)?.functions.into_values().map(|function| function.name).collect())
}

#[derive(Debug)]
struct Function {
    name: String,
    own: u32,
    calls: BTreeSet<u32>,
    indirect: usize,
}

struct Code {
    /// By address.
    functions: BTreeMap<u32, Function>,
    /// Functions whose address is a value somewhere.
    taken: BTreeSet<u32>,
    /// Functions in the vector table.
    handlers: BTreeSet<u32>,
}

impl Code {
    fn read(elf: &[u8]) -> Result<Self, StackError> {
        let format = |error: object::Error| StackError::Format(error.to_string());
        let file = object::File::parse(elf).map_err(format)?;
        let mut ranges = BTreeMap::new();
        // Where code and data begin inside a section (AAELF32 5.5.5).
        let mut mapping = BTreeMap::new();
        for symbol in file.symbols() {
            let (name, address) = (symbol.name().map_err(format)?, symbol.address() as u32);
            if name.starts_with("$t") || name.starts_with("$d") {
                mapping.insert(address, name.starts_with("$d"));
            } else if symbol.kind() == SymbolKind::Text && symbol.size() > 0 {
                ranges.entry(address & !1).or_insert((symbol.size() as u32, demangle(name)));
            }
        }
        let mut code = Self { functions: BTreeMap::new(), taken: BTreeSet::new(), handlers: BTreeSet::new() };
        let is_data = |at: u32| mapping.range(..=at).next_back().is_some_and(|(_, data)| *data);
        for section in file.sections() {
            let (start, bytes) = (section.address() as u32, section.data().map_err(format)?);
            let words = || bytes.as_chunks::<4>().0.iter().map(|word| u32::from_le_bytes(*word));
            let begins =
                |value: u32| (value & 1 == 1 && ranges.contains_key(&(value - 1))).then(|| value - 1);
            match section.name() {
                Ok(".vector_table") => code.handlers.extend(words().filter_map(begins)),
                Ok(".rodata" | ".data") => code.taken.extend(words().filter_map(begins)),
                Ok(".text") => {
                    let data = (start..).step_by(4).zip(words()).filter(|(at, _)| is_data(*at));
                    code.taken.extend(data.filter_map(|(_, value)| begins(value)));
                    for (address, (size, name)) in &ranges {
                        let Some(body) = address
                            .checked_sub(start)
                            .and_then(|offset| bytes.get(offset as usize..(offset + size) as usize))
                        else {
                            continue;
                        };
                        let function = code.function(name, *address, body, is_data, begins)?;
                        code.functions.insert(*address, function);
                    }
                }
                _ => {}
            }
        }
        Ok(code)
    }

    /// Reads one function's instructions, one after the other.
    fn function(
        &mut self,
        name: &str,
        address: u32,
        body: &[u8],
        is_data: impl Fn(u32) -> bool,
        begins: impl Fn(u32) -> Option<u32>,
    ) -> Result<Function, StackError> {
        let mut function = Function { name: name.to_owned(), own: 0, calls: BTreeSet::new(), indirect: 0 };
        let end = address + body.len() as u32;
        let halfword = |at: u32| {
            let bytes = body.get((at - address) as usize..)?.first_chunk::<2>()?;
            Some(u16::from_le_bytes(*bytes))
        };
        let (mut at, mut low) = (address, [0u32; 16]);
        while let Some(first) = halfword(at) {
            if is_data(at) {
                at += 2;
                continue;
            }
            let second = thumb::is_wide(first).then(|| halfword(at + 2)).flatten();
            match thumb::effect(first, second, at) {
                Effect::None => {}
                Effect::Push(bytes) => function.own += bytes,
                Effect::Dynamic => return Err(StackError::Dynamic { function: function.name, address: at }),
                Effect::Indirect => function.indirect += 1,
                // Inside, a branch is a loop or a condition; to the outside, a call at the end.
                Effect::Branch(target) if (address..end).contains(&target) => {}
                Effect::Call(target) | Effect::Branch(target) => {
                    function.calls.insert(target);
                }
                Effect::MoveLow { register, value } => low[usize::from(register)] = value,
                Effect::MoveHigh { register, value } => {
                    self.taken.extend(begins(low[usize::from(register)] | value << 16));
                }
            }
            at += if second.is_some() { 4 } else { 2 };
        }
        Ok(function)
    }

    fn named(&self, name: &str) -> Option<u32> {
        self.functions.iter().find(|(_, function)| function.name == name).map(|(address, _)| *address)
    }

    /// What is left of a function that runs with interrupts off when they come on: its frame.
    fn masked(&self) -> HashMap<u32, u32> {
        let masked = |function: &Function| function.name.ends_with(MASKED);
        self.functions.iter().filter(|(_, f)| masked(f)).map(|(address, f)| (*address, f.own)).collect()
    }

    /// Where a function's calls can go.
    fn targets<'a>(&'a self, function: &'a Function) -> impl Iterator<Item = u32> + 'a {
        let indirect = if function.indirect > 0 { Some(&self.taken) } else { None };
        function.calls.iter().chain(indirect.into_iter().flatten()).copied()
    }

    fn depth(
        &self,
        address: u32,
        way: &mut Vec<u32>,
        depths: &mut HashMap<u32, u32>,
    ) -> Result<u32, StackError> {
        if let Some(depth) = depths.get(&address) {
            return Ok(*depth);
        }
        let name =
            |address: &u32| self.functions.get(address).map_or("?", |function| &function.name).to_owned();
        if let Some(first) = way.iter().position(|earlier| *earlier == address) {
            return Err(StackError::Recursion(way[first..].iter().chain([&address]).map(name).collect()));
        }
        let Some(function) = self.functions.get(&address) else {
            let function = way.last().map(name).unwrap_or_default();
            return Err(StackError::Target { function, target: address });
        };
        way.push(address);
        let mut deepest = 0;
        for target in self.targets(function) {
            deepest = deepest.max(self.depth(target, way, depths)?);
        }
        way.pop();
        let depth = function.own + deepest;
        depths.insert(address, depth);
        Ok(depth)
    }

    fn deepest(&self, from: u32, depths: &HashMap<u32, u32>) -> Vec<(String, u32)> {
        let mut way = Vec::new();
        let mut next = self.functions.get(&from);
        while let Some(function) = next {
            way.push((function.name.clone(), function.own));
            let deepest = self.targets(function).max_by_key(|target| depths.get(target).copied());
            next = deepest.and_then(|target| self.functions.get(&target));
        }
        way
    }
}

/// The path of a Rust name in the legacy mangling (`_ZN`, then each part behind its length),
/// without the hash at its end; any other name as it is.
fn demangle(name: &str) -> String {
    let Some(mut rest) = name.strip_prefix("_ZN") else { return name.to_owned() };
    let mut parts = Vec::new();
    while let Some(digits) = rest.find(|c: char| !c.is_ascii_digit()).filter(|digits| *digits > 0) {
        let (len, tail) = rest.split_at(digits);
        let Some((part, tail)) = len.parse().ok().and_then(|len: usize| tail.split_at_checked(len)) else {
            return name.to_owned();
        };
        parts.push(part);
        rest = tail;
    }
    parts.pop_if(|part| part.len() == 17 && part.starts_with('h'));
    parts.join("::")
}
