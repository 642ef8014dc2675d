//! The least that a board needs for an MTi: its line, CAN and the service line, here with an 8 MHz crystal. No LED,
//! SLCAN, fibre-optic gyro or SPI. A file to copy for a new board, and built by a test.

use super::{Board, Line};
use crate::stm32f405::pins::Pin;

pub const BOARD: Board = Board {
    imu: Some(Line { tx: Pin::new('A', 9), rx: Pin::new('A', 10), baud: 115_200, fallback_baud: 115_200 }),
    ..Board::new("minimal board", 8_000_000, SERVICE, [Pin::new('B', 8), Pin::new('B', 9)])
};

const SERVICE: Line =
    Line { tx: Pin::new('C', 6), rx: Pin::new('C', 7), baud: 115_200, fallback_baud: 115_200 };
