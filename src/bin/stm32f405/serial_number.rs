//! The unique device identifier: 96 bits in system memory that differ from chip to chip (RM0090 39.1).
#![allow(unsafe_code, reason = "memory at a fixed address; the block says why it is sound")]

/// The address of its first word.
const ADDRESS: *const [u32; 3] = 0x1FFF_7A10 as *const [u32; 3];

/// Reads it, as it lies in memory.
pub fn read() -> [u8; 12] {
    // SAFETY: read-only memory of every STM32F405, on a word boundary.
    bytemuck::cast(unsafe { ADDRESS.read_volatile() })
}
