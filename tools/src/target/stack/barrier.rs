//! Checks that no interrupt handler returns before its own stores are complete.
//!
//! Otherwise a Cortex-M4 can take the wrong vector next (Arm erratum 838869). A `DSB` after the last store prevents
//! this. Between the `DSB` and the return there may be only instructions that do not store, and no branch may enter
//! this range from elsewhere.

use super::StackError;
use super::code::Code;
use super::thumb::{self, Effect};
use std::collections::BTreeSet;

/// Depth to which calls are followed: a handler, its task, and the calls at the task's end.
const DEPTH: usize = 4;
/// The encoding of `DSB SY`.
const DSB: (u16, Option<u16>) = (0xF3BF, Some(0x8F4F));

/// Returns the names of those of the given exceptions' handlers that can return after a store without a barrier.
pub fn handlers_without_barrier(elf: &[u8], exceptions: &[usize]) -> Result<Vec<String>, StackError> {
    let code = Code::read(elf)?;
    let mut without = Vec::new();
    for number in exceptions {
        let address = code.vectors.handlers.get(*number).copied().flatten();
        let handler = address.and_then(|address| Some((address, code.functions.get(&address)?)));
        let Some((address, function)) = handler else {
            return Err(StackError::Format(format!("exception {number} has no handler")));
        };
        if !ends_with_barrier(&code, address, DEPTH) {
            without.push(function.name.clone());
        }
    }
    Ok(without)
}

fn ends_with_barrier(code: &Code, start: u32, depth: usize) -> bool {
    let (Some(function), Some(depth)) = (code.functions.get(&start), depth.checked_sub(1)) else {
        return false;
    };
    let end = start + function.size;
    // `barrier`: the last barrier, if no store followed. `endings`: the ranges from a barrier to a return. `targets`:
    // the targets of branches.
    let (mut barrier, mut endings, mut targets) = (None, Vec::new(), BTreeSet::new());
    for (at, first, second) in function.instructions.iter().copied() {
        match thumb::effect(first, second, at) {
            _ if (first, second) == DSB => barrier = Some(at),
            _ if returns(first, second) => match barrier.take() {
                Some(barrier) => endings.push((barrier, at)),
                None => return false,
            },
            Effect::Call(target) => barrier = ends_with_barrier(code, target, depth).then_some(at),
            Effect::Branch(target) if (start..end).contains(&target) => {
                targets.insert(target);
                barrier = None;
            }
            Effect::Branch(target) => {
                if !ends_with_barrier(code, target, depth) {
                    return false;
                }
                barrier = None;
            }
            Effect::Indirect { .. } | Effect::Loaded => return false,
            _ if stores_nothing(first, second) => {}
            _ => barrier = None,
        }
    }
    endings.iter().all(|(barrier, end)| targets.range(barrier + 1..=*end).next().is_none())
}

/// Returns whether an instruction is a return: `BX lr`, `POP {..., pc}`, `LDR pc, [sp], #4`.
fn returns(first: u16, second: Option<u16>) -> bool {
    match second {
        None => first == 0x4770 || first & 0xFF00 == 0xBD00,
        Some(second) => first == 0xE8BD && second & 0x8000 != 0 || (first, second) == (0xF85D, 0xFB04),
    }
}

/// Returns whether an instruction is known not to store. Only those are known that compilers emit between a barrier
/// and a return; any other counts as a store.
fn stores_nothing(first: u16, second: Option<u16>) -> bool {
    match second {
        // NOP; POP; ADD sp, #imm; MOVS Rd, #imm; MOV Rd, Rm; LDR Rt, [sp, #imm]
        None => {
            first == 0xBF00
                || first & 0xFF00 == 0xBC00
                || first & 0xFF80 == 0xB000
                || first & 0xF800 == 0x2000
                || first & 0xFF00 == 0x4600
                || first & 0xF800 == 0x9800
        }
        // MSR; POP.W; LDR Rt, [sp], #4; ISB
        Some(second) => {
            first & 0xFFF0 == 0xF380 && second & 0xFF00 == 0x8800
                || first == 0xE8BD
                || first == 0xF85D && second & 0x0FFF == 0x0B04
                || (first, second) == (0xF3BF, 0x8F6F)
        }
    }
}
