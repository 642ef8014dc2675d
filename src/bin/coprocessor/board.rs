//! The board: an STM32F405 (RM0090), its pins, clocks and lines. Everything that another part
//! has elsewhere is here and in the files beside it: `clock`, `serial`, `bus`, `flash`, `watchdog`.

use crate::bus::{self, Bus};
use crate::clock::{BoardTime, Clocks};
use crate::crash;
use crate::queue::Queue;
use crate::serial::{self, Usart};
use crate::start::WHEELS;
use crate::watchdog::Watchdog;
use cortex_m::peripheral::SYST;
use gyronet::health::supervisor::Supervisor;
use gyronet::service::event::ResetCause;
use gyronet::service::message::Identity;
use stm32f4::stm32f405::{self as pac, Interrupt};

/// Bytes of a part that may wait: four windows' worth of computing time at 100 samples a second.
pub const IMU_QUEUE: usize = 2048;
/// Bytes of a host that may wait: a window's worth of wheel frames.
pub const SLCAN_QUEUE: usize = 512;
/// Bytes of the service line that may wait: a frame, and then the line is held.
pub const SERVICE_QUEUE: usize = 512;
/// Bytes on their way to a line.
pub const SENDING: usize = 128;

/// Which tasks have run.
pub static SUPERVISOR: Supervisor = Supervisor::new();

static FAULTS: [serial::Faults; 3] = [const { serial::Faults::new() }; 3];

static IMU: Queue<u8, IMU_QUEUE> = Queue::new();
static SLCAN: Queue<u8, SLCAN_QUEUE> = Queue::new();
static SERVICE: Queue<u8, SERVICE_QUEUE> = Queue::new();
static TO_LINES: [Queue<u8, SENDING>; 3] = [const { Queue::new() }; 3];

/// What the tasks use.
pub struct Board {
    pub imu: serial::Port<IMU_QUEUE>,
    pub slcan: serial::Port<SLCAN_QUEUE>,
    pub service: serial::Port<SERVICE_QUEUE>,
    /// Where the controller answers and the clock is exact enough for it.
    pub can: Option<Bus>,
    pub time: BoardTime,
    pub watchdog: Watchdog,
    /// Known since the start.
    pub identity: Identity,
}

/// What the interrupts use.
pub struct Handlers {
    pub imu: serial::Handler<IMU_QUEUE>,
    pub slcan: serial::Handler<SLCAN_QUEUE>,
    pub service: serial::Handler<SERVICE_QUEUE>,
    pub can: Option<bus::Receiver>,
}

impl Board {
    /// Starts everything.
    #[inline(never)]
    pub fn start(p: pac::Peripherals, systick: SYST) -> (Self, Handlers) {
        let clocks = Clocks::start(&p.RCC, &p.FLASH, &p.PWR);
        p.RCC.ahb1enr().modify(|_, w| w.gpioaen().enabled().gpioben().enabled().gpiocen().enabled());
        p.RCC.apb1enr().modify(|_, w| w.usart2en().enabled().can1en().enabled());
        p.RCC.apb2enr().modify(|_, w| w.usart1en().enabled().usart6en().enabled());
        pins(&p.GPIOA, &p.GPIOB, &p.GPIOC);
        let can = p.CAN1;
        let can = if clocks.exact() { Bus::start(can, Some(&WHEELS)) } else { None };
        let (can, receiver) = can.unzip();
        let identity = identity(&p.RCC, &p.DBGMCU, clocks.core_hz, can.is_some());
        let [to_imu, to_slcan, to_service] = &TO_LINES;
        let [imu_faults, slcan_faults, service_faults] = &FAULTS;
        let usart1 = Usart { registers: pac::USART1::ptr(), interrupt: Interrupt::USART1 };
        let usart2 = Usart { registers: pac::USART2::ptr(), interrupt: Interrupt::USART2 };
        let usart6 = Usart { registers: pac::USART6::ptr(), interrupt: Interrupt::USART6 };
        let (imu_handler, imu) = serial::line(usart1, &IMU, to_imu, imu_faults);
        let (slcan_handler, slcan) = serial::line(usart2, &SLCAN, to_slcan, slcan_faults);
        let (service_handler, service) = serial::line(usart6, &SERVICE, to_service, service_faults);
        usart1.start(clocks.apb2_hz, 115_200);
        usart2.start(clocks.apb1_hz, 921_600);
        usart6.start(clocks.apb2_hz, 115_200);
        let time = BoardTime::start(systick, clocks, identity.device_id.is_none());
        let watchdog = Watchdog::start(p.IWDG, &p.DBGMCU);
        let handlers =
            Handlers { imu: imu_handler, slcan: slcan_handler, service: service_handler, can: receiver };
        (Self { imu, slcan, service, can, time, watchdog, identity }, handlers)
    }
}

fn pins(a: &pac::GPIOA, b: &pac::GPIOB, c: &pac::GPIOC) {
    a.afrl().modify(|_, w| w.afrl2().af7().afrl3().af7());
    a.afrh().modify(|_, w| w.afrh9().af7().afrh10().af7());
    b.afrh().modify(|_, w| w.afrh8().af9().afrh9().af9());
    c.afrl().modify(|_, w| w.afrl6().af8().afrl7().af8());
    a.moder().modify(|_, w| {
        w.moder2().alternate().moder3().alternate().moder9().alternate().moder10().alternate()
    });
    // A line that hangs open reads as idle.
    a.pupdr().modify(|_, w| w.pupdr3().pull_up().pupdr10().pull_up());
    b.moder().modify(|_, w| w.moder8().alternate().moder9().alternate());
    c.moder().modify(|_, w| w.moder6().alternate().moder7().alternate());
    c.pupdr().modify(|_, w| w.pupdr7().pull_up());
}

fn identity(rcc: &pac::RCC, dbgmcu: &pac::DBGMCU, clock_hz: u32, can: bool) -> Identity {
    let id = dbgmcu.idcode().read().bits();
    let number = |text: &str| text.bytes().fold(0, |number: u8, digit| number * 10 + (digit - b'0'));
    let firmware = [
        number(env!("CARGO_PKG_VERSION_MAJOR")),
        number(env!("CARGO_PKG_VERSION_MINOR")),
        number(env!("CARGO_PKG_VERSION_PATCH")),
    ];
    Identity {
        firmware,
        device_id: (id != 0).then_some(id),
        clock_hz,
        can,
        reset: reset_cause(rcc),
        crash: crash::take(),
    }
}

/// Reads the reset flags and clears them for the next time. The pin's is set by every reset, and
/// a brown-out's by power-on, so the most telling one comes first.
fn reset_cause(rcc: &pac::RCC) -> ResetCause {
    let flags = rcc.csr().read();
    let causes = [
        (flags.wdgrstf().bit_is_set() || flags.wwdgrstf().bit_is_set(), ResetCause::Watchdog),
        (flags.sftrstf().bit_is_set(), ResetCause::Software),
        (flags.lpwrrstf().bit_is_set(), ResetCause::LowPower),
        (flags.porrstf().bit_is_set(), ResetCause::PowerOn),
        (flags.borrstf().bit_is_set(), ResetCause::BrownOut),
        (flags.padrstf().bit_is_set(), ResetCause::Pin),
    ];
    rcc.csr().modify(|_, w| w.rmvf().set_bit());
    causes.into_iter().find_map(|(set, cause)| set.then_some(cause)).unwrap_or(ResetCause::Unknown)
}
