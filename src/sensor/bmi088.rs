//! Reads the Bosch BMI088 over SPI (mode 0 or 3, at most 10 MHz): two dies, each with its own chip select.
//!
//! [`frame`] parses what the dies send without I/O, `registers` lists their registers. Every wait is a bounded number
//! of [`DelayNs`] delays. Each call for a sample also reads back one register, or the gyro's report of its own drive,
//! so that a reset, a flipped bit or a gyro that fails is detected within [`CHECKS`] calls.
//!
//! **Two dies on one time line.** Each die has its own oscillator, and the data sheet bounds neither. The gyro's
//! frames have no stamps: a sample's time is its number times 5 ms, a clock that [`crate::align::clock_ratio`]
//! measures. The accelerometer has the same nominal rate. A frame of the gyro with n newer ones behind it in the FIFO
//! goes with the acceleration that has n newer ones behind it: both FIFOs end now.
//!
//! | | what the second clock costs |
//! |---|---|
//! | in step | the force is up to 5 ms older than the rate, or newer by less than the time between two polls, and drifts through that |
//! | a difference of 2 % | every 50th force is used twice or left out |
//! | n frames behind | n times the difference more: 10 ms after a stall of 0.5 s at 2 % |
//!
//! A force that is older than [`OLDEST`] frames is not used ([`SpiError::NoReading`]).
//!
//! **A full FIFO** (100 frames of the gyro, 0.5 s) is emptied, with [`SpiError::Overflow`]. The accelerometer's time
//! counts the lost frames: each such gap is right within half a frame and the difference of the clocks. The gyro's
//! FIFO stops when full: in the mode that drops the oldest its axes have been seen to change places (ArduPilot's
//! history).

#[doc(hidden)]
pub mod frame;
mod registers;

use super::spi::{self, Chip, Setting, SpiError, passed};
use crate::sample::ImuSample;
use crate::units::Micros;
use embedded_hal::delay::DelayNs;
use embedded_hal::spi::SpiDevice;
use frame::{FORCE_FRAME, State};
use registers as reg;

/// Number of registers that are checked one after the other: those that are set, and the state of the gyro's drive.
pub const CHECKS: usize = reg::SETTINGS.len() + 1;
/// Samples after which the newest force is too old to go with a rate.
pub const OLDEST: u8 = 4;
/// Time in which both dies have restarted, ms: 30 of the gyro, 1 of the accelerometer.
const RESET_MS: u32 = 30;
/// Time between two writes to an accelerometer that may be suspended, ms.
const WRITE_MS: u32 = 1;
/// Time of an accelerometer after it was switched on, and of both filters after a change, ms.
const SETTLE_MS: u32 = 50;
/// Largest number of polls of the gyro's self-test, 1 ms apart.
const TEST_POLLS: u8 = 100;
/// Frames of the accelerometer that one call reads at most: more than come in [`SETTLE_MS`].
const MAX_FRAMES: usize = 16;

/// The driver of a configured sensor.
#[derive(Debug)]
pub struct Bmi088<SPI> {
    accelerometer: Chip<SPI>,
    gyro: Chip<SPI>,
    next_check: usize,
    number: u64,
    /// Number of a frame that was the newest one when it was read, and the accelerometer's time then.
    mark: Option<(u64, u32)>,
    has_lost: bool,
    /// Newest acceleration, and the samples that it has been used for.
    force: Option<([i16; 3], u8)>,
}

impl<SPI: SpiDevice> Bmi088<SPI> {
    /// Resets both dies, checks and configures them, in 0.15 s. The self-test, at rest, takes 0.1 s more.
    pub fn new(
        [accelerometer, gyro]: [SPI; 2],
        self_test: bool,
        delay: &mut impl DelayNs,
    ) -> Result<Self, SpiError<SPI::Error>> {
        let (accelerometer, gyro) =
            (Chip { spi: accelerometer, has_dummy: true }, Chip { spi: gyro, has_dummy: false });
        let (next_check, number, mark, has_lost, force) = (0, 0, None, false, None);
        let mut part = Self { accelerometer, gyro, next_check, number, mark, has_lost, force };
        // The rising edge of the chip select switches the accelerometer from I2C to SPI, now and after a reset.
        part.accelerometer.read::<1>(reg::CHIP_ID)?;
        delay.delay_ms(WRITE_MS);
        part.accelerometer.write(reg::ACC_SOFTRESET, reg::RESET)?;
        part.gyro.write(reg::GYRO_SOFTRESET, reg::RESET)?;
        delay.delay_ms(RESET_MS);
        part.accelerometer.read::<1>(reg::CHIP_ID)?;
        for (bank, expected) in (0..).zip(reg::IDENTITIES) {
            part.die(bank).identify(bank, reg::CHIP_ID, expected)?;
        }
        part.set(reg::POWER, delay)?;
        delay.delay_ms(SETTLE_MS);
        if self_test {
            part.test_gyro(delay)?;
            part.test_accelerometer(delay)?;
        }
        part.set(reg::SETTINGS, delay)?;
        delay.delay_ms(SETTLE_MS);
        for _ in 0..CHECKS {
            part.check_next()?;
        }
        // The accelerations of the wait stay, so that the first rate has one.
        part.empty_gyro()?;
        part.mark = Some((0, part.state()?.time));
        Ok(part)
    }

    /// Releases the SPI devices of accelerometer and gyro.
    pub fn destroy(self) -> [SPI; 2] {
        [self.accelerometer.spi, self.gyro.spi]
    }

    /// Returns the oldest sample in the FIFO, if any, and checks one register: an error is also a wrong setting, or a
    /// gyro whose drive is not in order.
    pub fn next_sample(&mut self) -> Result<Option<ImuSample>, SpiError<SPI::Error>> {
        self.check_next()?;
        let [status] = self.gyro.read(reg::GYRO_FIFO_STATUS)?;
        if status & reg::OVERRUN != 0 {
            self.has_lost = true;
            self.force = None;
            self.flush()?;
            return Err(SpiError::Overflow);
        }
        let Some(newer) = status.checked_sub(1) else { return Ok(None) };
        let state = self.state()?;
        let rate = spi::vector(&self.gyro.read(reg::GYRO_FIFO_DATA)?);
        self.count(newer, state.time);
        let force = self.force(state.bytes / FORCE_FRAME, newer)?.ok_or(SpiError::NoReading)?;
        let time = Micros(self.number * reg::PERIOD_US);
        frame::sample(time, force, rate, state.temperature).map(Some).ok_or(SpiError::NoReading)
    }

    /// Numbers a frame of the gyro that was read with `newer` ones behind it, at this time of the accelerometer.
    fn count(&mut self, newer: u8, now: u32) {
        self.number += 1;
        let newer = u64::from(newer);
        if core::mem::take(&mut self.has_lost)
            && let Some((number, then)) = self.mark
        {
            let since = (now.wrapping_sub(then) & frame::TIME_MASK) + reg::PERIOD_COUNTS / 2;
            let newest = number + u64::from(since / reg::PERIOD_COUNTS);
            self.number = self.number.max(newest.saturating_sub(newer));
        }
        if newer == 0 {
            self.mark = Some((self.number, now));
        }
    }

    /// Returns the acceleration with `newer` ones behind it, or the one before, of the frames that wait.
    fn force(&mut self, waiting: usize, newer: u8) -> Result<Option<[i16; 3]>, SpiError<SPI::Error>> {
        self.force = self.force.map(|(force, used)| (force, used.saturating_add(1)));
        let older = waiting.saturating_sub(newer.into());
        for _ in 0..older.min(MAX_FRAMES) {
            if let Some(force) = frame::acceleration(&self.accelerometer.read(reg::ACC_FIFO_DATA)?) {
                self.force = Some((force, 0));
            }
        }
        // A FIFO that was not emptied in time: these are old.
        if older > MAX_FRAMES {
            self.force = None;
        }
        Ok(self.force.filter(|(_, used)| *used <= OLDEST).map(|(force, _)| force))
    }

    fn state(&mut self) -> Result<State, SpiError<SPI::Error>> {
        Ok(State::parse(&self.accelerometer.read(reg::ACC_SENSORTIME)?))
    }

    fn check_next(&mut self) -> Result<(), SpiError<SPI::Error>> {
        let at = self.next_check % CHECKS;
        self.next_check = at + 1;
        let Some(setting) = reg::SETTINGS.get(at) else {
            let [state] = self.gyro.read(reg::GYRO_SELF_TEST)?;
            return passed(reg::GYRO, state & reg::RATE_OK != 0);
        };
        let [held] = self.die(setting.bank).read(setting.address)?;
        setting.check(held)
    }

    fn test_gyro(&mut self, delay: &mut impl DelayNs) -> Result<(), SpiError<SPI::Error>> {
        self.gyro.write(reg::GYRO_SELF_TEST, reg::TEST_BEGIN)?;
        for _ in 0..TEST_POLLS {
            delay.delay_ms(1);
            let [result] = self.gyro.read(reg::GYRO_SELF_TEST)?;
            if result & reg::TEST_READY != 0 {
                return passed(reg::GYRO, result & (reg::TEST_FAILED | reg::RATE_OK) == reg::RATE_OK);
            }
        }
        passed(reg::GYRO, false)
    }

    /// Deflects the accelerometer's masses both ways, and compares the difference with the least one of a good part.
    fn test_accelerometer(&mut self, delay: &mut impl DelayNs) -> Result<(), SpiError<SPI::Error>> {
        self.set(reg::TEST, delay)?;
        delay.delay_ms(2);
        let mut deflected = [[0; 3]; 2];
        for (way, read) in reg::DEFLECTIONS.into_iter().zip(&mut deflected) {
            self.accelerometer.write(reg::ACC_SELF_TEST, way)?;
            delay.delay_ms(SETTLE_MS + 1);
            *read = spi::vector(&self.accelerometer.read(reg::ACC_DATA)?);
        }
        self.accelerometer.write(reg::ACC_SELF_TEST, 0)?;
        delay.delay_ms(WRITE_MS);
        let [up, down] = deflected.map(|axes: [i16; 3]| axes.map(i32::from));
        let mut moved = up.iter().zip(down).zip(reg::LEAST_DEFLECTION);
        passed(reg::ACCELEROMETER, moved.all(|((up, down), least)| up - down >= least))
    }

    fn set(
        &mut self,
        settings: impl IntoIterator<Item = Setting>,
        delay: &mut impl DelayNs,
    ) -> Result<(), SpiError<SPI::Error>> {
        for Setting { bank, address, value, .. } in settings {
            self.die(bank).write(address, value)?;
            delay.delay_ms(WRITE_MS);
        }
        Ok(())
    }

    fn flush(&mut self) -> Result<(), SpiError<SPI::Error>> {
        self.accelerometer.write(reg::ACC_SOFTRESET, reg::FIFO_FLUSH)?;
        self.empty_gyro()
    }

    fn empty_gyro(&mut self) -> Result<(), SpiError<SPI::Error>> {
        self.gyro.write(reg::GYRO_FIFO_CONFIG_1, reg::STOP_WHEN_FULL)
    }

    fn die(&mut self, bank: u8) -> &mut Chip<SPI> {
        if bank == reg::GYRO { &mut self.gyro } else { &mut self.accelerometer }
    }
}
