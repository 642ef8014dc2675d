//! Reads the flash and RAM of a firmware image from its ELF file.

use object::{Object, ObjectSection, ObjectSymbol};

/// Budgets of an image, bytes: flash (sectors 8 and 9), static RAM, stack.
pub const BUDGETS: [u64; 3] = [256 << 10, 96 << 10, 13 << 10];

/// Holds the sizes of one image, bytes.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct ImageSize {
    /// Flash: vectors, code, constants and the initial values of data.
    pub flash: u64,
    /// Size of the two assembly kernels, which is part of `flash`.
    pub kernels: u64,
    /// Statics in SRAM, and the code that runs from SRAM.
    pub static_ram: u64,
    pub ccm: u64,
}

impl ImageSize {
    pub fn read(elf: &[u8]) -> object::Result<Self> {
        let file = object::File::parse(elf)?;
        let mut size = Self::default();
        for section in file.sections() {
            match section.name() {
                Ok(".vector_table" | ".text" | ".rodata") => size.flash += section.size(),
                Ok(".data" | ".ram_code") => {
                    size.flash += section.size();
                    size.static_ram += section.size();
                }
                Ok(".bss" | ".uninit") => size.static_ram += section.size(),
                Ok(".ccm") => size.ccm += section.size(),
                _ => {}
            }
        }
        size.kernels = file
            .symbols()
            .filter(|symbol| {
                symbol
                    .name()
                    .is_ok_and(|name| name.contains("project_kernel") || name.contains("step_kernel"))
            })
            .map(|symbol| symbol.size())
            .sum();
        Ok(size)
    }
}
