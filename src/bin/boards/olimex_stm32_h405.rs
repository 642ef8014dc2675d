//! Olimex STM32-H405: STM32F405RG, 8 MHz crystal.

use super::{Board, Line};
use crate::stm32f405::pins::Pin;

pub const BOARD: Board = Board {
    // The LED is connected between the supply and the pin, so a low level lights it.
    led: Some((Pin::new('C', 12), false)),
    imu: Some(Line { tx: Pin::new('A', 9), rx: Pin::new('A', 10), baud: 115_200, fallback_baud: 115_200 }),
    slcan: Some(Line { tx: Pin::new('A', 2), rx: Pin::new('A', 3), baud: 921_600, fallback_baud: 500_000 }),
    fog: Some(Line { tx: Pin::new('B', 10), rx: Pin::new('B', 11), baud: 921_600, fallback_baud: 921_600 }),
    spi: Some([Pin::new('A', 5), Pin::new('A', 6), Pin::new('A', 7), Pin::new('A', 4), Pin::new('C', 4)]),
    ..Board::new("Olimex STM32-H405", 8_000_000, SERVICE, [Pin::new('B', 8), Pin::new('B', 9)])
};

const SERVICE: Line =
    Line { tx: Pin::new('C', 6), rx: Pin::new('C', 7), baud: 115_200, fallback_baud: 115_200 };
