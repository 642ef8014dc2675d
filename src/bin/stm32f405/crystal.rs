//! Measures the crystal against the internal oscillator (RM0090 7.2.11): TIM11 counts the internal
//! 16 MHz and captures at every 248th period of the crystal.
//!
//! With a crystal of the wrong frequency the PLL still locks, and every bit rate would be wrong by the same factor.
//! The internal oscillator is within -8 and +4.5 % from -40 to 105 degrees Celsius (DS8626 table 39), so frequencies
//! that differ by less than 10 % cannot be distinguished.
#![allow(unsafe_code, reason = "raw register values; each block says why it is sound")]

use super::{clock_delay, pac};
use gyronet::service::event::ClockFault;

/// Frequency of the internal oscillator, Hz.
pub const INTERNAL_HZ: u32 = 16_000_000;
/// Divider of the crystal before the timer (RTCPRE), and edges for each capture.
const DIVIDER: u8 = 31;
const EDGES: u32 = 8;
/// Captures in a measurement: 32 take 31,744 counts with a crystal of 4 MHz, and the timer can count 65,536.
const CAPTURES: u32 = 32;
/// Polls before the captures time out: twice as many as a crystal of 4 MHz needs.
const POLLS: u32 = 20_000;
const TOLERANCE_PERCENT: u32 = 10;

/// Checks that the running crystal has the expected frequency, Hz, and returns the measured one.
///
/// # Errors
/// [`ClockFault::CrystalFrequency`] with the measured frequency, kHz, or 0 if the measurement failed.
pub fn check(rcc: &pac::RCC, expected_hz: u32) -> Result<u32, ClockFault> {
    let measured = measure(rcc).unwrap_or(0);
    let limit = expected_hz / 100 * TOLERANCE_PERCENT;
    if measured.abs_diff(expected_hz) <= limit {
        Ok(measured)
    } else {
        Err(ClockFault::CrystalFrequency { khz: (measured / 1_000).min(u16::MAX.into()) as u16 })
    }
}

/// Measures the running crystal, Hz; the chip must be on its internal oscillator.
fn measure(rcc: &pac::RCC) -> Option<u32> {
    rcc.cfgr().modify(|_, w| w.rtcpre().set(DIVIDER));
    rcc.apb2enr().modify(|_, w| w.tim11en().enabled());
    clock_delay();
    // SAFETY: the timer is used here alone, before interrupts are on.
    let timer = unsafe { pac::TIM11::steal() };
    // SAFETY: TI1_RMP = 10 selects the divided crystal (RM0090 19.5.11); CC1S = 01 makes channel 1 an
    // input of it, IC1PSC = 11 captures every eighth edge (RM0090 19.5.4).
    unsafe {
        timer.or().write(|w| w.bits(0b10));
        timer.ccmr1_input().write(|w| w.bits(0b11 << 2 | 0b01));
        timer.ccer().write(|w| w.bits(1));
        timer.cr1().write(|w| w.cen().set_bit());
    }
    let counts = count(&timer);
    timer.cr1().write(|w| w.cen().clear_bit());
    rcc.apb2enr().modify(|_, w| w.tim11en().disabled());
    let periods = u64::from(u32::from(DIVIDER) * EDGES * CAPTURES);
    let hz = (u64::from(INTERNAL_HZ) * periods).checked_div(counts?.into())?;
    u32::try_from(hz).ok()
}

/// Returns the counts of the timer over all captures; `None` if they time out or one was missed.
fn count(timer: &pac::TIM11) -> Option<u16> {
    // The first one ends an unknown part of a period, so the second begins the count.
    let (mut seen, mut first) = (0, 0);
    for _ in 0..POLLS {
        let status = timer.sr().read();
        if status.cc1of().bit_is_set() {
            return None;
        }
        if status.cc1if().bit_is_set() {
            // Reading the capture clears its flag (RM0090 19.5.3).
            let captured = timer.ccr1().read().bits() as u16;
            seen += 1;
            if seen == 2 {
                first = captured;
            }
            if seen == CAPTURES + 2 {
                return Some(captured.wrapping_sub(first));
            }
        }
    }
    None
}
