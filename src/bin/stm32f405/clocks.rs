//! Sets the clock tree (RM0090 7): 168 MHz from the board's crystal, or the internal 16 MHz oscillator.
//!
//! Every wait has a limit. If the crystal does not start or has the wrong frequency, or the supply stays low, the
//! chip stays on the internal oscillator: CAN stays off, since that oscillator can be 8 % wrong, and the reason is
//! reported.
#![allow(unsafe_code, reason = "raw register values; each block says why it is sound")]

use super::crystal::{self, INTERNAL_HZ};
use super::{pac, supply, wait_until};
use gyronet::service::event::ClockFault;

/// Frequency of the processor on the crystal, Hz.
pub const FULL_HZ: u32 = 168_000_000;
const MHZ: u32 = 1_000_000;
/// Polls before a step times out: above 25 ms at 16 MHz. A crystal takes 2 ms (DS8626 table 37).
const POLLS: u32 = 80_000;

/// Holds the frequencies, Hz.
#[derive(Debug, Clone, Copy)]
pub struct Clocks {
    /// Processor and SysTick.
    pub core_hz: u32,
    /// USART2, USART3 and CAN1.
    pub apb1_hz: u32,
    /// USART1, USART6 and SPI1.
    pub apb2_hz: u32,
    /// TIM5: twice APB1 if APB1 is divided.
    pub timer_hz: u32,
    /// The crystal's frequency as measured against the internal oscillator; 0 where it was not measured.
    #[allow(dead_code, reason = "bringup alone prints it")]
    pub measured_hz: u32,
    /// The reason why the clocks do not run from the crystal.
    pub fault: Option<ClockFault>,
}

impl Clocks {
    const FULL: Self = Self {
        core_hz: FULL_HZ,
        apb1_hz: FULL_HZ / 4,
        apb2_hz: FULL_HZ / 2,
        timer_hz: FULL_HZ / 2,
        measured_hz: 0,
        fault: None,
    };

    const fn internal(fault: ClockFault) -> Self {
        let hz = INTERNAL_HZ;
        Self { core_hz: hz, apb1_hz: hz, apb2_hz: hz, timer_hz: hz, measured_hz: 0, fault: Some(fault) }
    }

    /// Starts crystal and PLL; falls back to the internal oscillator if one of them does not start.
    pub fn start(rcc: &pac::RCC, flash: &pac::FLASH, pwr: &pac::PWR, crystal_hz: u32) -> Self {
        to_internal(rcc);
        let started =
            if supply::wait(rcc, pwr) { full(rcc, flash, crystal_hz) } else { Err(ClockFault::SupplyLow) };
        match started {
            Ok(measured_hz) => Self { measured_hz, ..Self::FULL },
            Err(fault) => {
                to_internal(rcc);
                Self::internal(fault)
            }
        }
    }

    pub fn exact(&self) -> bool {
        self.fault.is_none()
    }
}

/// Switches the chip to the internal oscillator and stops PLL and crystal: a bootloader may have left them on, and
/// PLLCFGR is read-only while the PLL runs (RM0090 7.3.2).
fn to_internal(rcc: &pac::RCC) {
    rcc.cr().modify(|_, w| w.hsion().on());
    wait_until(POLLS, || rcc.cr().read().hsirdy().is_ready());
    rcc.cfgr().modify(|_, w| w.sw().hsi());
    wait_until(POLLS, || rcc.cfgr().read().sws().is_hsi());
    rcc.cfgr().modify(|_, w| w.hpre().div1().ppre1().div1().ppre2().div1());
    rcc.cr().modify(|_, w| w.csson().off().pllon().off().hseon().off());
    wait_until(POLLS, || rcc.cr().read().pllrdy().is_not_ready());
}

fn full(rcc: &pac::RCC, flash: &pac::FLASH, crystal_hz: u32) -> Result<u32, ClockFault> {
    rcc.cr().modify(|_, w| w.hseon().on());
    if !wait_until(POLLS, || rcc.cr().read().hserdy().is_ready()) {
        return Err(ClockFault::NoCrystal);
    }
    let measured_hz = crystal::check(rcc, crystal_hz)?;
    // 1 MHz x 336 / 2 = 168 MHz; / 7 = 48 MHz.
    // SAFETY: the divider is 4 to 26, the other fields are within RM0090 7.3.2.
    rcc.pllcfgr().modify(|_, w| unsafe {
        w.pllsrc().hse().pllm().bits((crystal_hz / MHZ) as u8).plln().bits(336).pllp().div2().pllq().bits(7)
    });
    rcc.cr().modify(|_, w| w.pllon().on());
    if !wait_until(POLLS, || rcc.cr().read().pllrdy().is_ready()) {
        return Err(ClockFault::Pll);
    }
    // Five wait states at 150 to 168 MHz and 2.7 to 3.6 V (RM0090 table 10), before the clock rises.
    flash.acr().modify(|_, w| w.latency().ws5().icen().enabled().dcen().enabled());
    if !wait_until(POLLS, || flash.acr().read().latency().is_ws5()) {
        return Err(ClockFault::Pll);
    }
    rcc.cfgr().modify(|_, w| w.hpre().div1().ppre1().div4().ppre2().div2());
    rcc.cfgr().modify(|_, w| w.sw().pll());
    if !wait_until(POLLS, || rcc.cfgr().read().sws().is_pll()) {
        return Err(ClockFault::Pll);
    }
    // A crystal that stops raises the NMI, which records the reason and resets the chip.
    rcc.cr().modify(|_, w| w.csson().on());
    Ok(measured_hz)
}

/// Enables the flash's prefetch where the chip has one that works: not in revision A, whose DBGMCU_IDCODE holds the
/// STM32F2's device (0x411) or revision 0x1000.
pub fn enable_prefetch(flash: &pac::FLASH, idcode: u32) {
    let (device, revision) = (idcode & 0xFFF, idcode >> 16);
    flash.acr().modify(|_, w| w.prften().bit(device == 0x413 && revision > 0x1000));
}

/// Retries what failed at the start; returns whether it would succeed after a reset. Called once a second.
///
/// Only the supply and a crystal that did not start can recover. The crystal is switched on by one call and checked
/// by the next.
pub fn recovered(fault: ClockFault) -> bool {
    // SAFETY: called by the idle task alone, which is the only user of this register after the start.
    let cr = unsafe { &*pac::RCC::ptr() }.cr();
    match fault {
        ClockFault::SupplyLow => !supply::is_low(),
        ClockFault::NoCrystal => {
            let ready = cr.read().hserdy().is_ready();
            cr.modify(|_, w| w.hseon().on());
            ready
        }
        _ => false,
    }
}
