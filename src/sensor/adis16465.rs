//! Reads Analog Devices ADIS16465 and ADIS16470 over SPI (mode 3).
//!
//! One burst read returns all values: the command 68 00, then the twenty bytes of a [`Burst`], at 1 MHz at most. This
//! file does the SPI transfer; `burst` parses the bytes without I/O.

mod burst;

pub use burst::{BURST, Burst, BurstError, DiagStat, Model};

use crate::sample::ImuSample;
use crate::units::Micros;
use embedded_hal::spi::{Operation, SpiDevice};

const BURST_COMMAND: [u8; 2] = [0x68, 0x00];

/// The error of a read.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum AdisError<E> {
    /// The bus failed.
    #[error("ADIS164xx: the bus failed: {0:?}")]
    Bus(E),
    /// The bytes hold no valid sample.
    #[error(transparent)]
    Burst(BurstError),
}

/// The driver of the sensor.
#[derive(Debug)]
pub struct Adis16465<SPI> {
    spi: SPI,
    model: Model,
    last_counter: Option<u16>,
    /// Number of readings that were not fetched, from the data counter.
    lost: u32,
}

impl<SPI: SpiDevice> Adis16465<SPI> {
    /// Creates a driver for the sensor with its factory settings. Wait 300 ms after power-up before the first read.
    pub const fn new(spi: SPI, model: Model) -> Self {
        Self { spi, model, last_counter: None, lost: 0 }
    }

    /// Releases the SPI device.
    pub fn destroy(self) -> SPI {
        self.spi
    }

    /// Reads the newest values. The burst carries no time stamp: `now` is the time of the data-ready signal.
    pub fn read(&mut self, now: Micros) -> Result<ImuSample, AdisError<SPI::Error>> {
        let mut bytes = [0; BURST];
        let mut burst = [Operation::Write(&BURST_COMMAND), Operation::Read(&mut bytes)];
        self.spi.transaction(&mut burst).map_err(AdisError::Bus)?;
        let burst = Burst::parse(&bytes).map_err(AdisError::Burst)?;
        let steps = self.last_counter.map_or(1, |last| burst.counter.wrapping_sub(last));
        if steps == 0 {
            return Err(AdisError::Burst(BurstError::Repeated { counter: burst.counter }));
        }
        self.last_counter = Some(burst.counter);
        self.lost = self.lost.saturating_add(u32::from(steps) - 1);
        burst.sample(self.model, now).map_err(AdisError::Burst)
    }

    /// Returns the number of readings that were not fetched. At 2000 readings and 100 reads a second, it grows by 19
    /// per read.
    pub fn lost(&self) -> u32 {
        self.lost
    }
}
