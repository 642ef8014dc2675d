//! The watchdog's check: the chip must reset when it is not fed, within the limit's tolerance.
//!
//! RAM that a reset does not clear keeps the results of the first start.
#![allow(unsafe_code, reason = "memory without a value at the start; each block says why it is sound")]

use crate::report::Report;
use crate::stm32f405::{timer, watchdog};
use core::mem::MaybeUninit;
use core::ptr::{addr_of_mut, read_volatile, write_volatile};
use gyronet::service::event::ResetCause;

/// Marks a wait for the watchdog.
const WAITING: u32 = 0xB0A2_D06E;
/// Limits for 100 ms at 47 and 17 kHz, with the time until the new limit counts, us.
const LIMITS_US: core::ops::RangeInclusive<u32> = 60_000..=200_000;
/// Checks that failed before are kept in the same word as the time: 24 bits of time.
const TIME_BITS: u32 = 24;

#[unsafe(link_section = ".uninit.bringup")]
static mut WAIT: MaybeUninit<[u32; 2]> = MaybeUninit::uninit();

fn write(words: [u32; 2]) {
    // SAFETY: nothing else uses it, and there are no interrupts.
    unsafe { write_volatile(addr_of_mut!(WAIT).cast(), words) };
}

/// The time that the chip waited for the watchdog before this start, us, with the failed checks above it;
/// `None`: this is the first start.
pub fn elapsed(cause: ResetCause) -> Option<u32> {
    // SAFETY: any bits are words; see `write`.
    let [mark, elapsed] = unsafe { read_volatile(addr_of_mut!(WAIT).cast::<[u32; 2]>()) };
    write([0; 2]);
    // A watchdog that was held up resets a whole image by another cause, and that is then its first start.
    (mark == WAITING && matches!(cause, ResetCause::Watchdog)).then_some(elapsed)
}

/// Reports the watchdog, and how many checks have failed in all.
pub fn judge(report: &mut Report, elapsed: u32) {
    let (us, failed) = (elapsed & ((1 << TIME_BITS) - 1), elapsed >> TIME_BITS);
    if LIMITS_US.contains(&us) {
        report.pass("watchdog", format_args!("reset the chip after {} ms (60 to 200)", us / 1_000));
    } else {
        report.fail("watchdog", format_args!("reset the chip after {} ms, not 60 to 200", us / 1_000));
    }
    let failed = failed + report.failed();
    report.print(format_args!("{failed} checks failed"));
}

/// Waits for the watchdog to reset the chip.
pub fn wait_for_watchdog(report: &mut Report) -> ! {
    report.print(format_args!("watchdog     ...   the chip resets now"));
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
