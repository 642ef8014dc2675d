//! Board time: TIM5 (RM0090 18) as a free-running 32-bit counter of microseconds.
//!
//! The counter keeps running while an erase of the flash stalls the processor, so no time is lost. It wraps every
//! 71.6 minutes. [`tick`], called every millisecond, counts the half-wraps; a reader combines both. The result is
//! right at any priority, as long as the tick is at most half a wrap late.
#![allow(unsafe_code, reason = "raw register values; each block says why it is sound")]

use super::{clock_delay, clocks::Clocks, pac};
use core::sync::atomic::{AtomicU32, Ordering};
use gyronet::units::divided;

const HZ: u32 = 1_000_000;

/// Half-wraps of the counter since the start.
static HALVES: AtomicU32 = AtomicU32::new(0);

pub fn start(rcc: &pac::RCC, timer: &pac::TIM5, clocks: &Clocks) {
    rcc.apb1enr().modify(|_, w| w.tim5en().enabled());
    clock_delay();
    // SAFETY: any prescaler and any end of the count are valid; UG loads both (RM0090 18.4.6).
    unsafe {
        timer.psc().write(|w| w.bits(clocks.timer_hz / HZ - 1));
        timer.arr().write(|w| w.bits(u32::MAX));
        timer.egr().write(|w| w.ug().set_bit());
        timer.cr1().write(|w| w.cen().set_bit());
    }
}

fn counter() -> u32 {
    // SAFETY: the register is only read.
    unsafe { &*pac::TIM5::ptr() }.cnt().read().bits()
}

/// Counts half-wraps, and returns the counter. The SysTick handler calls it every millisecond.
#[inline]
pub fn tick() -> u32 {
    let (halves, count) = (HALVES.load(Ordering::Relaxed), counter());
    if count >> 31 != halves & 1 {
        HALVES.store(halves.wrapping_add(1), Ordering::Relaxed);
    }
    count
}

#[inline]
pub fn micros() -> u64 {
    // Read first: a half-wrap that is counted between the two reads then shows in the counter only.
    let halves = HALVES.load(Ordering::Acquire);
    let count = counter();
    // If the counter is not in the half that the count says, it has just entered the next one.
    (u64::from(halves) << 31) + u64::from(count ^ (halves & 1) << 31)
}

/// Returns the milliseconds since the start, which wrap.
pub fn milliseconds() -> u32 {
    whole_milliseconds(micros())
}

/// Returns microseconds as whole milliseconds, which wrap.
#[inline]
pub const fn whole_milliseconds(us: u64) -> u32 {
    divided::<1_000>(us) as u32
}
