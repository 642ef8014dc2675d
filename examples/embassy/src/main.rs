//! The coprocessor on a NUCLEO-H563ZI: an Xsens MTi in, frames on CAN out. Copy this folder for a board of your own.
//!
//! The bus may carry CAN FD: the controller receives such frames and sends classic ones.
//!
//! | line | pins | use |
//! |---|---|---|
//! | USART1 | D0 (PB7), D1 (PB6) | Xsens MTi, 115200 baud |
//! | FDCAN1 | PD0, PD1 (CN9), to a transceiver | 500 kbit/s; data of others at 2 Mbit/s |
//!
//! Every millisecond `drive` calls [`Coprocessor::step`]. The network runs in the main program, below all interrupts.
//! The watchdog is fed while both get on.
#![no_std]
#![no_main]

mod can;

use can::CanBus;
use core::panic::PanicInfo;
use core::sync::atomic::{AtomicU32, Ordering::Relaxed};
use cortex_m::peripheral::SCB;
use embassy_executor::InterruptExecutor;
use embassy_stm32::interrupt::{self, InterruptExt, Priority};
use embassy_stm32::time::Hertz;
use embassy_stm32::usart::{self, BufferedUart};
use embassy_stm32::wdg::IndependentWatchdog;
use embassy_stm32::{bind_interrupts, peripherals, rcc};
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::signal::Signal;
use embassy_time::{Duration, Instant, Ticker};
use gyronet::can::wheel::{WheelReceiver, WheelSettings};
use gyronet::coprocessor::DueWindow;
use gyronet::model::Estimate;
use gyronet::sensor::serial::Serial;
use gyronet::sensor::xsens::Mti;
use gyronet::{Config, Coprocessor, GyroNet, Micros, WindowNetwork};
use static_cell::ConstStaticCell;

bind_interrupts!(struct Interrupts {
    USART1 => usart::BufferedInterruptHandler<peripherals::USART1>;
    FDCAN1_IT0 => embassy_stm32::can::IT0InterruptHandler<peripherals::FDCAN1>;
    FDCAN1_IT1 => embassy_stm32::can::IT1InterruptHandler<peripherals::FDCAN1>;
});

type Imu = Serial<BufferedUart<'static>, Mti>;
type Watchdog = IndependentWatchdog<'static, peripherals::IWDG>;

/// Time without a cycle of the main program after which the watchdog is no longer fed.
const STUCK: Duration = Duration::from_millis(100);
/// Time after which the watchdog resets the chip, us.
const WATCHDOG_US: u32 = 100_000;

/// A window for the network, and its estimate.
static WINDOW: Signal<CriticalSectionRawMutex, DueWindow> = Signal::new();
static ESTIMATE: Signal<CriticalSectionRawMutex, (u32, Estimate)> = Signal::new();
/// Number of cycles of the main program.
static CYCLES: AtomicU32 = AtomicU32::new(0);

/// Does every millisecond what is due.
#[embassy_executor::task]
async fn drive(coprocessor: &'static mut Coprocessor, mut imu: Imu, mut can: CanBus, mut watchdog: Watchdog) {
    let mut tick = Ticker::every(Duration::from_millis(1));
    let (mut seen, mut seen_at) = (0, Instant::now());
    loop {
        tick.next().await;
        let now = Instant::now();
        if let Some((end, estimate)) = ESTIMATE.try_take() {
            // A late estimate is counted.
            let _ = coprocessor.deliver(end, estimate);
        }
        // Errors of the sensor are counted.
        let _ = coprocessor.step(Micros(now.as_micros()), &mut imu, &mut can, None);
        if let Some(window) = coprocessor.window() {
            WINDOW.signal(window);
        }
        let cycles = CYCLES.load(Relaxed);
        if cycles != seen {
            (seen, seen_at) = (cycles, now);
        }
        if now - seen_at < STUCK {
            watchdog.pet();
        }
    }
}

static EXECUTOR: InterruptExecutor = InterruptExecutor::new();

/// Runs `drive` in the interrupt of a peripheral that is not used, below those of the drivers.
#[embassy_stm32::interrupt]
unsafe fn UART4() {
    // SAFETY: it is called here alone, and the interrupt is enabled by `start`.
    unsafe { EXECUTOR.on_interrupt() }
}

#[cortex_m_rt::entry]
fn main() -> ! {
    static COPROCESSOR: ConstStaticCell<Coprocessor> =
        ConstStaticCell::new(Coprocessor::new(Config::DEFAULT));
    static RECEIVED: ConstStaticCell<[u8; 1024]> = ConstStaticCell::new([0; 1024]);
    static UNSENT: ConstStaticCell<[u8; 1]> = ConstStaticCell::new([0]);

    let parts = embassy_stm32::init(clocks());
    let mut watchdog = IndependentWatchdog::new(parts.IWDG, WATCHDOG_US);
    watchdog.unleash();
    let (unsent, received) = (UNSENT.take(), RECEIVED.take());
    let baud = usart::Config::default();
    let line = BufferedUart::new(parts.USART1, parts.PB7, parts.PB6, unsent, received, Interrupts, baud)
        .expect("115200 baud from 250 MHz");
    let wheels = WheelSettings::TOYOTA;
    let can = CanBus::start(parts.FDCAN1, parts.PD0, parts.PD1, Interrupts, &wheels);
    let coprocessor = COPROCESSOR.take();
    *coprocessor = Coprocessor::new(Config { wheels: WheelReceiver::new(wheels).ok(), ..Config::DEFAULT });
    let mut network = GyroNet::shipped().expect("it comes with the library");

    interrupt::UART4.set_priority(Priority::P6);
    let imu = Serial::new(line, Mti::new());
    EXECUTOR.start(interrupt::UART4).spawn(drive(coprocessor, imu, can, watchdog).expect("its only one"));
    loop {
        if let Some(window) = WINDOW.try_take() {
            ESTIMATE.signal((window.end, network.estimate(&window.features)));
        }
        CYCLES.fetch_add(1, Relaxed);
        // The tick ends the sleep.
        cortex_m::asm::wfi();
    }
}

/// 250 MHz, and 50 MHz for CAN, from the 8 MHz that the board's debug probe supplies.
fn clocks() -> embassy_stm32::Config {
    let mut config = embassy_stm32::Config::default();
    (config.rcc.hsi, config.rcc.hsi48) = (None, None);
    config.rcc.hse = Some(rcc::Hse { freq: Hertz(8_000_000), mode: rcc::HseMode::BypassDigital });
    config.rcc.pll1 = Some(rcc::Pll {
        source: rcc::PllSource::HSE,
        prediv: rcc::PllPreDiv::DIV2,
        mul: rcc::PllMul::MUL125,
        divp: Some(rcc::PllDiv::DIV2),
        divq: Some(rcc::PllDiv::DIV10),
        divr: None,
    });
    config.rcc.sys = rcc::Sysclk::PLL1_P;
    config.rcc.voltage_scale = rcc::VoltageScale::Scale0;
    config.rcc.mux.fdcan12sel = rcc::mux::Fdcansel::PLL1_Q;
    config
}

/// Resets after a panic: silence on the bus is better than a frozen value.
#[panic_handler]
fn panic(_: &PanicInfo) -> ! {
    SCB::sys_reset()
}
