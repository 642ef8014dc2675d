//! Descriptions of the boards that an image can be built for: crystal, pins and bit rates, one file each.
//!
//! A Cargo feature selects the board. All other code of the images uses only this description.

#[cfg(feature = "netduino-plus-2")]
mod netduino_plus_2;
#[cfg(feature = "netduino-plus-2")]
pub use netduino_plus_2::BOARD;
#[cfg(feature = "olimex-stm32-h405")]
mod olimex_stm32_h405;
#[cfg(feature = "olimex-stm32-h405")]
pub use olimex_stm32_h405::BOARD;
#[cfg(feature = "minimal-board")]
mod minimal;
#[cfg(feature = "minimal-board")]
pub use minimal::BOARD;

// Two boards at once define BOARD twice, which the compiler says by itself.
#[cfg(not(any(feature = "netduino-plus-2", feature = "olimex-stm32-h405", feature = "minimal-board")))]
compile_error!(
    "an image is built for one board: --features netduino-plus-2, olimex-stm32-h405 or minimal-board"
);

use crate::stm32f405::pins::{Pin, Speed};

/// Describes a board. What a board does not have is left out of its file.
pub struct Board {
    /// Name of the board, as `bringup` prints it; its first 16 bytes label an image.
    pub name: &'static str,
    /// Frequency of the crystal at OSC_IN, Hz: 4 to 26 MHz, a whole number of MHz.
    pub crystal_hz: u32,
    /// The LED, and the level that lights it.
    pub led: Option<(Pin, bool)>,
    /// USART1: the inertial sensor.
    pub imu: Option<Line>,
    /// USART2: SLCAN.
    pub slcan: Option<Line>,
    /// USART3: the fibre-optic gyro.
    pub fog: Option<Line>,
    /// UART4: a GNSS receiver. Its bit rate is that of the configuration; the one here is the bring-up's.
    pub gnss: Option<Line>,
    /// USART6: the service line.
    pub service: Line,
    /// CAN1, receive and transmit.
    pub can: [Pin; 2],
    /// SPI1: clock, data in, data out, the sensor's chip select, and that of the gyro of a sensor with two.
    pub spi: Option<[Pin; 5]>,
}

impl Board {
    /// Describes a board with nothing but the service line and CAN. A board's file adds what it has.
    pub const fn new(name: &'static str, crystal_hz: u32, service: Line, can: [Pin; 2]) -> Self {
        let (led, spi, [imu, slcan, fog, gnss]) = (None, None, [const { None }; 4]);
        Self { name, crystal_hz, led, imu, slcan, fog, gnss, service, can, spi }
    }
}

pub struct Line {
    pub tx: Pin,
    pub rx: Pin,
    pub baud: u32,
    /// Bit rate while the board runs on its internal oscillator at 16 MHz.
    pub fallback_baud: u32,
}

impl Line {
    /// Connects both pins with a USART, by its alternate function. An open input reads as idle.
    pub fn connect(&self, function: u8) {
        self.rx.pull_up();
        self.rx.alternate(function, Speed::Low);
        self.tx.alternate(function, Speed::Low);
    }
}
