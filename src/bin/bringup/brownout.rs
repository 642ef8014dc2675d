//! Handles the brown-out reset's level, an option byte (RM0090 3.6, 3.9.6).
//!
//! Below the level the chip is held in reset, so no code runs and no flash is programmed while the supply is too low.
//! A new chip has the lowest level, 1.8 V. The option byte is loaded at power-on.
#![allow(unsafe_code, reason = "raw register values; each block says why it is sound")]

use crate::stm32f405::{flash::FlashError, pac, supply, wait_until};

const KEYS: [u32; 2] = [0x0819_2A3B, 0x4C5D_6E7F];
/// BOR_LEV = 00: level 3, 2.75 to 2.90 V falling (DS8626 table 21).
const LEVEL_3: u8 = 0b00;
/// Polls before programming the option bytes times out; it takes as long as an erase of 16 KiB.
const POLLS: u32 = 20_000_000;

pub fn is_level_3(flash: &pac::FLASH) -> bool {
    flash.optcr().read().bor_lev().bits() == LEVEL_3
}

/// Programs level 3, which takes effect at the next power-on.
///
/// # Errors
/// [`FlashError`] if the controller refuses the change or does not finish it, or level 3 does not read back.
pub fn set_level_3(flash: &pac::FLASH) -> Result<(), FlashError> {
    if supply::is_low() {
        return Err(FlashError::SupplyLow);
    }
    for key in KEYS {
        // SAFETY: the two keys, in order (RM0090 3.9.3).
        flash.optkeyr().write(|w| unsafe { w.bits(key) });
    }
    if flash.optcr().read().optlock().bit_is_set() {
        return Err(FlashError::Locked);
    }
    // SAFETY: one of the four levels; the other options keep their values.
    flash.optcr().modify(|_, w| unsafe { w.bor_lev().bits(LEVEL_3) });
    flash.optcr().modify(|_, w| w.optstrt().set_bit());
    let done = wait_until(POLLS, || flash.sr().read().bsy().bit_is_clear());
    flash.optcr().modify(|_, w| w.optlock().set_bit());
    if !done {
        Err(FlashError::Busy)
    } else if is_level_3(flash) {
        Ok(())
    } else {
        Err(FlashError::NotVerified(0))
    }
}
