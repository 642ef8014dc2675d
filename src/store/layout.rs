//! This module defines the flash layout of an STM32F405xG (RM0090 table 5): 1 MiB, twelve sectors.
//!
//! | sectors | size | content |
//! |---|---|---|
//! | 0 | 16 KiB | vector table |
//! | 1, 2 | 2 x 16 KiB | records ([`STORE`]) |
//! | 3 to 7 | 16 + 64 + 3 x 128 KiB | FoGNet's weight file ([`FOGNET`]) |
//! | 8, 9 | 2 x 128 KiB | code and constants, GyroNet's built-in weights among them |
//! | 10, 11 | 2 x 128 KiB | GyroNet's weight slots ([`SLOTS`]) |
//!
//! Records need small sectors of equal size, and the processor needs its vectors in sector 0. FoGNet's file has 393
//! KiB, so there is room for only one: while a new file is uploaded, the gyro is corrected without a network. The
//! image's `regions.x` and `slots.x` give the linker the same layout, and a test compares them.

use core::ops::Range;

/// Address of the flash in the memory map.
pub const FLASH_BASE: u32 = 0x0800_0000;
/// Size of each sector, bytes.
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
/// Size of a sector of records, bytes.
pub const RECORD_SECTOR: usize = 16 << 10;
/// Flash offsets of the records.
pub const STORE: Range<u32> = 0x4000..0xC000;
/// Flash offsets of FoGNet's weight file.
pub const FOGNET: Range<u32> = 0xC000..0x8_0000;
/// Flash offset of the code.
pub const CODE: u32 = 0x8_0000;
/// Flash offset of the end of the code.
pub const CODE_END: u32 = 0xC_0000;
/// Size of a weight slot, one sector, bytes.
pub const SLOT_SIZE: usize = 128 << 10;
/// Flash offsets of both weight slots.
pub const SLOTS: Range<u32> = 0xC_0000..0x10_0000;

/// Returns the number of the sector that begins at `offset`; `None` if none does.
#[must_use]
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
#[must_use]
pub fn sector(offset: u32) -> Option<Range<u32>> {
    let size = SECTORS.get(usize::from(sector_at(offset)?))?;
    Some(offset..offset + size)
}
