//! Reads the TDK ICM-42688-P over SPI (mode 0 or 3, at most 24 MHz).
//!
//! [`packet`] parses its FIFO without I/O, [`registers`] lists its registers. Every wait is a bounded number of
//! [`DelayNs`] delays. Each call for a sample also reads back one register, so that a reset or a flipped bit is
//! detected within [`CHECKS`] calls.

#[doc(hidden)]
pub mod packet;
#[doc(hidden)]
pub mod registers;

use super::spi::{Chip, Setting, SpiError};
use super::stamps::Stamps;
use crate::sample::ImuSample;
use core::num::NonZeroU64;
use embedded_hal::delay::DelayNs;
use embedded_hal::spi::SpiDevice;
use packet::{PACKET, Packet, PacketError};
use registers as reg;

/// Number of registers that are set, and checked one after the other.
pub const CHECKS: usize = reg::SETTINGS.len();
/// Start-up time of the gyro until its readings are valid, ms.
const START_MS: u32 = 45;
/// Without a clock on CLKIN the sensor counts in units of 32/30 us, although TMST_RES is 1 us (DS-000347, 12.7): the 10 ms
/// between two samples at 100 Hz are 9,375 counts. The counter wraps every 69.9 ms.
const STAMPS: Stamps = Stamps::new(0xFFFF, 16, NonZeroU64::new(15).unwrap());

/// The driver of a configured sensor.
#[derive(Debug)]
pub struct Icm42688<SPI> {
    chip: Chip<SPI>,
    next_check: usize,
    stamps: Stamps,
}

impl<SPI: SpiDevice> Icm42688<SPI> {
    /// Resets the sensor, checks its identity, configures it and reads every setting back.
    pub fn new(spi: SPI, delay: &mut impl DelayNs) -> Result<Self, SpiError<SPI::Error>> {
        let chip = Chip { spi, has_dummy: false };
        let mut part = Self { chip, next_check: 0, stamps: STAMPS };
        part.chip.write(reg::BANK_SEL, 0)?;
        part.chip.write(reg::DEVICE_CONFIG, reg::RESET)?;
        part.chip.wait_for_reset(reg::DEVICE_CONFIG, reg::RESET, delay)?;
        part.chip.identify(0, reg::WHO_AM_I, reg::IDENTITY)?;
        for Setting { bank, address, mask, value } in reg::SETTINGS {
            part.in_bank(bank, |chip| {
                let [held] = chip.read(address)?;
                chip.write(address, held & !mask | value)
            })?;
        }
        delay.delay_ms(START_MS);
        for _ in 0..CHECKS {
            part.check_next_setting()?;
        }
        part.flush()?;
        Ok(part)
    }

    /// Releases the SPI device.
    pub fn destroy(self) -> SPI {
        self.chip.spi
    }

    /// Returns the oldest sample in the FIFO, if any, and checks one setting.
    pub fn next_sample(&mut self) -> Result<Option<ImuSample>, SpiError<SPI::Error>> {
        self.check_next_setting()?;
        let waiting = u16::from_be_bytes(self.chip.read(reg::FIFO_COUNTH)?);
        if usize::from(waiting) < PACKET {
            return Ok(None);
        }
        match Packet::parse(&self.chip.read::<PACKET>(reg::FIFO_DATA)?) {
            Ok(packet) => {
                let time = self.stamps.unwrap(packet.time.into());
                packet.sample(time).map(Some).ok_or(SpiError::NoReading)
            }
            Err(PacketError::Empty) => Ok(None),
            Err(PacketError::Header { got }) => {
                self.flush()?;
                Err(SpiError::Packet { got })
            }
        }
    }

    /// Checks one register of the configuration; each call checks the next one.
    fn check_next_setting(&mut self) -> Result<(), SpiError<SPI::Error>> {
        let setting = reg::SETTINGS[self.next_check % CHECKS];
        self.next_check = (self.next_check + 1) % CHECKS;
        let [held] = self.in_bank(setting.bank, |chip| chip.read(setting.address))?;
        setting.check(held)
    }

    fn flush(&mut self) -> Result<(), SpiError<SPI::Error>> {
        self.chip.write(reg::SIGNAL_PATH_RESET, reg::FIFO_FLUSH)
    }

    /// Runs an action in a bank, and selects bank 0 again.
    fn in_bank<T>(
        &mut self,
        bank: u8,
        act: impl FnOnce(&mut Chip<SPI>) -> Result<T, SpiError<SPI::Error>>,
    ) -> Result<T, SpiError<SPI::Error>> {
        if bank == 0 {
            return act(&mut self.chip);
        }
        self.chip.write(reg::BANK_SEL, bank)?;
        let result = act(&mut self.chip);
        self.chip.write(reg::BANK_SEL, 0)?;
        result
    }
}
