//! The inertial sensor that is configured: an MTi on USART1, or an ICM-42688-P on SPI1.
//!
//! The part on SPI is brought up in idle time, for that takes it 50 ms, and again every second
//! for as long as it does not answer. Between the two ends it is handed over through [`READY`];
//! [`WANTED`] says whose turn it is with the bus.
#![allow(unsafe_code, reason = "rings with one task at each end; each block names them")]

use crate::ring::Ring;
use crate::stm32f405::spi::Spi;
use crate::stm32f405::timer;
use crate::{board, serial};
use core::sync::atomic::{AtomicBool, Ordering};
use embedded_hal::delay::DelayNs;
use gyronet::health::supervisor::Task;
use gyronet::sample::{ImuSample, PERIOD_US};
use gyronet::sensor::icm42688::packet::Resolution;
use gyronet::sensor::icm42688::{Bandwidth, Icm42688, Icm42688Config, Icm42688Error, OutputRate};
use gyronet::sensor::xsens::Mti;
use gyronet::service::event::SensorFault;
use gyronet::store::ImuPart;
use gyronet::units::Micros;

/// Bytes of a line in one turn: all that can wait.
pub const TURN: usize = serial::RECEIVED;
/// The bytes that a look at the part on SPI counts as: four looks a turn.
const LOOK: usize = TURN / 4;
/// The part is brought up again after this time, if an attempt fails.
const RETRY_MS: u32 = 1_000;
/// Looks at the time before a delay is given up, should it stand still: a millisecond has some ten
/// thousand.
const LOOKS_PER_MS: u32 = 1_000_000;

const ICM: Icm42688Config = Icm42688Config {
    rate: OutputRate::Hz100,
    bandwidth: Bandwidth::Sixteenth,
    resolution: Resolution::Bits20,
};

type Part = Icm42688<Spi>;

static READY: Ring<Part, 1> =
    // SAFETY: idle writes, the output task reads.
    unsafe { Ring::new() };
static WANTED: AtomicBool = AtomicBool::new(true);

/// The output task's end.
#[allow(clippy::large_enum_variant, reason = "no heap to put the large one on; there is one of them")]
pub enum Imu {
    Line(serial::Port, Mti),
    Spi(SpiPart),
}

impl Imu {
    /// Returns the end of the part that is configured. A configuration names only parts that the image drives.
    #[inline]
    pub fn new(part: ImuPart, line: serial::Port) -> Self {
        if part == ImuPart::Icm42688 { Self::Spi(SpiPart::default()) } else { Self::Line(line, Mti::new()) }
    }

    /// Returns the next sample, or an error where one was due and is damaged; `None` when nothing waits or the turn is
    /// over.
    pub fn next_sample(&mut self, turn: &mut usize) -> Option<Result<ImuSample, ()>> {
        match self {
            Self::Line(port, mti) => loop {
                if let Some(sample) = mti.next_sample() {
                    return Some(sample.map_err(drop));
                }
                let taken = mti.receive_some(port.received());
                if taken == 0 {
                    return None;
                }
                port.consume(taken);
                *turn = turn.checked_sub(taken)?;
            },
            Self::Spi(part) => {
                *turn = turn.checked_sub(LOOK)?;
                part.look()
            }
        }
    }

    /// Returns the numbers of bytes that came damaged and of bytes that had to wait.
    pub fn line_faults(&self) -> [u32; 2] {
        match self {
            Self::Line(port, _) => [port.lost(), port.held()],
            Self::Spi(_) => [0; 2],
        }
    }
}

/// Reads the part on SPI.
///
/// Its clock begins at 0 with each reset of the part, so the first sample after one would be older than the newest one
/// before. It is placed on the sensor's grid instead, as many steps after that one as the board's clock has counted.
#[derive(Default)]
pub struct SpiPart {
    /// `None`: not brought up.
    part: Option<Part>,
    /// No sample has come since the part was brought up.
    is_fresh: bool,
    /// The time that is added to the part's clock, microseconds.
    offset: u64,
    /// The newest sample's time, and the board's time at which it came.
    newest: Option<(Micros, u64)>,
}

impl SpiPart {
    /// Looks whether there is a sample.
    #[inline(never)]
    fn look(&mut self) -> Option<Result<ImuSample, ()>> {
        if self.part.is_none() {
            self.part = READY.pop();
            self.is_fresh = true;
        }
        match self.part.as_mut()?.next_sample().transpose()? {
            Ok(sample) => Some(Ok(self.placed(sample))),
            Err(Icm42688Error::Packet(_) | Icm42688Error::NoReading) => Some(Err(())),
            // It must be set up again.
            Err(_) => {
                self.part = None;
                WANTED.store(true, Ordering::Release);
                Some(Err(()))
            }
        }
    }

    /// Returns the sample with a time that goes on from before the part's last reset.
    fn placed(&mut self, sample: ImuSample) -> ImuSample {
        let now = timer::micros();
        if let (true, Some((newest, came))) = (core::mem::take(&mut self.is_fresh), self.newest) {
            let steps = (now.saturating_sub(came) + PERIOD_US / 2) / PERIOD_US;
            self.offset = (newest.0 + steps.max(1) * PERIOD_US).wrapping_sub(sample.time.0);
        }
        let time = Micros(sample.time.0.wrapping_add(self.offset));
        self.newest = Some((time, now));
        ImuSample { time, ..sample }
    }
}

/// Idle's end of a part on SPI.
pub struct BringUp {
    spi: Spi,
    tried: Option<u32>,
}

impl BringUp {
    /// Returns idle's end where such a part is configured.
    pub fn new(part: ImuPart, spi: Spi) -> Option<Self> {
        (part == ImuPart::Icm42688).then_some(Self { spi, tried: None })
    }

    /// Tries to bring the part up, where it is not and it is time to.
    #[inline(never)]
    pub fn turn(&mut self) -> Option<Result<(), SensorFault>> {
        let now = timer::milliseconds();
        let soon = |tried: u32| now.wrapping_sub(tried) < RETRY_MS;
        if !WANTED.load(Ordering::Acquire) || self.tried.is_some_and(soon) {
            return None;
        }
        self.tried = Some(now);
        let part = match Icm42688::new(self.spi, ICM, &mut Delay) {
            Ok(part) => part,
            Err(error) => return Some(Err(fault(error))),
        };
        WANTED.store(false, Ordering::Release);
        // There is room: the part before was taken, or this one would not be wanted.
        let _ = READY.push(part);
        Some(Ok(()))
    }
}

fn fault<E>(error: Icm42688Error<E>) -> SensorFault {
    match error {
        Icm42688Error::Reset => SensorFault::Reset,
        Icm42688Error::Identity { got } => SensorFault::Identity(got),
        Icm42688Error::Setting { register, got, .. } => {
            SensorFault::Setting { bank: register.bank, address: register.address, got }
        }
        _ => SensorFault::Bus,
    }
}

/// Waits by the board's clock. Idle counts as running meanwhile: the wait is bounded.
struct Delay;

impl DelayNs for Delay {
    fn delay_ns(&mut self, ns: u32) {
        let until = timer::micros() + u64::from(ns.div_ceil(1_000)) + 1;
        let over = |_| {
            board::SUPERVISOR.report(Task::Idle);
            timer::micros() >= until
        };
        let _ = (0..(ns / 1_000_000 + 1).saturating_mul(LOOKS_PER_MS)).any(over);
    }
}
