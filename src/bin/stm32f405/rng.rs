//! Random numbers from the chip's analogue noise (RNG, RM0090 24), clocked at 48 MHz from the PLL.
//!
//! A number is used only if the generator reports no error and the number differs from the previous one; the first
//! one after the start is not used (RM0090 24.3.1, FIPS 140-2).
#![allow(unsafe_code, reason = "a peripheral that nothing else uses; the block says so")]

use super::pac;

/// Polls before a number times out: several times the 40 periods of 48 MHz that it takes.
const POLLS: u32 = 2_000;

/// Returns random bytes; `None` where the generator or its clock fails.
#[inline(never)]
pub fn bytes() -> Option<[u8; 32]> {
    // SAFETY: idle alone calls this, and no other code uses RNG.
    let rng = unsafe { pac::RNG::steal() };
    // Enabling the generator gives it a new seed; the flags of an earlier failure are cleared first.
    rng.sr().write(|w| w.seis().clear_bit().ceis().clear_bit());
    rng.cr().write(|w| w.rngen().set_bit());
    let bytes = draw(&rng);
    rng.cr().write(|w| w.rngen().clear_bit());
    bytes
}

fn draw(rng: &pac::RNG) -> Option<[u8; 32]> {
    let mut last = number(rng)?;
    let mut bytes = [0; 32];
    for word in bytes.as_chunks_mut::<4>().0 {
        let number = number(rng)?;
        if number == last {
            return None;
        }
        last = number;
        *word = number.to_le_bytes();
    }
    Some(bytes)
}

/// Waits for a number, for [`POLLS`] polls at most.
fn number(rng: &pac::RNG) -> Option<u32> {
    for _ in 0..POLLS {
        let status = rng.sr().read();
        if status.seis().bit() || status.ceis().bit() || status.secs().bit() || status.cecs().bit() {
            return None;
        }
        if status.drdy().bit() {
            return Some(rng.dr().read().bits());
        }
    }
    None
}
