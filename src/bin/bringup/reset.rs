//! Check of the watchdog: it must reset a chip that does not feed it, within the tolerance of the limit.
//!
//! The results of the first start are kept in RAM that a reset does not clear.
#![allow(unsafe_code, reason = "memory without a value at the start; each block says why it is sound")]

use crate::report::Report;
use crate::stm32f405::{timer, watchdog};
use core::mem::MaybeUninit;
use core::ptr::{addr_of_mut, read_volatile, write_volatile};
use gyronet::service::event::ResetCause;

/// Marks [`WAIT`] as valid: the image was waiting for the watchdog.
const WAITING: u32 = 0xB0A2_D06E;
/// Accepted times until the reset, us: 100 ms at 47 and 17 kHz, plus the time until the new limit takes effect.
const LIMITS_US: core::ops::RangeInclusive<u32> = 60_000..=200_000;
/// Bits of the second word that hold the time; the number of failed checks is in the bits above.
const TIME_BITS: u32 = 24;

#[unsafe(link_section = ".uninit.bringup")]
static mut WAIT: MaybeUninit<[u32; 2]> = MaybeUninit::uninit();

fn write(words: [u32; 2]) {
    // SAFETY: nothing else uses `WAIT`, and there are no interrupts.
    unsafe { write_volatile(addr_of_mut!(WAIT).cast(), words) };
}

/// Returns the time that the chip waited for the watchdog before this start, us, with the number of failed checks in
/// the upper bits; `None` at the first start.
pub fn elapsed(cause: ResetCause) -> Option<u32> {
    // SAFETY: any bits are words; see `write`.
    let [mark, elapsed] = unsafe { read_volatile(addr_of_mut!(WAIT).cast::<[u32; 2]>()) };
    write([0; 2]);
    // After a reset with another cause, the image runs all checks again.
    (mark == WAITING && matches!(cause, ResetCause::Watchdog)).then_some(elapsed)
}

pub fn report_result(report: &mut Report, elapsed: u32) {
    let (us, failed) = (elapsed & ((1 << TIME_BITS) - 1), elapsed >> TIME_BITS);
    if LIMITS_US.contains(&us) {
        report.pass("watchdog", format_args!("reset the chip after {} ms (60 to 200)", us / 1_000));
    } else {
        report.fail("watchdog", format_args!("reset the chip after {} ms, not 60 to 200", us / 1_000));
    }
    let failed = failed + report.failed();
    report.print(format_args!("{failed} checks failed"));
}

pub fn wait_for_watchdog(report: &mut Report) -> ! {
    report.print(format_args!("watchdog     ...   the chip resets now"));
    // The watchdog has an oscillator of its own: its limit is checked whatever clock the processor has.
    watchdog::follow(true);
    watchdog::set(watchdog::Limit::Short);
    let (begin, failed) = (timer::micros(), report.failed() << TIME_BITS);
    loop {
        let us = (timer::micros() - begin) as u32;
        if us >= 1 << (TIME_BITS - 1) {
            write([0; 2]);
            report.fail("watchdog", format_args!("the chip does not reset"));
            report.end();
        }
        write([WAITING, us | failed]);
    }
}
