//! An inertial sensor on SPI as a board's tasks use it: one brings it up, which takes up to 0.4 s and is repeated every second
//! while the part does not answer; another one reads it.
//!
//! The tasks pass the part on themselves. [`Wanted`] says which of the two may use the bus.

use super::event::SensorFault;
use crate::sample::{ImuSample, PERIOD_US};
use crate::sensor::Source;
use crate::sensor::asm330lhh::Asm330lhh;
use crate::sensor::bmi088::Bmi088;
use crate::sensor::icm42688::Icm42688;
use crate::sensor::spi::SpiError;
use crate::store::ImuPart;
use crate::units::Micros;
use core::sync::atomic::{AtomicBool, Ordering};
use embedded_hal::delay::DelayNs;
use embedded_hal::spi::{ErrorKind, SpiDevice};

/// Interval between attempts to bring up the part, ms.
const RETRY_MS: u32 = 1_000;
/// Time after which a part that answers and has no sample is brought up again, microseconds.
const SILENT_US: u64 = 1_000_000;

/// Says whether the part is to be brought up. Whoever brings it up has the bus while it stands, the reading task else.
#[derive(Debug)]
pub struct Wanted(AtomicBool);

impl Wanted {
    pub const fn start() -> Self {
        Self(AtomicBool::new(true))
    }
}

#[derive(Debug)]
#[allow(missing_docs, reason = "their types say it")]
pub enum Part<SPI> {
    Icm(Icm42688<SPI>),
    Bmi(Bmi088<SPI>),
    Asm(Asm330lhh<SPI>),
}

impl<SPI: SpiDevice> Part<SPI> {
    /// Brings the part up; all but the ICM-42688-P may test themselves, in up to 0.3 s, best at rest.
    fn new(
        part: ImuPart,
        [first, second]: [SPI; 2],
        self_test: bool,
        delay: &mut impl DelayNs,
    ) -> Result<Self, SensorFault> {
        match part {
            ImuPart::Bmi088 => Bmi088::new([first, second], self_test, delay).map(Self::Bmi),
            ImuPart::Asm330lhh => Asm330lhh::new(first, self_test, delay).map(Self::Asm),
            _ => Icm42688::new(first, delay).map(Self::Icm),
        }
        .map_err(fault)
    }

    fn next_sample(&mut self) -> Option<Result<ImuSample, SpiError<SPI::Error>>> {
        match self {
            Self::Icm(part) => Source::next_sample(part),
            Self::Bmi(part) => Source::next_sample(part),
            Self::Asm(part) => Source::next_sample(part),
        }
    }
}

/// The reading task's end. Each reset starts the part's clock at 0, so the first sample after it is placed on the
/// sensor's grid, as many periods after the newest one as the board's clock has counted.
#[derive(Debug)]
pub struct Reader<SPI> {
    wanted: &'static Wanted,
    now: fn() -> u64,
    passed: fn() -> Option<Part<SPI>>,
    part: Option<Part<SPI>>,
    /// Board time of the newest sample, or of the bring-up.
    heard: u64,
    /// True until the first sample after the part was brought up.
    is_fresh: bool,
    offset: u64,
    /// Time of the newest sample, and the board time of its arrival.
    newest: Option<(Micros, u64)>,
}

impl<SPI: SpiDevice> Reader<SPI> {
    /// Creates the end of a part that is not up, with the board time in microseconds and the part that was brought up.
    pub const fn new(wanted: &'static Wanted, now: fn() -> u64, passed: fn() -> Option<Part<SPI>>) -> Self {
        Self { wanted, now, passed, part: None, heard: 0, is_fresh: false, offset: 0, newest: None }
    }

    /// Returns the sample with a time that continues across a reset of the part.
    fn placed(&mut self, sample: ImuSample, now: u64) -> ImuSample {
        if let (true, Some((newest, arrived))) = (core::mem::take(&mut self.is_fresh), self.newest) {
            let steps = (now.saturating_sub(arrived) + PERIOD_US / 2) / PERIOD_US;
            self.offset = (newest.0 + steps.max(1) * PERIOD_US).wrapping_sub(sample.time.0);
        }
        let time = Micros(sample.time.0.wrapping_add(self.offset));
        (self.newest, self.heard) = (Some((time, now)), now);
        ImuSample { time, ..sample }
    }
}

impl<SPI: SpiDevice> Source for Reader<SPI> {
    type Sample = ImuSample;
    type Error = SpiError<SPI::Error>;

    #[inline(never)]
    fn next_sample(&mut self) -> Option<Result<ImuSample, Self::Error>> {
        let now = (self.now)();
        if self.part.is_none() {
            self.part = (self.passed)();
            self.is_fresh = true;
            self.heard = now;
        }
        let sample = self.part.as_mut()?.next_sample();
        let is_lost = match &sample {
            None => now.saturating_sub(self.heard) > SILENT_US,
            Some(Err(error)) => error.is_lost(),
            Some(Ok(_)) => false,
        };
        if is_lost {
            self.part = None;
            self.wanted.0.store(true, Ordering::Release);
        }
        sample.map(|sample| sample.map(|sample| self.placed(sample, now)))
    }
}

/// The configured sensor: on a line, or on SPI.
#[derive(Debug)]
#[allow(missing_docs, reason = "their types say it")]
pub enum Imu<LINE, SPI> {
    Line(LINE),
    Spi(Reader<SPI>),
}

impl<LINE: Source<Sample = ImuSample>, SPI: SpiDevice<Error = ErrorKind>> Source for Imu<LINE, SPI> {
    type Sample = ImuSample;
    type Error = SpiError<ErrorKind>;

    fn next_sample(&mut self) -> Option<Result<ImuSample, Self::Error>> {
        match self {
            Self::Line(line) => Some(line.next_sample()?.map_err(|_| SpiError::Bus(ErrorKind::Other))),
            Self::Spi(part) => part.next_sample(),
        }
    }
}

/// The end of the task that brings the part up.
#[derive(Debug)]
pub struct BringUp<SPI> {
    wanted: &'static Wanted,
    part: ImuPart,
    spi: [SPI; 2],
    tried: Option<u32>,
    /// True once the part was up: it is not tested again, because the vehicle may move.
    is_tested: bool,
}

impl<SPI: SpiDevice + Copy> BringUp<SPI> {
    pub fn new(part: ImuPart, spi: Option<[SPI; 2]>, wanted: &'static Wanted) -> Option<Self> {
        let spi = spi.filter(|_| part != ImuPart::XsensMti)?;
        Some(Self { wanted, part, spi, tried: None, is_tested: false })
    }

    /// Brings the part up if wanted and long enough after the last attempt, and passes it on; `now` in ms.
    #[inline(never)]
    pub fn step(
        &mut self,
        now: u32,
        delay: &mut impl DelayNs,
        pass: impl FnOnce(Part<SPI>),
    ) -> Option<Result<(), SensorFault>> {
        let soon = |tried: u32| now.wrapping_sub(tried) < RETRY_MS;
        if !self.wanted.0.load(Ordering::Acquire) || self.tried.is_some_and(soon) {
            return None;
        }
        self.tried = Some(now);
        Some(Part::new(self.part, self.spi, !self.is_tested, delay).map(|part| {
            self.is_tested = true;
            self.wanted.0.store(false, Ordering::Release);
            pass(part);
        }))
    }
}

fn fault<E>(error: SpiError<E>) -> SensorFault {
    match error {
        SpiError::Reset => SensorFault::Reset,
        SpiError::Identity { got, .. } => SensorFault::Identity(got),
        SpiError::SelfTest { .. } => SensorFault::SelfTest,
        SpiError::Setting { bank, address, got, .. } => SensorFault::Setting { bank, address, got },
        _ => SensorFault::Bus,
    }
}
