//! The coprocessor on a NUCLEO-H563ZI: an Xsens MTi in, frames on CAN out. Copy this folder for a board of your own.
//!
//! The bus may carry CAN FD: such frames are skipped, and one is sent where `can.yaw.fd` names it.
//!
//! | line | pins | use |
//! |---|---|---|
//! | USART1 | D0 (PB7), D1 (PB6) | Xsens MTi, 115200 baud |
//! | SPI1 | D13 (PA5), D12 (PG9), D11 (PB5); selects D10 (PD14), D9 (PD15) | ICM-42688-P, BMI088 or ASM330LHH, where one is configured |
//! | FDCAN1 | PD0, PD1 (CN9), to a transceiver | 500 kbit/s; data of CAN FD at 2 Mbit/s |
//!
//! Boot loader, image and records lie as [`gyronet::store::banks`] says. `gyronet firmware --board nucleo-h563zi` makes what a
//! probe flashes, and the update.
//!
//! Every millisecond `drive` calls [`Coprocessor::step`]. Below it `compute` runs the network, and below both the main program
//! serves diagnosis and the store ([`service`]). The watchdog is fed while `drive` and the main program get on. Not here yet:
//! update of weights alone, the fibre-optic gyro, counts of failed starts and of UART errors.
#![no_std]
#![no_main]

mod can;
mod flash;
mod imu;
mod rng;
mod service;

use can::{CanBus, Received};
use core::panic::PanicInfo;
use core::sync::atomic::Ordering::Relaxed;
use cortex_m::peripheral::SCB;
use embassy_executor::InterruptExecutor;
use embassy_stm32::interrupt::{self, InterruptExt, Priority};
use embassy_stm32::time::Hertz;
use embassy_stm32::usart::{self, BufferedUart};
use embassy_stm32::wdg::IndependentWatchdog;
use embassy_stm32::{bind_interrupts, pac, peripherals, rcc};
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::signal::Signal;
use embassy_time::{Duration, Instant, Ticker};
use gyronet::coprocessor::DueWindow;
use gyronet::health::count;
use gyronet::model::background::BackgroundCheck;
use gyronet::model::{Estimate, WindowNetwork, weights};
use gyronet::sensor::serial::Serial;
use gyronet::sensor::xsens::Mti;
use gyronet::service::message::{AllCounters, LineCounters};
use gyronet::service::spi_imu::{BringUp, Reader};
use gyronet::store::banks::{Records, Slots};
use gyronet::{Config, Coprocessor, GyroNet, Micros};
use imu::{Imu, PASSED, WANTED};
use service::{Service, Stored, alive};
use static_cell::ConstStaticCell;

bind_interrupts!(struct Interrupts {
    USART1 => usart::BufferedInterruptHandler<peripherals::USART1>;
    FDCAN1_IT0 => embassy_stm32::can::IT0InterruptHandler<peripherals::FDCAN1>;
    FDCAN1_IT1 => embassy_stm32::can::IT1InterruptHandler<peripherals::FDCAN1>;
});

type Watchdog = IndependentWatchdog<'static, peripherals::IWDG>;

/// Time without a cycle of the main program after which the watchdog is no longer fed.
const STUCK: Duration = Duration::from_millis(100);
/// Time after which the watchdog resets the chip, us. A start after a power cut moves all records, unfed.
const WATCHDOG_US: u32 = 1_000_000;
/// Steps from one reading of the state of the courses to the next; a course comes once a second.
const COURSE_STEPS: u32 = 100;

/// A window for the network, and its estimate.
static WINDOW: Signal<CriticalSectionRawMutex, DueWindow> = Signal::new();
static ESTIMATE: Signal<CriticalSectionRawMutex, (u32, Estimate)> = Signal::new();

/// Does every millisecond what is due.
#[embassy_executor::task]
async fn drive(coprocessor: &'static mut Coprocessor, mut imu: Imu, mut can: CanBus, mut watchdog: Watchdog) {
    let mut tick = Ticker::every(Duration::from_millis(1));
    let (mut seen, mut seen_at) = (0, Instant::now());
    let (mut steps, mut line_errors) = (0u32, 0u32);
    loop {
        tick.next().await;
        let now = Instant::now();
        if let Some((end, estimate)) = ESTIMATE.try_take() {
            // A late estimate is counted.
            let _ = coprocessor.deliver(end, estimate);
        }
        if service::WEIGHTS_DAMAGED.swap(false, Relaxed) {
            coprocessor.weights_damaged();
        }
        if service::MOUNT_MOVED.swap(false, Relaxed) {
            coprocessor.mount_moved();
        }
        coprocessor.pause(service::PAUSED.load(Relaxed), &mut can);
        let step = coprocessor.step(Micros(now.as_micros()), &mut imu, &mut can, None);
        count(&mut line_errors, u32::from(step.imu_error.is_some()));
        if let Some(window) = coprocessor.window() {
            WINDOW.signal(window);
        }
        service::COUNTERS.signal(AllCounters::of(coprocessor, &LineCounters { line_errors, ..can.counters }));
        steps = steps.wrapping_add(1);
        if steps.is_multiple_of(COURSE_STEPS) {
            service::COURSE.signal(coprocessor.course_state());
        }
        let cycles = service::CYCLES.load(Relaxed);
        if cycles != seen {
            (seen, seen_at) = (cycles, now);
        }
        if now - seen_at < STUCK {
            watchdog.pet();
        }
    }
}

/// Computes the windows, below `drive` and above the main program, which waits for the flash.
#[embassy_executor::task]
async fn compute(mut network: GyroNet<'static>) {
    loop {
        let window = WINDOW.wait().await;
        ESTIMATE.signal((window.end, network.estimate(&window.features)));
    }
}

/// The executors run in the interrupts of peripherals that are not used, below those of the drivers.
static ABOVE: InterruptExecutor = InterruptExecutor::new();
static BELOW: InterruptExecutor = InterruptExecutor::new();

#[embassy_stm32::interrupt]
unsafe fn UART4() {
    // SAFETY: it is called here alone, and the interrupt is enabled by `start`.
    unsafe { ABOVE.on_interrupt() }
}

#[embassy_stm32::interrupt]
unsafe fn UART5() {
    // SAFETY: as above.
    unsafe { BELOW.on_interrupt() }
}

#[cortex_m_rt::entry]
fn main() -> ! {
    static COPROCESSOR: ConstStaticCell<Coprocessor> =
        ConstStaticCell::new(Coprocessor::new(Config::DEFAULT));
    static DEVICE: ConstStaticCell<Stored> = ConstStaticCell::new(Stored::new(&service::SUPPORTED));
    static BYTES: ConstStaticCell<[u8; 1024]> = ConstStaticCell::new([0; 1024]);
    static UNSENT: ConstStaticCell<[u8; 1]> = ConstStaticCell::new([0]);

    // SAFETY: nothing else uses the watchdog; embassy hands it out only after it has waited for the clock, for ever.
    let mut watchdog = IndependentWatchdog::new(unsafe { peripherals::IWDG::steal() }, WATCHDOG_US);
    watchdog.unleash();
    let identity = service::identity();
    let parts = embassy_stm32::init(clocks());
    pac::FLASH.acr().modify(|w| w.set_prften(true));

    let device = DEVICE.take();
    // SAFETY: `device` uses both, here and in the main program.
    let [records, slots] = unsafe { [flash::Array::new(alive), flash::Array::new(alive)] };
    device.begin(Records::open(records).ok(), Some(Slots(slots)), Ok(()), identity);
    watchdog.pet();
    let blob = device.weights(None, &weights::DEFAULT.0);
    let coprocessor = COPROCESSOR.take();
    *coprocessor = Coprocessor::new(device.coprocessor(true));
    let configuration = device.configuration();
    let ids = configuration.diagnosis.ids().expect("a stored configuration has been checked");
    let received = Received { ids, filters: device.received(), settings: configuration.can };
    let can = CanBus::start(parts.FDCAN1, parts.PD0, parts.PD1, Interrupts, received);
    let check = blob.as_ref().map(|blob| BackgroundCheck::new(blob.content, blob.crc));

    interrupt::UART4.set_priority(Priority::P6);
    interrupt::UART5.set_priority(Priority::P7);
    let spi = imu::start(parts.SPI1, parts.PA5, parts.PB5, parts.PG9, parts.PD14, parts.PD15);
    let bring_up = BringUp::new(configuration.imu, Some(spi), &WANTED);
    let imu = if bring_up.is_some() {
        Imu::Spi(Reader::new(&WANTED, || Instant::now().as_micros(), || PASSED.try_take()))
    } else {
        let (unsent, received) = (UNSENT.take(), BYTES.take());
        let baud = usart::Config::default();
        let line = BufferedUart::new(parts.USART1, parts.PB7, parts.PB6, unsent, received, Interrupts, baud);
        Imu::Line(Serial::new(line.expect("115200 baud from 250 MHz"), Mti::new()))
    };
    let mut service = Service::new(device, ids, check, bring_up);
    ABOVE.start(interrupt::UART4).spawn(drive(coprocessor, imu, can, watchdog).expect("its only one"));
    if let Some(blob) = blob {
        BELOW.start(interrupt::UART5).spawn(compute(GyroNet::new(blob)).expect("its only one"));
    }
    loop {
        service.step();
        alive();
        // The tick ends the sleep.
        cortex_m::asm::wfi();
    }
}

/// 250 MHz, and 50 MHz for CAN, from the 8 MHz that the board's debug probe supplies.
fn clocks() -> embassy_stm32::Config {
    let mut config = embassy_stm32::Config::default();
    // The HSI48 is for the random numbers.
    (config.rcc.hsi, config.rcc.hsi48) = (None, Some(rcc::Hsi48Config::new()));
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
