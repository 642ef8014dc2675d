//! Reads the ST ASM330LHH over SPI (mode 0 or 3, at most 10 MHz).
//!
//! [`word`] parses the words of its FIFO without I/O, `registers` lists its registers, and this file does the SPI transfers.
//! Every wait is a bounded number of [`DelayNs`] delays. Each call for a sample also reads back one register of the
//! configuration, so that a reset or a flipped bit is detected within [`CHECKS`] calls.
//!
//! The sensor numbers and stamps its outputs. Rate, acceleration and time are used only together; where one is missing, or
//! the tag of a word is damaged, that output is left out and counted. A full FIFO (0.6 s) drops its oldest words, which is
//! reported once ([`SpiError::Overflow`]); the time stamps of the others stay right, so the gap is as long as it was.
//!
//! The maker has measured how fast each part's oscillator is, and the driver scales its time stamps by that
//! (INTERNAL_FREQ_FINE, steps of 0.15 %). What the oscillator drifts since is measured by [`crate::align::clock_ratio`].

mod registers;
#[doc(hidden)]
pub mod word;

use super::spi::{self, Chip, Setting, SpiError, passed};
use super::stamps::Stamps;
use crate::sample::ImuSample;
use core::num::NonZeroU64;
use embedded_hal::delay::DelayNs;
use embedded_hal::spi::SpiDevice;
use registers as reg;
use word::{Outputs, WORD, Word};

/// Number of registers that are checked one after the other.
pub const CHECKS: usize = reg::SETTINGS.len() + 1;
/// Time in which the gyro has started and the filters have settled, ms.
const SETTLE_MS: u32 = 100;
/// Outputs whose mean a self-test compares, and the time between two of them, ms.
const TEST_READINGS: i32 = 5;
const TEST_PERIOD_MS: u32 = 5;
/// Words that one call reads at most: two outputs, with their temperatures.
const MAX_WORDS: u16 = 8;

/// The driver of a configured sensor.
#[derive(Debug)]
pub struct Asm330lhh<SPI> {
    chip: Chip<SPI>,
    next_check: usize,
    outputs: Outputs,
    stamps: Stamps,
}

impl<SPI: SpiDevice> Asm330lhh<SPI> {
    /// Resets the sensor, checks and configures it, in 0.11 s. The self-test, at rest, takes 0.25 s more.
    pub fn new(spi: SPI, self_test: bool, delay: &mut impl DelayNs) -> Result<Self, SpiError<SPI::Error>> {
        let (chip, outputs) = (Chip { spi, has_dummy: false }, Outputs::default());
        let mut part =
            Self { chip, next_check: 0, outputs, stamps: Stamps::new(u32::MAX, 25, NonZeroU64::MIN) };
        part.chip.write(reg::CTRL3_C, reg::RESET)?;
        part.chip.wait_for_reset(reg::CTRL3_C, reg::RESETTING, delay)?;
        part.chip.identify(0, reg::WHO_AM_I, reg::IDENTITY)?;
        if self_test {
            part.test(delay)?;
        }
        part.set(reg::SETTINGS)?;
        delay.delay_ms(SETTLE_MS);
        // 25 us / (1 + 0.0015 fine), where 2000 + 3 fine is at least 1616.
        let [fine] = part.chip.read(reg::INTERNAL_FREQ_FINE)?;
        let per = 2_000_u64.saturating_add_signed(3 * i64::from(fine as i8));
        part.stamps = Stamps::new(u32::MAX, 50_000, NonZeroU64::new(per).unwrap_or(NonZeroU64::MIN));
        // The first sample of a start is to have a temperature: the bias depends on it.
        part.outputs.temperature = Some(i16::from_le_bytes(part.chip.read(reg::OUT_TEMP_L)?));
        // The FIFO was off, and begins empty.
        part.set([reg::FIFO])?;
        for _ in 0..CHECKS {
            part.check_next()?;
        }
        Ok(part)
    }

    /// Releases the SPI device.
    pub fn destroy(self) -> SPI {
        self.chip.spi
    }

    /// Returns the oldest sample in the FIFO, if any, and checks one setting.
    pub fn next_sample(&mut self) -> Result<Option<ImuSample>, SpiError<SPI::Error>> {
        self.check_next()?;
        let state = u16::from_le_bytes(self.chip.read(reg::FIFO_STATUS1)?);
        if state & reg::LOST != 0 {
            self.outputs.restart();
            return Err(SpiError::Overflow);
        }
        for _ in 0..(state & reg::WAITING).min(MAX_WORDS) {
            let bytes = self.chip.read::<WORD>(reg::FIFO_DATA_OUT_TAG)?;
            let word = Word::parse(&bytes).ok_or(SpiError::Packet { got: bytes[0] })?;
            if let Some(readings) = self.outputs.add(word).map_err(|_| SpiError::NoReading)? {
                let time = self.stamps.unwrap(readings.time);
                return readings.sample(time).map(Some).ok_or(SpiError::NoReading);
            }
        }
        Ok(None)
    }

    /// Checks one register of the configuration; each call checks the next one.
    fn check_next(&mut self) -> Result<(), SpiError<SPI::Error>> {
        let at = self.next_check % CHECKS;
        self.next_check = at + 1;
        let setting = *reg::SETTINGS.get(at).unwrap_or(&reg::FIFO);
        let [held] = self.chip.read(setting.address)?;
        setting.check(held)
    }

    /// Deflects the masses of both at once, unlike the application note; compares with a good part's limits.
    fn test(&mut self, delay: &mut impl DelayNs) -> Result<(), SpiError<SPI::Error>> {
        self.set(reg::TEST)?;
        let mut sums = [[[0; 3]; 2]; 2];
        for (deflect, sums) in [0, reg::DEFLECT].into_iter().zip(&mut sums) {
            self.chip.write(reg::CTRL5_C, deflect)?;
            delay.delay_ms(SETTLE_MS);
            for _ in 0..TEST_READINGS {
                delay.delay_ms(TEST_PERIOD_MS);
                for (address, sum) in [reg::OUTX_L_G, reg::OUTX_L_A].into_iter().zip(&mut *sums) {
                    let axes = spi::vector(&self.chip.read(address)?);
                    sum.iter_mut().zip(axes).for_each(|(sum, reading)| *sum += i32::from(reading));
                }
            }
        }
        self.chip.write(reg::CTRL5_C, 0)?;
        let [rest, deflected]: [[[i32; 3]; 2]; 2] = sums;
        let mut sensors = rest.iter().zip(deflected).zip([reg::RATE_CHANGE, reg::FORCE_CHANGE]);
        passed(
            0,
            sensors.all(|((rest, moved), limits)| {
                rest.iter()
                    .zip(moved)
                    .all(|(rest, moved)| limits.contains(&((moved - rest).abs() / TEST_READINGS)))
            }),
        )
    }

    fn set(&mut self, settings: impl IntoIterator<Item = Setting>) -> Result<(), SpiError<SPI::Error>> {
        settings.into_iter().try_for_each(|Setting { address, value, .. }| self.chip.write(address, value))
    }
}
