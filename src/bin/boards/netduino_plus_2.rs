//! Netduino Plus 2: STM32F405RG, 25 MHz crystal.

use super::{Board, Line};
use crate::stm32f405::pins::Pin;

pub const BOARD: Board = Board {
    led: Some((Pin::new('A', 10), true)),
    // The LED is on PA10, so USART1 is on the shield's SCL and SDA pins.
    imu: Some(Line { tx: Pin::new('B', 6), rx: Pin::new('B', 7), baud: 115_200, fallback_baud: 115_200 }),
    slcan: Some(Line { tx: Pin::new('A', 2), rx: Pin::new('A', 3), baud: 921_600, fallback_baud: 500_000 }),
    fog: Some(Line { tx: Pin::new('B', 10), rx: Pin::new('B', 11), baud: 921_600, fallback_baud: 921_600 }),
    // D8 and D7 of the shield.
    gnss: Some(Line { tx: Pin::new('A', 0), rx: Pin::new('A', 1), baud: 38_400, fallback_baud: 38_400 }),
    spi: Some([Pin::new('A', 5), Pin::new('A', 6), Pin::new('A', 7), Pin::new('A', 4), Pin::new('C', 4)]),
    ..Board::new("Netduino Plus 2", 25_000_000, SERVICE, [Pin::new('B', 8), Pin::new('B', 9)])
};

const SERVICE: Line =
    Line { tx: Pin::new('C', 6), rx: Pin::new('C', 7), baud: 115_200, fallback_baud: 115_200 };
