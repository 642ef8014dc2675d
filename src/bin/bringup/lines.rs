//! The serial lines: bytes come back where a wire connects TX with RX, and an idle line is high.

use crate::boards::{BOARD, Line};
use crate::report::Report;
use crate::stm32f405::clocks::Clocks;
use crate::stm32f405::pac;
use crate::stm32f405::pins::{self, Speed};
use crate::stm32f405::usart::Usart;

const PATTERN: [u8; 4] = [0x55, 0xAA, 0x00, 0xFF];
/// Polls for a byte: several byte times at 115200.
const POLLS: u32 = 20_000;

/// Checks the lines beside the one that reports.
pub fn check_all(report: &mut Report, clocks: &Clocks) {
    let usart = |registers, interrupt| Usart::new(registers, interrupt);
    let lines = [
        ("USART1", &BOARD.imu, clocks.apb2_hz, usart(pac::USART1::ptr(), pac::Interrupt::USART1)),
        ("USART2", &BOARD.slcan, clocks.apb1_hz, usart(pac::USART2::ptr(), pac::Interrupt::USART2)),
        ("USART3", &BOARD.fog, clocks.apb1_hz, usart(pac::USART3::ptr(), pac::Interrupt::USART3)),
    ];
    for (name, line, bus_hz, usart) in lines {
        check(
            report,
            name,
            line,
            (bus_hz, if clocks.exact() { line.baud } else { line.fallback_baud }),
            usart,
        );
    }
    report.pass("USART6", format_args!("you read this"));
}

fn check(report: &mut Report, name: &str, line: &Line, (bus_hz, baud): (u32, u32), usart: Usart) {
    line.rx.pull_up();
    line.rx.alternate(pins::USART_1_TO_3, Speed::Low);
    line.tx.alternate(pins::USART_1_TO_3, Speed::Low);
    usart.start(bus_hz, baud);
    let mut came = 0;
    for byte in PATTERN {
        if !(0..POLLS).any(|_| usart.status().room()) {
            return report.fail(name, format_args!("it takes no byte"));
        }
        usart.write(byte);
        if !(0..POLLS).any(|_| usart.status().sent()) {
            return report.fail(name, format_args!("a byte does not leave"));
        }
        if (0..POLLS).any(|_| usart.status().received()) {
            let damaged = usart.status().damaged();
            let got = usart.read();
            if damaged || got != byte {
                return report.fail(name, format_args!("{byte:#04x} came back as {got:#04x}"));
            }
            came += 1;
        }
    }
    match came {
        0 => report.look(name, format_args!("sends at {baud} baud; connect TX with RX to see it receive")),
        n if n == PATTERN.len() => report.pass(name, format_args!("{baud} baud, looped")),
        n => report.fail(name, format_args!("{n} of {} bytes came back", PATTERN.len())),
    }
}
