//! Holds the lines of the board, and the state that the board reports.
#![allow(
    unsafe_code,
    clippy::undocumented_unsafe_blocks,
    reason = "rings; a comment above them names both ends"
)]

use crate::boards::{self, BOARD};
use crate::stm32f405::can::{Can, Mode};
use crate::stm32f405::clocks::Clocks;
use crate::stm32f405::pins::{self, Speed};
use crate::stm32f405::spi::{self, Spi};
use crate::stm32f405::usart::Usart;
use crate::stm32f405::{Chip, pac, serial_number, supply};
use crate::{crash, serial};
use cortex_m::peripheral::{SYST, syst::SystClkSource};
use gyronet::heading::GnssSettings;
use gyronet::service::event::CanFault;
use gyronet::service::message::Identity;
use gyronet::store::firmware::{LABEL_SIZE, Label, version};

// SAFETY: each element belongs to one line, which `Board::start` or `gnss` starts.
static MEMORY: [serial::Memory; 5] = [const { unsafe { serial::Memory::new() } }; 5];

pub struct Board {
    pub imu: serial::Port,
    pub fog: serial::Port,
    pub slcan: serial::Port,
    pub service: serial::Port,
    /// The CAN controller; `None` if it does not answer or the clock is not exact enough.
    pub can: Option<Can>,
    pub spi: Option<[Spi; 2]>,
    pub clocks: Clocks,
    /// The identity that the board reports: firmware version, chip, clock and serial number.
    pub identity: Identity,
}

/// The parts of the lines that the interrupt handlers own; `receptions` are the tick's.
pub struct Handlers {
    pub imu: serial::Handler,
    pub fog: serial::Handler,
    pub slcan: serial::Handler,
    pub service: serial::Handler,
    pub receptions: [Option<serial::Reception>; 4],
}

impl Board {
    pub fn start(p: pac::Peripherals, systick: SYST) -> (Self, Handlers) {
        let Chip { clocks, device_id, reset } = Chip::start(&p, BOARD.crystal_hz);
        assign_pins();
        let can = if clocks.exact() { Can::start(p.CAN1, Mode::Normal) } else { Err(CanFault::Clock) };
        let (crash, failed_starts) = crash::take(reset);
        let identity = Identity {
            firmware: VERSION,
            device_id: Some(device_id),
            serial: serial_number::read(),
            clock_hz: clocks.core_hz,
            clock_fault: clocks.fault,
            can_fault: can.as_ref().err().copied(),
            reset,
            crash,
            failed_starts,
        };
        let [imu, slcan, fog, service] =
            lines(&clocks).map(|(usart, rates, memory)| serial::start(usart, memory, rates));
        let spi = BOARD.spi.map(|pins| spi::start(&p.SPI1, pins));
        if clocks.exact() {
            supply::watch(&p.EXTI);
        }
        start_ticks(systick, &clocks);
        let handlers = Handlers {
            receptions: [imu.1, slcan.1, fog.1, service.1],
            imu: imu.0,
            slcan: slcan.0,
            fog: fog.0,
            service: service.0,
        };
        let (imu, slcan, fog, service) = (imu.2, slcan.2, fog.2, service.2);
        (Self { imu, fog, slcan, service, can: can.ok(), spi, clocks, identity }, handlers)
    }
}

/// Starts the line of a GNSS receiver, where the configuration names one. Its pins are left alone otherwise.
pub fn gnss(clocks: &Clocks, settings: Option<GnssSettings>) -> serial::Ends {
    let [.., memory] = &MEMORY;
    let rates = BOARD.gnss.as_ref().zip(settings).map(|(line, settings)| {
        line.connect(pins::UART_4_AND_6);
        (clocks.apb1_hz, settings.baud)
    });
    serial::start(Usart::four(), memory, rates)
}

/// USART of a line, its bus frequency and bit rate where the board has the line, and its memory.
type Line = (Usart, Option<(u32, u32)>, &'static serial::Memory);

/// Returns the lines in the order IMU, SLCAN, fibre-optic gyro, service.
fn lines(clocks: &Clocks) -> [Line; 4] {
    let [imu, slcan, fog, service, _] = &MEMORY;
    // At 16 MHz, 921600 baud would be 2.1 % off before the oscillator's own error.
    let rates = |bus_hz, line: &Option<boards::Line>| {
        line.as_ref().map(|line| (bus_hz, if clocks.exact() { line.baud } else { line.fallback_baud }))
    };
    [
        (Usart::one(), rates(clocks.apb2_hz, &BOARD.imu), imu),
        (Usart::two(), rates(clocks.apb1_hz, &BOARD.slcan), slcan),
        (Usart::three(), rates(clocks.apb1_hz, &BOARD.fog), fog),
        (Usart::six(), rates(clocks.apb2_hz, &Some(BOARD.service)), service),
    ]
}

/// Starts SysTick, which interrupts every millisecond.
fn start_ticks(mut systick: SYST, clocks: &Clocks) {
    systick.set_clock_source(SystClkSource::Core);
    systick.set_reload(clocks.core_hz / 1_000 - 1);
    systick.clear_current();
    systick.enable_interrupt();
    systick.enable_counter();
}

/// Assigns the pins of USARTs, LED and CAN. An unconnected line reads as idle.
fn assign_pins() {
    let lines = [BOARD.imu, BOARD.slcan, BOARD.fog].into_iter().flatten();
    lines.for_each(|line| line.connect(pins::USART_1_TO_3));
    BOARD.service.connect(pins::UART_4_AND_6);
    if let Some((led, lit)) = BOARD.led {
        led.output(!lit);
    }
    for pin in BOARD.can {
        pin.alternate(pins::CAN_1, Speed::Fast);
    }
}

const VERSION: [u8; 3] = version(env!("CARGO_PKG_VERSION"));

/// The label of the image: version, flash layout and board, by which an update is accepted.
#[used]
#[unsafe(link_section = ".label")]
static LABEL: [u8; LABEL_SIZE] = Label::new(VERSION, BOARD.name).bytes();
