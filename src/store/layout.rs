//! Flash layout of an STM32F405xG (RM0090 table 5): 1 MiB, twelve sectors.
//!
//! | sectors | size | content |
//! |---|---|---|
//! | 0 | 16 KiB | boot loader |
//! | 1, 2 | 2 x 16 KiB | records ([`STORE`]): configuration, keys, calibration, what was learnt, troubles |
//! | 3 to 5 | 16 + 64 + 128 KiB | not used |
//! | 6, 7 | 2 x 128 KiB | firmware, slot B ([`FIRMWARE_B`]) |
//! | 8, 9 | 2 x 128 KiB | firmware, slot A ([`FIRMWARE_A`]): vectors, code, constants, the built-in weights |
//! | 10, 11 | 2 x 128 KiB | GyroNet's weight slots ([`SLOTS`]) |
//!
//! Records need small sectors of equal size, and the processor begins in sector 0. `regions.x` and `slots.x` give the
//! linker the same layout, and a test compares them.

use core::ops::Range;

pub const FLASH_BASE: u32 = 0x0800_0000;
pub const SECTORS: [u32; 12] = {
    let mut sizes = [128 << 10; 12];
    let mut k = 0;
    while k < 4 {
        sizes[k] = 16 << 10;
        k += 1;
    }
    sizes[4] = 64 << 10;
    sizes
};
/// Version of this layout. An image that expects another one is not accepted as an update.
pub const LAYOUT: u8 = 1;
pub const BOOT_SIZE: u32 = 16 << 10;
pub const RECORD_SECTOR: usize = 16 << 10;
pub const STORE: Range<u32> = 0x4000..0xC000;
pub const FIRMWARE_SIZE: u32 = 256 << 10;
pub const FIRMWARE_B: Range<u32> = 0x4_0000..0x4_0000 + FIRMWARE_SIZE;
/// Flash offsets of firmware in slot A, which `cargo flash-board` writes.
pub const FIRMWARE_A: Range<u32> = FIRMWARE_B.end..FIRMWARE_B.end + FIRMWARE_SIZE;
pub const SLOT_SIZE: usize = 128 << 10;
pub const SLOTS: Range<u32> = FIRMWARE_A.end..0x10_0000;

/// Returns the number of the sector that begins at `offset`; `None` if none does.
pub fn sector_at(offset: u32) -> Option<u8> {
    let mut start = 0;
    for (number, size) in (0u8..).zip(SECTORS) {
        if start == offset {
            return Some(number);
        }
        start += size;
    }
    None
}

/// Returns the range of the sector that begins at `offset`; `None` if none does.
pub fn sector(offset: u32) -> Option<Range<u32>> {
    let size = SECTORS.get(usize::from(sector_at(offset)?))?;
    Some(offset..offset + size)
}
