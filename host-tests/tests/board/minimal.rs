//! Two boards with a crystal of 8 MHz send the host's frames. One of them, whose file leaves out the LED, SLCAN, the
//! fibre-optic gyro and SPI, refuses what it has no line for.

use crate::common::{self, SAMPLE, SET, SLCAN, START};
use crate::service::{self, on_bus};
use gyronet::service::message::Refusal;
use gyronet::store::{Configuration, FieldError, FogPart, ImuPart, StoreError};
use gyronet_host_tests::board::{self, Board};
use gyronet_tools::client::device::error::DeviceError;

/// A board that has sent the frames of 50 samples.
fn sending(name: &str) -> Option<Board> {
    const SAMPLES: usize = 50;
    let mut board = Board::unpowered(&board::firmware(name, env!("CARGO_TARGET_TMPDIR"), "coprocessor")?)?;
    board.configure("RCC.crystal_hz", 8_000_000);
    board.configure("USART2.baud", 921_600);
    board.power_on();
    let samples = common::drive(SAMPLES);
    common::send(&mut board, &samples, START);
    board.run(START + SAMPLE * SAMPLES as u32);
    let sent = common::frames(&board.can_frames());
    let made = common::host(&samples);
    assert!(sent.len() >= SET * (SAMPLES - 1) && sent == made[..sent.len()], "{} frames", sent.len());
    assert_eq!(service::info(&mut board).identity.clock_fault, None);
    Some(board)
}

#[test]
fn olimex_board_with_its_crystal_of_8_mhz_sends_the_hosts_frames() {
    let Some(mut board) = sending("olimex-stm32-h405") else { return };
    board.send(SLCAN, b"O\r");
    board.run(SAMPLE);
    assert!(board.sent(SLCAN).starts_with(b"\r"));
}

#[test]
fn board_without_led_slcan_gyro_and_spi_sends_the_hosts_frames() {
    let Some(mut board) = sending("minimal-board") else { return };
    assert!(board.sent(SLCAN).is_empty());
    let counters = common::counters(&mut board);
    assert_eq!((counters.lines.unsent, counters.lines.line_errors), (0, 0));
    common::assert_well_set(&mut board);
    let none = Refusal::Store(StoreError::Field(FieldError::PartNotInImage));
    for configuration in [
        Configuration { imu: ImuPart::Icm42688, ..Configuration::DEFAULT },
        Configuration { fog: Some(FogPart::Dsp1760), ..Configuration::DEFAULT },
    ] {
        match on_bus(&mut board).set_configuration(&configuration) {
            Err(DeviceError::Refused(refusal)) => assert_eq!(refusal, none),
            other => panic!("{other:?}"),
        }
    }
    service::restart(&mut board);
    assert_eq!(service::configuration(&mut board), Configuration::DEFAULT);
}
