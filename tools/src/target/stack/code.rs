//! Reads the functions of an image, with the stack use and the calls of each.

use super::priority::{self, Vectors};
use super::thumb::{self, Effect};
use super::{MASKED, StackError};
use object::{Object, ObjectSection, ObjectSymbol, SymbolKind};
use std::collections::{BTreeMap, BTreeSet, HashMap};

#[derive(Debug)]
pub struct Function {
    pub name: String,
    own: u32,
    calls: BTreeSet<u32>,
    pub indirect: usize,
}

#[derive(Debug, Default)]
pub struct Code {
    pub functions: BTreeMap<u32, Function>,
    taken: BTreeSet<u32>,
    pub vectors: Vectors,
}

impl Code {
    pub fn read(elf: &[u8]) -> Result<Self, StackError> {
        let format = |error: object::Error| StackError::Format(error.to_string());
        let file = object::File::parse(elf).map_err(format)?;
        let mut ranges = BTreeMap::new();
        // Mapping symbols show where code and data begin inside a section (AAELF32 5.5.5).
        let mut mapping = BTreeMap::new();
        for symbol in file.symbols() {
            let (name, address) = (symbol.name().map_err(format)?, symbol.address() as u32);
            if name.starts_with("$t") || name.starts_with("$d") {
                mapping.insert(address, name.starts_with("$d"));
            } else if symbol.kind() == SymbolKind::Text && (symbol.size() > 0 || symbol.is_global()) {
                let name = format!("{:#}", rustc_demangle::demangle(name));
                let range = (symbol.size() as u32, name);
                let known = ranges.entry(address & !1).or_insert_with(|| range.clone());
                // If an address has two names, the one with a size counts.
                if known.0 == 0 {
                    *known = range;
                }
            }
        }
        // An assembly function without a size ends where the next function begins.
        let begins: Vec<u32> = ranges.keys().copied().collect();
        for pair in begins.windows(2) {
            if let [address, next] = *pair
                && let Some(range) = ranges.get_mut(&address).filter(|range| range.0 == 0)
            {
                range.0 = next - address;
            }
        }
        ranges.retain(|_, (size, _)| *size > 0);
        let mut code = Self::default();
        let is_data = |at: u32| mapping.range(..=at).next_back().is_some_and(|(_, data)| *data);
        for section in file.sections() {
            let (start, bytes) = (section.address() as u32, section.data().map_err(format)?);
            let words = || bytes.as_chunks::<4>().0.iter().map(|word| u32::from_le_bytes(*word));
            let begins =
                |value: u32| (value & 1 == 1 && ranges.contains_key(&(value - 1))).then(|| value - 1);
            match section.name() {
                Ok(".vector_table") => code.vectors.handlers = words().map(begins).collect(),
                Ok(priority::SECTION) => code.vectors.prioritise(bytes)?,
                Ok(".rodata" | ".data") => code.taken.extend(words().filter_map(begins)),
                Ok(".text" | ".ram_code") => {
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
        let (mut low, mut aligned) = ([0u32; 16], [0u32; 16]);
        // Register and function address that the previous instruction has completed. The linker's veneers from flash
        // to RAM jump to it immediately, which is a call. Any other use takes the address.
        let mut made: Option<(u8, u32)> = None;
        for (at, first, second) in thumb::instructions(body, address, is_data) {
            let effect = thumb::effect(first, second, at);
            match (made.take(), effect) {
                (Some((register, target)), Effect::Indirect(to)) if register == to => {
                    function.calls.insert(target);
                    continue;
                }
                (Some((_, target)), _) => {
                    self.taken.insert(target);
                }
                (None, _) => {}
            }
            match effect {
                Effect::None => {}
                Effect::Push(bytes) => function.own += bytes,
                Effect::Align(register, bytes) => aligned[usize::from(register)] = bytes,
                // A rounded register aligns the frame on a larger boundary; any other register restores the stack.
                Effect::MoveSp(register) => {
                    function.own += std::mem::take(&mut aligned[usize::from(register)]);
                }
                Effect::Dynamic => return Err(StackError::Dynamic { function: function.name, address: at }),
                Effect::Indirect(_) | Effect::Loaded => function.indirect += 1,
                // A branch inside the function is a loop or a condition; a branch to the outside is a tail call.
                Effect::Branch(target) if (address..end).contains(&target) => {}
                Effect::Call(target) | Effect::Branch(target) => {
                    function.calls.insert(target);
                }
                Effect::MoveLow(register, value) => low[usize::from(register)] = value,
                Effect::MoveHigh(register, value) => {
                    let target = begins(low[usize::from(register)] | value << 16);
                    made = target.map(|target| (register, target));
                }
            }
        }
        self.taken.extend(made.map(|(_, target)| target));
        Ok(function)
    }

    pub fn named(&self, name: &str) -> Option<u32> {
        self.functions.iter().find(|(_, function)| function.name == name).map(|(address, _)| *address)
    }

    /// Returns, for the function that runs with interrupts off, the frame that remains when interrupts are switched
    /// on.
    pub fn masked(&self) -> HashMap<u32, u32> {
        let masked = |function: &Function| function.name.ends_with(MASKED);
        self.functions.iter().filter(|(_, f)| masked(f)).map(|(address, f)| (*address, f.own)).collect()
    }

    fn targets<'a>(&'a self, function: &'a Function) -> impl Iterator<Item = u32> + 'a {
        let indirect = if function.indirect > 0 { Some(&self.taken) } else { None };
        function.calls.iter().chain(indirect.into_iter().flatten()).copied()
    }

    pub fn depth(
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

    pub fn deepest(&self, from: u32, depths: &HashMap<u32, u32>) -> Vec<(String, u32)> {
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
