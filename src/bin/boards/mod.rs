//! Descriptions of the boards that an image can be built for: crystal, pins and bit rates, one file each.
//!
//! A Cargo feature selects the board. All other code of the images uses only this description.

#[cfg(all(feature = "netduino-plus-2", not(feature = "olimex-stm32-h405")))]
mod netduino_plus_2;
#[cfg(all(feature = "netduino-plus-2", not(feature = "olimex-stm32-h405")))]
pub use netduino_plus_2::BOARD;
#[cfg(all(feature = "olimex-stm32-h405", not(feature = "netduino-plus-2")))]
mod olimex_stm32_h405;
#[cfg(all(feature = "olimex-stm32-h405", not(feature = "netduino-plus-2")))]
pub use olimex_stm32_h405::BOARD;

#[cfg(any(
    all(feature = "netduino-plus-2", feature = "olimex-stm32-h405"),
    not(any(feature = "netduino-plus-2", feature = "olimex-stm32-h405"))
))]
compile_error!("an image is built for one board: --features netduino-plus-2 or olimex-stm32-h405");

use crate::stm32f405::pins::Pin;

/// Describes a board.
pub struct Board {
    /// Name of the board, as `bringup` prints it.
    #[allow(dead_code, reason = "coprocessor does not print it")]
    pub name: &'static str,
    /// Frequency of the crystal at OSC_IN, Hz: 4 to 26 MHz, a whole number of MHz.
    pub crystal_hz: u32,
    /// The LED, and the level that lights it.
    pub led: (Pin, bool),
    /// USART1: the inertial sensor.
    pub imu: Line,
    /// USART2: SLCAN.
    pub slcan: Line,
    /// USART3: the fibre-optic gyro.
    pub fog: Line,
    /// USART6: the service line.
    pub service: Line,
    /// CAN1, receive and transmit.
    pub can: [Pin; 2],
    /// SPI1: clock, data in, data out, and the sensor's chip select.
    pub spi: [Pin; 4],
}

/// Pins and bit rate of a serial line.
pub struct Line {
    /// Transmit.
    pub tx: Pin,
    /// Receive.
    pub rx: Pin,
    /// Bit rate, baud.
    pub baud: u32,
    /// Bit rate while the board runs on its internal oscillator at 16 MHz.
    pub fallback_baud: u32,
}
