//! Bring-up test: tries every peripheral of a board once and prints a line for each: `PASS`, `FAIL` with the reason,
//! or `----` where a person must check.
//!
//! The lines are sent on USART6 (115200 8N1) and over RTT. Run this image first on a new board: it needs no sensor,
//! no bus and no host. It uses the coprocessor's drivers. In the last check the watchdog resets the chip, so the
//! image starts twice and reports that check the second time. It erases nothing but the last sector, and only if the
//! first 64 bytes of that sector are blank.
#![no_std]
#![no_main]

#[path = "../boards/mod.rs"]
#[allow(dead_code, reason = "loopback needs no pins")]
mod boards;
mod brownout;
mod lines;
mod networks;
mod peripherals;
mod report;
mod reset;
#[path = "../stm32f405/mod.rs"]
#[allow(dead_code, reason = "the drivers are the coprocessor's, which uses all of them")]
mod stm32f405;

use crate::boards::BOARD;
use crate::report::Report;
use crate::stm32f405::{Chip, pac, watchdog};
use core::panic::PanicInfo;

#[cortex_m_rt::entry]
fn main() -> ! {
    let Some(p) = pac::Peripherals::take() else { cortex_m::peripheral::SCB::sys_reset() };
    let Some(core) = cortex_m::Peripherals::take() else { cortex_m::peripheral::SCB::sys_reset() };
    let chip = Chip::start(&p, BOARD.crystal_hz);
    let mut report = Report::start(&chip);
    if let Some(elapsed_us) = reset::elapsed(chip.reset) {
        reset::report_result(&mut report, elapsed_us);
        report.end();
    }
    peripherals::led(&mut report, &chip.clocks);
    peripherals::clock(&mut report, &chip);
    peripherals::supply(&mut report, &p.FLASH);
    peripherals::can(&mut report, &chip, p.CAN1);
    peripherals::sensor(&mut report, &p.SPI1);
    lines::check_all(&mut report, &chip.clocks);
    peripherals::flash(&mut report, p.FLASH);
    networks::count(&mut report, core.DCB, core.DWT);
    watchdog::feed();
    reset::wait_for_watchdog(&mut report)
}

#[panic_handler]
fn panic(info: &PanicInfo<'_>) -> ! {
    Report::attach().fail("bringup", format_args!("{info}"));
    cortex_m::peripheral::SCB::sys_reset()
}
