//! Random numbers from the chip's noise sources (RNG), clocked by the HSI48, in the configuration that ST has certified (the
//! values are those of stm32h563xx.h). A number is used only if the generator reports no error and it differs from the last one.

use embassy_stm32::pac::{RNG, rng::regs};
use embassy_stm32::{peripherals, rcc};
use embassy_time::{Duration, Instant};

const CONFIGURATION: regs::Cr = regs::Cr(0x00F0_0E00);
const HEALTH_TESTS: regs::Htcr = regs::Htcr(0x6A91);
const NOISE_SOURCES: u32 = 0x3_AF66;
/// A number, and no error.
const READY: regs::Sr = regs::Sr(1);
/// Longest wait for a conditioning reset, and for a number; each takes some ten microseconds.
const LONGEST: Duration = Duration::from_millis(1);

/// Returns random bytes; `None` where the generator or its clock fails.
pub fn bytes() -> Option<[u8; 32]> {
    // The reset clears the errors of an earlier call.
    rcc::enable_and_reset::<peripherals::RNG>();
    let bytes = start().and_then(|()| draw());
    rcc::disable::<peripherals::RNG>();
    bytes
}

fn start() -> Option<()> {
    // The configuration can be written while CONDRST is set, and in the access that sets it.
    RNG.cr().write(|w| {
        *w = CONFIGURATION;
        w.set_condrst(true);
    });
    RNG.htcr().write_value(HEALTH_TESTS);
    // SAFETY: NSCR, which the crate's registers lack, is the fourth word of the RNG, whose clock runs.
    unsafe { RNG.as_ptr().cast::<u32>().add(3).write_volatile(NOISE_SOURCES) };
    RNG.cr().modify(|w| w.set_condrst(false));
    within(|| (!RNG.cr().read().condrst()).then_some(()))?;
    RNG.cr().modify(|w| w.set_rngen(true));
    Some(())
}

fn draw() -> Option<[u8; 32]> {
    let mut last = number()?;
    let mut bytes = [0; 32];
    for word in bytes.as_chunks_mut::<4>().0 {
        let number = number().filter(|number| *number != last)?;
        last = number;
        *word = number.to_le_bytes();
    }
    Some(bytes)
}

/// Returns a number; it is 0 if an error came just before it was read.
fn number() -> Option<u32> {
    let status = within(|| Some(RNG.sr().read()).filter(|status| status.0 != 0))?;
    (status == READY).then(|| RNG.dr().read()).filter(|number| *number != 0)
}

/// Reads until there is a value, for [`LONGEST`] at most.
fn within<T>(mut read: impl FnMut() -> Option<T>) -> Option<T> {
    let start = Instant::now();
    loop {
        let found = read();
        if found.is_some() || start.elapsed() > LONGEST {
            return found;
        }
    }
}
