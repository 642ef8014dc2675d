//! Reads the TDK ICM-42688-P over SPI (mode 0 or 3, at most 24 MHz).
//!
//! [`packet`] parses the entries of its FIFO without I/O, [`registers`] lists its registers, and this file does the
//! SPI transfers. Every wait is a bounded number of [`DelayNs`] delays. Each call for a sample also reads back one
//! register of the configuration, so that a reset or a flipped bit in the sensor is detected within [`SETTINGS`]
//! calls.

mod clock;
mod config;
#[doc(hidden)]
pub mod packet;
#[doc(hidden)]
pub mod registers;
mod sample;

pub use config::{Bandwidth, Icm42688Config, OutputRate, SETTINGS};

use crate::sample::ImuSample;
use clock::Clock;
use embedded_hal::delay::DelayNs;
use embedded_hal::spi::{Operation, SpiDevice};
use packet::{PACKET, Packet, PacketError};
use registers::{self as reg, Register, Setting};

/// Largest number of polls of the reset bit, 1 ms apart.
const RESET_POLLS: u8 = 10;
/// Start-up time of the gyro until its readings are valid, ms.
const START_MS: u32 = 45;

/// The error of the sensor or its bus.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
#[allow(missing_docs, reason = "its messages say it")]
pub enum Icm42688Error<E> {
    #[error("ICM-42688: the bus failed: {0:?}")]
    Bus(E),
    #[error("ICM-42688: no answer after the reset")]
    Reset,
    #[error("ICM-42688: identity is {got:02x}, should be {:02x}", reg::IDENTITY)]
    Identity { got: u8 },
    /// A register does not hold the value that was written: configure the sensor again.
    #[error("ICM-42688: register {:02x} of bank {} holds {got:02x}, not {expected:02x}", .register.address, .register.bank)]
    Setting { register: Register, got: u8, expected: u8 },
    #[error("ICM-42688: an axis of the packet has no reading")]
    NoReading,
    /// The bytes from the FIFO are not a packet; the FIFO was emptied.
    #[error(transparent)]
    Packet(PacketError),
}

/// The driver of a configured sensor.
#[derive(Debug)]
pub struct Icm42688<SPI> {
    spi: SPI,
    config: Icm42688Config,
    next_check: usize,
    clock: Clock,
}

impl<SPI: SpiDevice> Icm42688<SPI> {
    /// Resets the sensor, checks its identity, configures it and reads every setting back.
    ///
    /// # Errors
    /// `Bus`, `Reset`, `Identity` or `Setting`.
    pub fn new(
        spi: SPI,
        config: Icm42688Config,
        delay: &mut impl DelayNs,
    ) -> Result<Self, Icm42688Error<SPI::Error>> {
        let mut part = Self { spi, config, next_check: 0, clock: Clock::default() };
        part.write(reg::BANK_SEL, 0)?;
        part.write(reg::DEVICE_CONFIG.address, reg::RESET)?;
        part.wait_for_reset(delay)?;
        let got = part.read(reg::WHO_AM_I.address)?;
        if got != reg::IDENTITY {
            return Err(Icm42688Error::Identity { got });
        }
        for Setting { register, mask, value } in config.settings() {
            part.in_bank(register, |part| {
                let held = part.read(register.address)?;
                part.write(register.address, held & !mask | value)
            })?;
        }
        delay.delay_ms(START_MS);
        for _ in 0..SETTINGS {
            part.check_next_setting()?;
        }
        part.flush()?;
        Ok(part)
    }

    /// Releases the SPI device.
    pub fn destroy(self) -> SPI {
        self.spi
    }

    /// Returns the oldest sample in the FIFO, if any, and checks one setting.
    ///
    /// # Errors
    /// `Bus`, `Setting`, `NoReading` or `Packet`.
    pub fn next_sample(&mut self) -> Result<Option<ImuSample>, Icm42688Error<SPI::Error>> {
        self.check_next_setting()?;
        let mut waiting = [0; 2];
        let address = [reg::FIFO_COUNTH.address | reg::READ];
        self.transaction(&mut [Operation::Write(&address), Operation::Read(&mut waiting)])?;
        if usize::from(u16::from_be_bytes(waiting)) < PACKET {
            return Ok(None);
        }
        let mut packet = [0; PACKET];
        let address = [reg::FIFO_DATA.address | reg::READ];
        self.transaction(&mut [Operation::Write(&address), Operation::Read(&mut packet)])?;
        match Packet::parse(&packet) {
            Ok(packet) => {
                let time = self.clock.unwrap(packet.time);
                packet.sample(time).map(Some).ok_or(Icm42688Error::NoReading)
            }
            Err(PacketError::Empty) => Ok(None),
            Err(error) => {
                self.flush()?;
                Err(Icm42688Error::Packet(error))
            }
        }
    }

    /// Checks one register of the configuration; each call checks the next one.
    fn check_next_setting(&mut self) -> Result<(), Icm42688Error<SPI::Error>> {
        let settings = self.config.settings();
        let Setting { register, mask, value: expected } = settings[self.next_check % SETTINGS];
        self.next_check = (self.next_check + 1) % SETTINGS;
        let got = self.in_bank(register, |part| part.read(register.address))? & mask;
        if got == expected { Ok(()) } else { Err(Icm42688Error::Setting { register, got, expected }) }
    }

    fn wait_for_reset(&mut self, delay: &mut impl DelayNs) -> Result<(), Icm42688Error<SPI::Error>> {
        for _ in 0..RESET_POLLS {
            delay.delay_ms(1);
            if self.read(reg::DEVICE_CONFIG.address)? & reg::RESET == 0 {
                return Ok(());
            }
        }
        Err(Icm42688Error::Reset)
    }

    fn flush(&mut self) -> Result<(), Icm42688Error<SPI::Error>> {
        self.write(reg::SIGNAL_PATH_RESET.address, reg::FIFO_FLUSH)
    }

    /// Runs an action in the bank of a register, and selects bank 0 again.
    fn in_bank<T>(
        &mut self,
        register: Register,
        act: impl FnOnce(&mut Self) -> Result<T, Icm42688Error<SPI::Error>>,
    ) -> Result<T, Icm42688Error<SPI::Error>> {
        if register.bank == 0 {
            return act(self);
        }
        self.write(reg::BANK_SEL, register.bank)?;
        let result = act(self);
        self.write(reg::BANK_SEL, 0)?;
        result
    }

    fn write(&mut self, address: u8, value: u8) -> Result<(), Icm42688Error<SPI::Error>> {
        self.transaction(&mut [Operation::Write(&[address, value])])
    }

    fn read(&mut self, address: u8) -> Result<u8, Icm42688Error<SPI::Error>> {
        let mut value = [0];
        self.transaction(&mut [Operation::Write(&[address | reg::READ]), Operation::Read(&mut value)])?;
        let [value] = value;
        Ok(value)
    }

    fn transaction(&mut self, operations: &mut [Operation<'_, u8>]) -> Result<(), Icm42688Error<SPI::Error>> {
        self.spi.transaction(operations).map_err(Icm42688Error::Bus)
    }
}
