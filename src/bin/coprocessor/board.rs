//! The board's lines, and what it reports of itself.
#![allow(
    unsafe_code,
    clippy::undocumented_unsafe_blocks,
    reason = "rings; a comment above them names both ends"
)]

use crate::boards::{BOARD, Line};
use crate::crash;
use crate::ring::Ring;
use crate::serial::{self, SENDING};
use crate::stm32f405::can::{Can, Mode};
use crate::stm32f405::clocks::Clocks;
use crate::stm32f405::pins::{self, Speed};
use crate::stm32f405::spi::{self, Spi};
use crate::stm32f405::usart::Usart;
use crate::stm32f405::{Chip, pac, supply};
use cortex_m::peripheral::{SYST, syst::SystClkSource};
use embedded_can::Id;
use gyronet::health::supervisor::Supervisor;
use gyronet::service::event::{CanFault, ClockFault};
use gyronet::service::message::Identity;
use pac::Interrupt;

/// Bytes of the inertial sensor that may wait: more than come in the 20 ms that an estimate is waited for.
pub const IMU_RING: usize = 512;
/// Bytes of the fibre-optic gyro that may wait: 7 ms at 1000 messages a second; they are looked at every
/// millisecond.
pub const FOG_RING: usize = 256;
/// Bytes of an SLCAN host that may wait: a window's worth of wheel frames.
pub const SLCAN_RING: usize = 256;
/// Bytes of the service line that may wait: a frame.
pub const SERVICE_RING: usize = 256;

/// Collects which tasks have run.
pub static SUPERVISOR: Supervisor = Supervisor::new();

static FAULTS: [serial::Faults; 4] = [const { serial::Faults::new() }; 4];

// SAFETY, for all rings: the handler of a line is at one end, and the task that has its port at the other.
static IMU: Ring<u8, IMU_RING> = unsafe { Ring::new() };
static FOG: Ring<u8, FOG_RING> = unsafe { Ring::new() };
static SLCAN: Ring<u8, SLCAN_RING> = unsafe { Ring::new() };
static SERVICE: Ring<u8, SERVICE_RING> = unsafe { Ring::new() };
static TO_LINES: [Ring<u8, SENDING>; 4] = [const { unsafe { Ring::new() } }; 4];

/// The tasks' ends of everything.
pub struct Board {
    pub imu: serial::Port<IMU_RING>,
    pub fog: serial::Port<FOG_RING>,
    pub slcan: serial::Port<SLCAN_RING>,
    pub service: serial::Port<SERVICE_RING>,
    /// The CAN controller; `None` where it does not answer, or the clock is not exact enough.
    pub can: Option<Can>,
    pub spi: Spi,
    /// True where the board is emulated without a clock tree: its sensors send at the host's pace.
    pub emulated: bool,
    pub clocks: Clocks,
    /// The board's report of itself.
    pub identity: Identity,
}

/// The interrupts' ends.
pub struct Handlers {
    pub imu: serial::Handler<IMU_RING>,
    pub fog: serial::Handler<FOG_RING>,
    pub slcan: serial::Handler<SLCAN_RING>,
    pub service: serial::Handler<SERVICE_RING>,
}

impl Board {
    /// Starts everything. CAN receives the frames of these identifiers, once it has joined the bus.
    pub fn start(p: pac::Peripherals, systick: SYST, received: impl Iterator<Item = Id>) -> (Self, Handlers) {
        let Chip { clocks, device_id, reset } = Chip::start(&p, BOARD.crystal_hz);
        assign_pins();
        let can =
            if clocks.exact() { Can::start(p.CAN1, received, Mode::Normal) } else { Err(CanFault::Clock) };
        let identity = Identity {
            firmware: version(),
            device_id,
            clock_hz: clocks.core_hz,
            clock_fault: clocks.fault,
            can_fault: can.as_ref().err().copied(),
            reset,
            crash: crash::take(),
        };
        let (imu_handler, imu) =
            line(0, pac::USART1::ptr(), Interrupt::USART1, &IMU, (&BOARD.imu, clocks.apb2_hz, &clocks));
        let (slcan_handler, slcan) =
            line(1, pac::USART2::ptr(), Interrupt::USART2, &SLCAN, (&BOARD.slcan, clocks.apb1_hz, &clocks));
        let (fog_handler, fog) =
            line(2, pac::USART3::ptr(), Interrupt::USART3, &FOG, (&BOARD.fog, clocks.apb1_hz, &clocks));
        let (service_handler, service) = line(
            3,
            pac::USART6::ptr(),
            Interrupt::USART6,
            &SERVICE,
            (&BOARD.service, clocks.apb2_hz, &clocks),
        );
        let spi = spi::start(&p.SPI1, BOARD.spi);
        if clocks.exact() {
            supply::watch(&p.EXTI);
        }
        start_ticks(systick, &clocks);
        let handlers =
            Handlers { imu: imu_handler, fog: fog_handler, slcan: slcan_handler, service: service_handler };
        let emulated = device_id.is_none();
        (Self { imu, fog, slcan, service, can: can.ok(), spi, emulated, clocks, identity }, handlers)
    }
}

/// Starts a line and gives both of its ends.
fn line<const N: usize>(
    number: usize,
    registers: *const pac::usart1::RegisterBlock,
    interrupt: Interrupt,
    received: &'static Ring<u8, N>,
    (line, bus_hz, clocks): (&Line, u32, &Clocks),
) -> (serial::Handler<N>, serial::Port<N>) {
    let usart = Usart::new(registers, interrupt);
    let emulated = clocks.fault == Some(ClockFault::Emulated);
    let ends = serial::line(usart, received, &TO_LINES[number % 4], &FAULTS[number % 4], emulated);
    // At 16 MHz, 921600 baud would be 2.1 % off before the oscillator's own error.
    usart.start(bus_hz, if clocks.exact() { line.baud } else { line.fallback_baud });
    ends
}

/// Starts SysTick, which interrupts every millisecond.
fn start_ticks(mut systick: SYST, clocks: &Clocks) {
    systick.set_clock_source(SystClkSource::Core);
    systick.set_reload(clocks.core_hz / 1_000 - 1);
    systick.clear_current();
    systick.enable_interrupt();
    systick.enable_counter();
}

/// Hands the pins to USARTs and CAN. A line that hangs open reads as idle.
fn assign_pins() {
    let lines = [
        (&BOARD.imu, pins::USART_1_TO_3),
        (&BOARD.slcan, pins::USART_1_TO_3),
        (&BOARD.fog, pins::USART_1_TO_3),
        (&BOARD.service, pins::USART_6),
    ];
    for (line, function) in lines {
        line.rx.pull_up();
        line.rx.alternate(function, Speed::Low);
        line.tx.alternate(function, Speed::Low);
    }
    let (led, lit) = BOARD.led;
    led.output(!lit);
    for pin in BOARD.can {
        pin.alternate(pins::CAN_1, Speed::Fast);
    }
}

/// The version of the package.
fn version() -> [u8; 3] {
    let number = |text: &str| text.bytes().fold(0, |number: u8, digit| number * 10 + (digit - b'0'));
    [
        number(env!("CARGO_PKG_VERSION_MAJOR")),
        number(env!("CARGO_PKG_VERSION_MINOR")),
        number(env!("CARGO_PKG_VERSION_PATCH")),
    ]
}
