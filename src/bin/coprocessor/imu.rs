//! The configured inertial sensor: an MTi on USART1, or an ICM-42688-P, a BMI088 or an ASM330LHH on SPI1.
//!
//! Idle brings up the part on SPI, because that takes up to 0.4 s, and retries every second while the part does not answer.
//! It then passes the part to the output task through [`READY`]; [`WANTED`] says which of the two may use the bus.
#![allow(unsafe_code, reason = "rings with one task at each end; each block names them")]

use crate::ring::Ring;
use crate::stm32f405::spi::Spi;
use crate::stm32f405::timer;
use crate::{output, serial};
use core::sync::atomic::{AtomicBool, AtomicU16, Ordering};
use embedded_hal::delay::DelayNs;
use gyronet::sample::{ImuSample, PERIOD_US};
use gyronet::sensor::Source;
use gyronet::sensor::asm330lhh::Asm330lhh;
use gyronet::sensor::bmi088::Bmi088;
use gyronet::sensor::icm42688::Icm42688;
use gyronet::sensor::spi::SpiError;
use gyronet::sensor::xsens::{Mti, XsensError};
use gyronet::service::event::SensorFault;
use gyronet::store::ImuPart;
use gyronet::units::Micros;

/// Bytes of a line that one step of the output task processes: as many as the ring can hold.
pub const BYTES_PER_STEP: usize = serial::RECEIVED;
/// Bytes that a poll of the part on SPI counts as: four polls per step.
const BYTES_PER_POLL: usize = BYTES_PER_STEP / 4;
/// Interval between attempts to bring up the part, ms.
const RETRY_MS: u32 = 1_000;
/// Time after which a part that answers and has no sample is brought up again, microseconds.
const SILENT_US: u64 = 1_000_000;

/// A part on SPI.
enum Part {
    Icm(Icm42688<Spi>),
    Bmi(Bmi088<Spi>),
    Asm(Asm330lhh<Spi>),
}

impl Part {
    /// Brings the part up. All but the ICM-42688-P test themselves if they are to, which takes up to 0.3 s and is best done
    /// at rest.
    fn new(part: ImuPart, [first, second]: [Spi; 2], self_test: bool) -> Result<Self, SensorFault> {
        match part {
            ImuPart::Bmi088 => Bmi088::new([first, second], self_test, &mut Delay).map(Self::Bmi),
            ImuPart::Asm330lhh => Asm330lhh::new(first, self_test, &mut Delay).map(Self::Asm),
            _ => Icm42688::new(first, &mut Delay).map(Self::Icm),
        }
        .map_err(fault)
    }

    /// Returns the next sample; `Err(true)` if the part must be brought up again.
    fn next_sample(&mut self) -> Option<Result<ImuSample, bool>> {
        let sample = match self {
            Self::Icm(part) => Source::next_sample(part),
            Self::Bmi(part) => Source::next_sample(part),
            Self::Asm(part) => Source::next_sample(part),
        };
        sample.map(|sample| sample.map_err(|error| error.is_lost()))
    }
}

static READY: Ring<Part, 1> =
    // SAFETY: idle writes, the output task reads.
    unsafe { Ring::new() };
/// Messages without a sample before the reason is reported: an MTi acknowledges commands in single ones.
const REFUSED: u8 = 20;
/// Why the MTi gives no samples: 0, one of these, or the second with the message's identifier.
static REASON: AtomicU16 = AtomicU16::new(0);
const SELF_TEST: u16 = 1;
const FOREIGN: u16 = 0x100;
static WANTED: AtomicBool = AtomicBool::new(true);

/// The output task's end of the sensor.
#[allow(clippy::large_enum_variant, reason = "no heap to put the large one on; there is one of them")]
pub enum Imu {
    Line(serial::Port, Mti, u8),
    Spi(SpiPart),
}

impl Imu {
    /// Returns the output task's end of the configured part. A configuration names only parts that the image
    /// supports.
    #[inline]
    pub fn new(part: ImuPart, line: serial::Port) -> Self {
        if part == ImuPart::XsensMti {
            Self::Line(line, Mti::new(), 0)
        } else {
            Self::Spi(SpiPart::default())
        }
    }

    /// Returns whether [`Self::next_sample`] has bytes to work on: the part of a message on the line waits in the ring.
    pub fn has_input(&self) -> bool {
        match self {
            Self::Line(port, mti, _) => port.waiting() >= mti.missing(),
            Self::Spi(_) => true,
        }
    }

    /// Returns the next sample, or an error for a damaged one; `None` if nothing is waiting or this step has used up
    /// its `budget` of bytes.
    pub fn next_sample(&mut self, budget: &mut usize) -> Option<Result<ImuSample, ()>> {
        match self {
            Self::Line(port, mti, refused) => loop {
                if let Some(sample) = mti.next_sample() {
                    note(refused, sample.as_ref().err());
                    return Some(sample.map_err(drop));
                }
                let accepted = mti.receive_some(port.received());
                if accepted == 0 {
                    return None;
                }
                port.consume(accepted);
                *budget = budget.checked_sub(accepted)?;
            },
            Self::Spi(part) => {
                *budget = budget.checked_sub(BYTES_PER_POLL)?;
                part.poll()
            }
        }
    }

    /// Returns the number of bytes that were damaged or lost.
    pub fn lost(&self) -> u32 {
        match self {
            Self::Line(port, ..) => port.lost(),
            Self::Spi(_) => 0,
        }
    }
}

/// Counts messages in a row that gave no sample, and reports the newest reason from [`REFUSED`] of them on.
fn note(refused: &mut u8, error: Option<&XsensError>) {
    *refused = if error.is_some() { refused.saturating_add(1) } else { 0 };
    let reason = match error {
        Some(XsensError::SelfTest) => SELF_TEST,
        Some(XsensError::Foreign { mid }) => FOREIGN | u16::from(*mid),
        _ => 0,
    };
    if *refused == 0 || *refused >= REFUSED {
        REASON.store(reason, Ordering::Relaxed);
    }
}

/// Returns why the MTi gives no samples, by its own messages.
pub fn refusal() -> Option<SensorFault> {
    match REASON.load(Ordering::Relaxed) {
        SELF_TEST => Some(SensorFault::SelfTest),
        reason if reason & FOREIGN != 0 => Some(SensorFault::Foreign(reason as u8)),
        _ => None,
    }
}

/// The part on SPI, as the output task reads it.
///
/// The part's clock starts at 0 with each reset of the part, so the first sample after a reset would be older than
/// the newest one before. That sample is placed on the sensor's grid instead, as many periods after the newest one as
/// the board's clock has counted.
#[derive(Default)]
pub struct SpiPart {
    /// `None` until the part is brought up.
    part: Option<Part>,
    /// Board time of the newest sample, or of the bring-up.
    heard: u64,
    /// True until the first sample after the part was brought up.
    is_fresh: bool,
    /// Time that is added to the part's clock, microseconds.
    offset: u64,
    /// Time of the newest sample, and the board time of its arrival.
    newest: Option<(Micros, u64)>,
}

impl SpiPart {
    #[inline(never)]
    fn poll(&mut self) -> Option<Result<ImuSample, ()>> {
        if self.part.is_none() {
            self.part = READY.pop();
            self.is_fresh = true;
            self.heard = timer::micros();
        }
        let Some(sample) = self.part.as_mut()?.next_sample() else {
            if timer::micros().saturating_sub(self.heard) > SILENT_US {
                self.give_back();
            }
            return None;
        };
        match sample {
            Ok(sample) => Some(Ok(self.placed(sample))),
            Err(is_lost) => {
                if is_lost {
                    self.give_back();
                }
                Some(Err(()))
            }
        }
    }

    /// Lets idle bring the part up again.
    fn give_back(&mut self) {
        self.part = None;
        WANTED.store(true, Ordering::Release);
    }

    /// Returns the sample with a time that continues across a reset of the part.
    fn placed(&mut self, sample: ImuSample) -> ImuSample {
        let now = timer::micros();
        if let (true, Some((newest, arrived))) = (core::mem::take(&mut self.is_fresh), self.newest) {
            let steps = (now.saturating_sub(arrived) + PERIOD_US / 2) / PERIOD_US;
            self.offset = (newest.0 + steps.max(1) * PERIOD_US).wrapping_sub(sample.time.0);
        }
        let time = Micros(sample.time.0.wrapping_add(self.offset));
        (self.newest, self.heard) = (Some((time, now)), now);
        ImuSample { time, ..sample }
    }
}

/// Idle's end of a part on SPI: brings the part up.
pub struct BringUp {
    part: ImuPart,
    spi: [Spi; 2],
    tried: Option<u32>,
    /// True once the part was up: it is not tested again, because the vehicle may move.
    is_tested: bool,
}

impl BringUp {
    /// Returns idle's end if such a part is configured.
    pub fn new(part: ImuPart, spi: Option<[Spi; 2]>) -> Option<Self> {
        spi.filter(|_| part != ImuPart::XsensMti).map(|spi| Self { part, spi, tried: None, is_tested: false })
    }

    /// Tries to bring the part up, if it is wanted and the last attempt is long enough ago.
    #[inline(never)]
    pub fn step(&mut self) -> Option<Result<(), SensorFault>> {
        let now = timer::milliseconds();
        let soon = |tried: u32| now.wrapping_sub(tried) < RETRY_MS;
        if !WANTED.load(Ordering::Acquire) || self.tried.is_some_and(soon) {
            return None;
        }
        self.tried = Some(now);
        let part = match Part::new(self.part, self.spi, !self.is_tested) {
            Ok(part) => part,
            Err(fault) => return Some(Err(fault)),
        };
        self.is_tested = true;
        WANTED.store(false, Ordering::Release);
        // There is room: the part is wanted only after the previous one was taken.
        let _ = READY.push(part);
        Some(Ok(()))
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

/// Delays by the board's clock. Idle counts as running meanwhile, because the wait is bounded.
struct Delay;

impl DelayNs for Delay {
    fn delay_ns(&mut self, ns: u32) {
        output::wait(u64::from(ns.div_ceil(1_000)) + 1, || {
            output::report(output::Task::Idle);
            false
        });
    }
}
