//! The configured inertial sensor: an MTi on USART1, or an ICM-42688-P, a BMI088 or an ASM330LHH on SPI1.
//!
//! Idle brings up the part on SPI and passes it to the output task through [`READY`] ([`gyronet::service::spi_imu`]).
#![allow(unsafe_code, reason = "rings with one task at each end; each block names them")]

use crate::ring::Ring;
use crate::stm32f405::spi::Spi;
use crate::stm32f405::timer;
use crate::{serial, tasks};
use core::sync::atomic::{AtomicU16, Ordering};
use embedded_hal::delay::DelayNs;
use gyronet::sample::ImuSample;
use gyronet::sensor::Source;
use gyronet::sensor::xsens::{Mti, XsensError};
use gyronet::service::event::SensorFault;
use gyronet::service::spi_imu::{self, Part, Reader, Wanted};
use gyronet::store::ImuPart;

/// Bytes of a line that one step of the output task processes: as many as the ring can hold.
pub const BYTES_PER_STEP: usize = serial::RECEIVED;
/// Bytes that a poll of the part on SPI counts as: four polls per step.
const BYTES_PER_POLL: usize = BYTES_PER_STEP / 4;

static READY: Ring<Part<Spi>, 1> =
    // SAFETY: idle writes, the output task reads.
    unsafe { Ring::new() };
/// Messages without a sample before the reason is reported: an MTi acknowledges commands in single ones.
const REFUSED: u8 = 20;
/// Why the MTi gives no samples: 0, one of these, or the second with the message's identifier.
static REASON: AtomicU16 = AtomicU16::new(0);
const SELF_TEST: u16 = 1;
const FOREIGN: u16 = 0x100;
static WANTED: Wanted = Wanted::start();

/// The output task's end of the sensor.
#[allow(clippy::large_enum_variant, reason = "no heap to put the large one on; there is one of them")]
pub enum Imu {
    Line(serial::Port, Mti, u8),
    Spi(Reader<Spi>),
}

impl Imu {
    /// Returns the output task's end of the configured part. A configuration names only parts that the image
    /// supports.
    #[inline]
    pub fn new(part: ImuPart, line: serial::Port) -> Self {
        if part == ImuPart::XsensMti {
            Self::Line(line, Mti::new(), 0)
        } else {
            Self::Spi(Reader::new(&WANTED, timer::micros, || READY.pop()))
        }
    }

    /// Returns whether [`Self::next_sample`] has bytes to work on: the part of a message on the line waits in the ring.
    pub fn has_input(&self) -> bool {
        match self {
            Self::Line(port, mti, _) => port.waiting() >= mti.missing(),
            Self::Spi(_) => true,
        }
    }

    /// Has the line wake the tick once the bytes that are missing have come, and returns whether the tick can wait for
    /// that: not if they are there, nor for a part on SPI, which is polled.
    pub fn arm_wake_up(&self) -> bool {
        if let Self::Line(port, mti, _) = self {
            port.want(mti.missing());
        }
        !self.has_input()
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
                part.next_sample().map(|sample| sample.map_err(drop))
            }
        }
    }

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

/// Idle's end of a part on SPI: brings the part up.
pub struct BringUp(spi_imu::BringUp<Spi>);

impl BringUp {
    pub fn new(part: ImuPart, spi: Option<[Spi; 2]>) -> Option<Self> {
        spi_imu::BringUp::new(part, spi, &WANTED).map(Self)
    }

    /// Tries to bring the part up, if it is wanted and the last attempt is long enough ago.
    pub fn step(&mut self) -> Option<Result<(), SensorFault>> {
        // There is room: the part is wanted only after the previous one was taken.
        self.0.step(timer::milliseconds(), &mut Delay, |part| _ = READY.push(part))
    }
}

/// Delays by the board's clock. Idle counts as running meanwhile, because the wait is bounded.
struct Delay;

impl DelayNs for Delay {
    fn delay_ns(&mut self, ns: u32) {
        tasks::wait(u64::from(ns.div_ceil(1_000)) + 1, || {
            tasks::report(tasks::Task::Idle);
            false
        });
    }
}
