//! Checks the serial lines: where a wire connects TX with RX, every byte must return. An open RX is pulled high.

#![allow(unsafe_code, reason = "memory that DMA reads; the block says why it is sound")]

use crate::boards::{BOARD, Line};
use crate::report::Report;
use crate::stm32f405::clocks::Clocks;
use crate::stm32f405::pins;
use crate::stm32f405::usart::Usart;
use crate::stm32f405::wait_until;

static PATTERN: [u8; 4] = [0x55, 0xAA, 0x00, 0xFF];
/// Polls before a byte times out: several byte times at 115200 baud.
const POLLS: u32 = 20_000;

/// Checks the lines other than USART6, which carries the report, and both DMA controllers.
pub fn check_all(report: &mut Report, clocks: &Clocks) {
    let lines = [
        ("USART1", &BOARD.imu, clocks.apb2_hz, Usart::one()),
        ("USART2", &BOARD.slcan, clocks.apb1_hz, Usart::two()),
        ("USART3", &BOARD.fog, clocks.apb1_hz, Usart::three()),
        ("UART4", &BOARD.gnss, clocks.apb1_hz, Usart::four()),
    ];
    for (name, line, bus_hz, usart) in lines {
        let Some(line) = line else {
            // The check of the DMA sends through it, to no pin.
            usart.start(bus_hz, BOARD.service.baud);
            report.manual_check(name, format_args!("the board has no such line"));
            continue;
        };
        check(
            report,
            name,
            line,
            (bus_hz, if clocks.exact() { line.baud } else { line.fallback_baud }),
            usart,
        );
    }
    report.manual_check("USART6", format_args!("sends these lines; reading them over RTT does not check it"));
    check_dma(report, [Usart::one(), Usart::two()]);
}

fn check_dma(report: &mut Report, usarts: [Usart; 2]) {
    for usart in usarts {
        usart.request_dma();
        // SAFETY: the pattern is a static.
        unsafe { usart.send_from(PATTERN.as_ptr(), PATTERN.len() as u16) };
        if !wait_until(POLLS, || !usart.is_sending() && usart.status().sent()) {
            return report.fail("DMA", format_args!("bytes are not sent"));
        }
    }
    report.pass("DMA", format_args!("both controllers send"));
}

fn check(report: &mut Report, name: &str, line: &Line, (bus_hz, baud): (u32, u32), usart: Usart) {
    let function = if name == "UART4" { pins::UART_4_AND_6 } else { pins::USART_1_TO_3 };
    line.connect(function);
    usart.start(bus_hz, baud);
    let mut received = 0;
    for byte in PATTERN {
        if !wait_until(POLLS, || usart.status().room()) {
            return report.fail(name, format_args!("it accepts no byte"));
        }
        usart.write(byte);
        if !wait_until(POLLS, || usart.status().sent()) {
            return report.fail(name, format_args!("a byte is not sent"));
        }
        if wait_until(POLLS, || usart.status().received()) {
            let damaged = usart.status().damaged();
            let got = usart.read();
            if damaged || got != byte {
                return report.fail(name, format_args!("{byte:#04x} came back as {got:#04x}"));
            }
            received += 1;
        }
    }
    match received {
        0 => report
            .manual_check(name, format_args!("sends at {baud} baud; connect TX with RX to see it receive")),
        n if n == PATTERN.len() => report.pass(name, format_args!("{baud} baud, looped")),
        n => report.fail(name, format_args!("{n} of {} bytes came back", PATTERN.len())),
    }
}
