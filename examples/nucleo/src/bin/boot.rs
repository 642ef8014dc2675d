//! Boot loader, the same in both banks: starts the newest image that is whole and confirmed, or on trial
//! ([`gyronet::store::firmware`]), and swaps the banks first if it is in the other one.
//!
//! An update writes images alone, so this program stays what the probe has flashed. A change of option bytes that was interrupted
//! leaves either bank in front, and it chooses again. That the other option bytes stay is assumed (RM0481 was not at hand).
//! The watchdog runs from here on, so an image that hangs before its own start is reset too. If no image is whole, the green
//! LED flashes.
#![no_std]
#![no_main]

#[path = "../flash.rs"]
mod flash;

use core::mem::MaybeUninit;
use core::panic::PanicInfo;
use cortex_m::peripheral::SCB;
use embassy_stm32::pac::{self, flash::vals::OptsrSwapBank, gpio::vals::Moder};
use embassy_stm32::{peripherals, wdg::IndependentWatchdog};
use gyronet::store::Slot;
use gyronet::store::banks::{IMAGE, Slots};
use gyronet::store::firmware::select;

const VECTORS: u32 = 0x0800_0000 + IMAGE;
/// Marks that the banks were swapped to start the image of slot A or B, which has used up a trial already.
const SWAPPED: [u64; 2] = [0x5357_4150_4241_4E4B, 0x4B4E_4142_5041_5753];
/// OPSR: a reset has interrupted a change of option bytes.
const INTERRUPTED: u8 = 6;
const WATCHDOG_US: u32 = 1_000_000;
/// Steps of a delay of about a quarter of a second at 64 MHz.
const QUARTER: u32 = 6_000_000;

#[unsafe(link_section = ".uninit.swapped")]
static mut MARK: MaybeUninit<u64> = MaybeUninit::uninit();

#[cortex_m_rt::entry]
fn main() -> ! {
    // SAFETY: nothing else runs.
    let (mut watchdog, array) = unsafe {
        (IndependentWatchdog::new(peripherals::IWDG::steal(), WATCHDOG_US), flash::Array::new(|| ()))
    };
    watchdog.unleash();
    let mut slots = Slots(array);
    let lower = slots.lower();
    let mark = (&raw mut MARK).cast::<u64>();
    // SAFETY: it is initialised by the start before, or of no known value.
    let before = unsafe { (mark.read_volatile(), mark.write_volatile(0)).0 };
    if before == SWAPPED[lower as usize] {
        start();
    }
    // The image reads the flags of the reset and clears them.
    let flags = pac::RCC.rsr().read();
    match select(&mut slots, flags.iwdgrstf() || flags.wwdgrstf()) {
        Some(slot) if slot == lower && pac::FLASH.opsr().read().code_op() as u8 != INTERRUPTED => start(),
        Some(slot) => {
            // SAFETY: as above.
            unsafe { mark.write_volatile(SWAPPED[slot as usize]) };
            swap(slot)
        }
        None => flash_led(),
    }
}

/// Starts the image of this bank.
fn start() -> ! {
    // SAFETY: the image is whole. Its start expects the state after a reset, from which nothing here differs but the watchdog; no
    // interrupt is enabled.
    unsafe {
        (*SCB::PTR).vtor.write(VECTORS);
        cortex_m::asm::bootload(VECTORS as *const u32)
    }
}

/// Puts the bank of a slot in front.
fn swap(slot: Slot) -> ! {
    let bank = if slot == Slot::A { OptsrSwapBank::B_0X0 } else { OptsrSwapBank::B_0X1 };
    [0x4567_0123, 0xCDEF_89AB].into_iter().for_each(|key| pac::FLASH.nskeyr().write_value(key));
    [0x0819_2A3B, 0x4C5D_6E7F].into_iter().for_each(|key| pac::FLASH.optkeyr().write_value(key));
    pac::FLASH.optsr_prg().modify(|w| w.set_swap_bank(bank));
    pac::FLASH.optcr().modify(|w| w.set_optstrt(true));
    // The watchdog ends a wait that does not end.
    while pac::FLASH.nssr().read().bsy() {}
    SCB::sys_reset()
}

/// Flashes LD1 (PB0) twice a second, until the watchdog has the board try again.
fn flash_led() -> ! {
    pac::RCC.ahb2enr().modify(|w| w.set_gpioben(true));
    pac::GPIOB.moder().modify(|w| w.set_moder(0, Moder::OUTPUT));
    loop {
        pac::GPIOB.odr().modify(|w| w.0 ^= 1);
        cortex_m::asm::delay(QUARTER);
    }
}

#[panic_handler]
fn panic(_: &PanicInfo) -> ! {
    SCB::sys_reset()
}
