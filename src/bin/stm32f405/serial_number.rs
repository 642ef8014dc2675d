//! The unique device identifier: 96 bits in system memory that differ from chip to chip (RM0090 39.1).
#![allow(unsafe_code, reason = "memory at a fixed address; the block says why it is sound")]

/// Address of the first word of the identifier.
const ADDRESS: *const [u32; 3] = 0x1FFF_7A10 as *const [u32; 3];

pub fn read() -> [u8; 12] {
    // SAFETY: read-only memory of every STM32F405, on a word boundary.
    bytemuck::cast(unsafe { ADDRESS.read_volatile() })
}
