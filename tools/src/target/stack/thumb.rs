//! Decodes the effect of a Thumb-2 instruction on the stack pointer and on the control flow.
//!
//! Only instructions that affect one of them are decoded (ARMv7-M Architecture Reference Manual, A7.7); all others
//! are [`Effect::None`].

/// The number of a register.
type Register = u8;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Effect {
    /// The instruction affects neither the stack pointer nor the control flow.
    None,
    /// The stack grows by this many bytes.
    Push(u32),
    /// The stack grows by a register's value.
    Dynamic,
    /// A register is rounded down by less than so many bytes; it may become the stack pointer.
    Align(Register, u32),
    /// A register becomes the stack pointer.
    MoveSp(Register),
    Call(u32),
    Branch(u32),
    /// A call or jump to a register's value.
    Indirect(Register),
    /// A jump to an address that is loaded from memory.
    Loaded,
    /// The lower half of a register is set to a value.
    MoveLow(Register, u32),
    /// The upper half of a register is set to a value; the lower half is unchanged.
    MoveHigh(Register, u32),
}

const SP: u16 = 13;
const PC: u16 = 15;

/// Returns whether an instruction that begins with this halfword has a second one.
pub const fn is_wide(first: u16) -> bool {
    first >> 11 >= 0b11101
}

/// An instruction: its address, its first halfword and, if it is wide, its second one.
pub type Instruction = (u32, u16, Option<u16>);

/// Returns the instructions of a function that begins at `start`, without the data between them.
pub fn instructions(body: &[u8], start: u32, is_data: impl Fn(u32) -> bool) -> Vec<Instruction> {
    let halfword = |at: u32| {
        let bytes = body.get((at - start) as usize..)?.first_chunk()?;
        Some(u16::from_le_bytes(*bytes))
    };
    let (mut at, mut instructions) = (start, Vec::new());
    while let Some(first) = halfword(at) {
        if is_data(at) {
            at += 2;
            continue;
        }
        let second = is_wide(first).then(|| halfword(at + 2)).flatten();
        instructions.push((at, first, second));
        at += if second.is_some() { 4 } else { 2 };
    }
    instructions
}

pub fn effect(first: u16, second: Option<u16>, address: u32) -> Effect {
    match second {
        Some(second) => wide(first, second, address),
        None => narrow(first, address),
    }
}

fn narrow(code: u16, address: u32) -> Effect {
    let branch = |offset: i32| Effect::Branch(address.wrapping_add(4).wrapping_add_signed(offset));
    match code {
        // PUSH {low registers, lr}
        _ if code & 0xFE00 == 0xB400 => Effect::Push(4 * (code & 0x1FF).count_ones()),
        // SUB sp, #imm7 * 4
        _ if code & 0xFF80 == 0xB080 => Effect::Push(4 * u32::from(code & 0x7F)),
        // MOV sp, Rm
        _ if code & 0xFF87 == 0x4685 => Effect::MoveSp((code >> 3 & 0xF) as u8),
        // BLX Rm
        _ if code & 0xFF87 == 0x4780 => Effect::Indirect((code >> 3 & 0xF) as u8),
        // BX Rm; BX lr returns
        _ if code & 0xFF87 == 0x4700 && code != 0x4770 => Effect::Indirect((code >> 3 & 0xF) as u8),
        // B; UDF and SVC have the condition codes 0xE and 0xF.
        _ if code & 0xF800 == 0xE000 => branch(sign(u32::from(code & 0x7FF) << 1, 12)),
        _ if code & 0xF000 == 0xD000 && code >> 8 & 0xF < 0xE => branch(sign(u32::from(code & 0xFF) << 1, 9)),
        _ => Effect::None,
    }
}

fn wide(first: u16, second: u16, address: u32) -> Effect {
    let (rn, rd, rt) = (first & 0xF, second >> 8 & 0xF, second >> 12);
    let branch = |offset: i32| address.wrapping_add(4).wrapping_add_signed(offset);
    match (first, second) {
        // STMDB sp!, PUSH.W
        (0xE92D, _) => Effect::Push(4 * second.count_ones()),
        // STR Rt, [sp, #-imm8]!
        (0xF84D, _) if second & 0x0F00 == 0x0D00 => Effect::Push(u32::from(second & 0xFF)),
        // STRD [sp, #-imm8 * 4]!
        (0xE96D, _) => Effect::Push(4 * u32::from(second & 0xFF)),
        // VPUSH: imm8 words, single or double
        _ if first & 0xFFBF == 0xED2D && second & 0x0E00 == 0x0A00 => {
            Effect::Push(4 * u32::from(second & 0xFF))
        }
        // SUB.W sp, sp, #const
        _ if first & 0xFBEF == 0xF1AD && second & 0x8F00 == 0x0D00 => Effect::Push(expand(first, second)),
        // SUBW sp, sp, #imm12
        _ if first & 0xFBFF == 0xF2AD && second & 0x8F00 == 0x0D00 => Effect::Push(imm12(first, second)),
        // SUB.W sp, sp, Rm
        _ if first & 0xFFEF == 0xEBAD && rd == SP => Effect::Dynamic,
        // BFC Rd, #0, #width
        (0xF36F, _) if second & 0x70C0 == 0 => Effect::Align(rd as u8, 1 << ((second & 0x1F) + 1).min(10)),
        // LDR pc, [Rn, ...]; from the stack it is a return
        _ if first & 0xFF70 == 0xF850 && rt == PC && rn != SP => Effect::Loaded,
        // BL, B.W
        _ if first & 0xF800 == 0xF000 && second & 0x9000 == 0x9000 => {
            let target = branch(long_offset(first, second));
            if second & 0x4000 == 0 { Effect::Branch(target) } else { Effect::Call(target) }
        }
        // B<c>.W
        _ if first & 0xF800 == 0xF000 && second & 0xD000 == 0x8000 && first >> 6 & 0xF < 0xE => {
            let bit = |value: u16, at: u32| u32::from(value >> at & 1);
            let offset = bit(first, 10) << 20
                | bit(second, 11) << 19
                | bit(second, 13) << 18
                | u32::from(first & 0x3F) << 12
                | u32::from(second & 0x7FF) << 1;
            Effect::Branch(branch(sign(offset, 21)))
        }
        // MOVW, MOVT
        _ if first & 0xFBF0 == 0xF240 && second & 0x8000 == 0 => {
            Effect::MoveLow(rd as u8, imm16(first, second))
        }
        _ if first & 0xFBF0 == 0xF2C0 && second & 0x8000 == 0 => {
            Effect::MoveHigh(rd as u8, imm16(first, second))
        }
        _ => Effect::None,
    }
}

fn sign(value: u32, bits: u32) -> i32 {
    (value << (32 - bits)) as i32 >> (32 - bits)
}

/// Returns the offset of BL and B.W (A7.7.12, encoding T4; A7.7.18).
fn long_offset(first: u16, second: u16) -> i32 {
    let s = u32::from(first >> 10 & 1);
    let inverted = |at: u32| (u32::from(second >> at & 1) ^ s) ^ 1;
    let offset = s << 24
        | inverted(13) << 23
        | inverted(11) << 22
        | u32::from(first & 0x3FF) << 12
        | u32::from(second & 0x7FF) << 1;
    sign(offset, 25)
}

fn imm12(first: u16, second: u16) -> u32 {
    u32::from(first >> 10 & 1) << 11 | u32::from(second >> 12 & 7) << 8 | u32::from(second & 0xFF)
}

fn imm16(first: u16, second: u16) -> u32 {
    u32::from(first & 0xF) << 12 | imm12(first, second)
}

/// Expands a constant as ThumbExpandImm does (A5.3.2).
fn expand(first: u16, second: u16) -> u32 {
    let code = imm12(first, second);
    let byte = code & 0xFF;
    match code >> 8 {
        0 => byte,
        1 => byte << 16 | byte,
        2 => byte << 24 | byte << 8,
        3 => byte << 24 | byte << 16 | byte << 8 | byte,
        _ => (byte & 0x7F | 0x80).rotate_right(code >> 7),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The expected instructions are those that llvm-objdump 14 prints.
    #[test]
    fn disassembled() {
        let wide = |first, second| effect(first, Some(second), 0x0801_0000);
        let narrow = |code| effect(code, None, 0x0801_0000);
        assert_eq!(narrow(0xB5F0), Effect::Push(20)); // push {r4, r5, r6, r7, lr}
        assert_eq!(narrow(0xB084), Effect::Push(16)); // sub sp, #16
        assert_eq!(narrow(0xB004), Effect::None); // add sp, #16
        assert_eq!(narrow(0x4798), Effect::Indirect(3)); // blx r3
        assert_eq!(narrow(0x4770), Effect::None); // bx lr
        assert_eq!(narrow(0x4760), Effect::Indirect(12)); // bx r12
        assert_eq!(narrow(0x46A5), Effect::MoveSp(4)); // mov sp, r4
        assert_eq!(wide(0xF36F, 0x0402), Effect::Align(4, 8)); // bfc r4, #0, #3
        assert_eq!(narrow(0xE7FE), Effect::Branch(0x0801_0000)); // b .
        assert_eq!(narrow(0xD1FC), Effect::Branch(0x0800_FFFC)); // bne .-4
        assert_eq!(narrow(0xDE00), Effect::None); // udf #0
        assert_eq!(wide(0xE92D, 0x4FF0), Effect::Push(36)); // push.w {r4-r11, lr}
        assert_eq!(wide(0xF84D, 0xBD04), Effect::Push(4)); // str r11, [sp, #-4]!
        assert_eq!(wide(0xED2D, 0x8B10), Effect::Push(64)); // vpush {d8-d15}
        assert_eq!(wide(0xF5AD, 0x5D80), Effect::Push(4096)); // sub.w sp, sp, #4096
        assert_eq!(wide(0xF5AD, 0x7D02), Effect::Push(520)); // sub.w sp, sp, #520
        assert_eq!(wide(0xF2AD, 0x4D04), Effect::Push(1028)); // subw sp, sp, #1028
        assert_eq!(wide(0xEBAD, 0x0D01), Effect::Dynamic); // sub.w sp, sp, r1
        assert_eq!(wide(0xF7FF, 0xFFFE), Effect::Call(0x0801_0000)); // bl .
        assert_eq!(wide(0xF000, 0xB800), Effect::Branch(0x0801_0004)); // b.w .+4
        assert_eq!(wide(0xF040, 0x8002), Effect::Branch(0x0801_0008)); // bne.w .+8
        assert_eq!(wide(0xF641, 0x2334), Effect::MoveLow(3, 0x1A34)); // movw r3
        assert_eq!(wide(0xF6C0, 0x0301), Effect::MoveHigh(3, 0x0801)); // movt r3
        assert_eq!(wide(0xF8D0, 0xF004), Effect::Loaded); // ldr.w pc, [r0, #4]
        assert_eq!(wide(0xF85D, 0xFB04), Effect::None); // ldr pc, [sp], #4
    }
}
