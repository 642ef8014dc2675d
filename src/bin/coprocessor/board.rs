//! The board: its lines, and what it says of itself. What differs from part to part is in `chip`.
#![allow(unsafe_code, reason = "an interrupt's priority; the block says why it is sound")]

use crate::chip::bus::Bus;
use crate::chip::spi::Spi;
use crate::chip::watchdog::Watchdog;
use crate::chip::{CAN_INTERRUPT, pac};
use crate::clock::{BoardTime, Clocks};
use crate::crash;
use crate::queue::Queue;
use crate::serial;
use crate::usart::Usart;
use cortex_m::peripheral::{NVIC, SYST};
use gyronet::health::supervisor::Supervisor;
use gyronet::service::event::ResetCause;
use gyronet::service::message::Identity;
use pac::Interrupt;

/// Bytes of a part that may wait: twice what comes in the 20 ms that an estimate is waited for.
pub const IMU_QUEUE: usize = 384;
/// Bytes of a fibre-optic gyro that may wait: 7 ms at 1000 messages a second; it is looked at every
/// millisecond.
pub const FOG_QUEUE: usize = 256;
/// Bytes of a host that may wait: a window's worth of wheel frames.
pub const SLCAN_QUEUE: usize = 256;
/// Bytes of the service line that may wait: a frame, and then the line is held.
pub const SERVICE_QUEUE: usize = 256;
/// Bytes on their way to a line.
pub const SENDING: usize = 128;

/// Of received frames, as RTIC counts: higher is more urgent.
pub const CAN_PRIORITY: u8 = 3;

/// Which tasks have run.
pub static SUPERVISOR: Supervisor = Supervisor::new();

static FAULTS: [serial::Faults; 4] = [const { serial::Faults::new() }; 4];

static IMU: Queue<u8, IMU_QUEUE> = Queue::new();
static FOG: Queue<u8, FOG_QUEUE> = Queue::new();
static SLCAN: Queue<u8, SLCAN_QUEUE> = Queue::new();
static SERVICE: Queue<u8, SERVICE_QUEUE> = Queue::new();
static TO_LINES: [Queue<u8, SENDING>; 4] = [const { Queue::new() }; 4];

/// What the part has started, and says of itself.
pub struct Chip {
    pub clocks: Clocks,
    /// Where the controller answers and the clock is exact enough for it.
    pub can: Option<Bus>,
    /// Where it is driven.
    pub spi: Option<Spi>,
    pub watchdog: Watchdog,
    /// `None`: nothing answers where a part would say what it is, which is so in the emulator.
    pub device_id: Option<u32>,
    pub reset: ResetCause,
}

/// Of reset flags. The pin's is set by every reset, and a brown-out's by power-on, so the order matters.
pub fn most_telling(causes: [(bool, ResetCause); 6]) -> ResetCause {
    causes.into_iter().find_map(|(set, cause)| set.then_some(cause)).unwrap_or(ResetCause::Unknown)
}

/// What the tasks use.
pub struct Board {
    pub imu: serial::Port<IMU_QUEUE>,
    pub fog: serial::Port<FOG_QUEUE>,
    pub slcan: serial::Port<SLCAN_QUEUE>,
    pub service: serial::Port<SERVICE_QUEUE>,
    /// Where the controller answers and the clock is exact enough for it.
    pub can: Option<Bus>,
    /// Where it is driven.
    pub spi: Option<Spi>,
    pub time: BoardTime,
    pub watchdog: Watchdog,
    /// Known since the start.
    pub identity: Identity,
}

/// What the interrupts use.
pub struct Handlers {
    pub imu: serial::Handler<IMU_QUEUE>,
    pub fog: serial::Handler<FOG_QUEUE>,
    pub slcan: serial::Handler<SLCAN_QUEUE>,
    pub service: serial::Handler<SERVICE_QUEUE>,
}

impl Board {
    /// Starts everything.
    #[inline(never)]
    pub fn start(p: pac::Peripherals, systick: SYST) -> (Self, Handlers) {
        release_can();
        let Chip { clocks, can, spi, watchdog, device_id, reset } = Chip::start(p);
        let identity = Identity {
            firmware: version(),
            device_id,
            clock_hz: clocks.core_hz,
            can: can.is_some(),
            reset,
            crash: crash::take(),
        };
        let [to_imu, to_fog, to_slcan, to_service] = &TO_LINES;
        let [imu_faults, fog_faults, slcan_faults, service_faults] = &FAULTS;
        let usart1 = Usart { registers: pac::USART1::ptr(), interrupt: Interrupt::USART1 };
        let usart2 = Usart { registers: pac::USART2::ptr(), interrupt: Interrupt::USART2 };
        let usart3 = Usart { registers: pac::USART3::ptr(), interrupt: Interrupt::USART3 };
        let usart6 = Usart { registers: pac::USART6::ptr(), interrupt: Interrupt::USART6 };
        let (imu_handler, imu) = serial::line(usart1, &IMU, to_imu, imu_faults);
        let (fog_handler, fog) = serial::line(usart3, &FOG, to_fog, fog_faults);
        let (slcan_handler, slcan) = serial::line(usart2, &SLCAN, to_slcan, slcan_faults);
        let (service_handler, service) = serial::line(usart6, &SERVICE, to_service, service_faults);
        usart1.start(clocks.apb2_hz, 115_200);
        usart2.start(clocks.apb1_hz, 921_600);
        usart3.start(clocks.apb1_hz, 921_600);
        usart6.start(clocks.apb2_hz, 115_200);
        let time = BoardTime::start(systick, clocks, identity.device_id.is_none());
        let handlers =
            Handlers { imu: imu_handler, fog: fog_handler, slcan: slcan_handler, service: service_handler };
        (Self { imu, fog, slcan, service, can, spi, time, watchdog, identity }, handlers)
    }
}

/// The interrupt of received frames has another name in each part, and RTIC binds names: so it is
/// not RTIC that sets its priority. It shares nothing but a queue.
fn release_can() {
    const UNITS: u8 = 1 << (8 - pac::NVIC_PRIO_BITS);
    // SAFETY: interrupts are off until RTIC has started, and no critical section of its own
    // depends on this priority.
    unsafe {
        let mut core = cortex_m::Peripherals::steal();
        core.NVIC.set_priority(CAN_INTERRUPT, 0_u8.wrapping_sub(CAN_PRIORITY.wrapping_mul(UNITS)));
        NVIC::unmask(CAN_INTERRUPT);
    }
}

/// Of the package.
fn version() -> [u8; 3] {
    let number = |text: &str| text.bytes().fold(0, |number: u8, digit| number * 10 + (digit - b'0'));
    [
        number(env!("CARGO_PKG_VERSION_MAJOR")),
        number(env!("CARGO_PKG_VERSION_MINOR")),
        number(env!("CARGO_PKG_VERSION_PATCH")),
    ]
}
