//! The coprocessor on an STM32F405 with embassy: an Xsens MTi on USART1 in, frames on CAN1 out.
//!
//! Pins and crystal are those of the Netduino Plus 2. The network has its own executor, with a priority below that of
//! bytes and frames. Build it in the repository's root:
//!
//! ```sh
//! cargo build --release --manifest-path examples/embassy/Cargo.toml --target thumbv7em-none-eabihf
//! probe-rs run --chip STM32F405RGTx examples/embassy/target/thumbv7em-none-eabihf/release/gyronet-embassy
//! ```
//!
//! It has no watchdog, stores nothing and answers no tester; the repository's own image does all that.
#![no_std]
#![no_main]

use core::panic::PanicInfo;
use core::sync::atomic::{AtomicU32, Ordering::Relaxed};
use cortex_m::peripheral::SCB;
use embassy_executor::InterruptExecutor;
use embassy_futures::select::{Either3, select3};
use embassy_stm32::can::{self, Can, Frame};
use embassy_stm32::interrupt::{self, InterruptExt, Priority};
use embassy_stm32::time::Hertz;
use embassy_stm32::usart::{self, RingBufferedUartRx, UartRx};
use embassy_stm32::{bind_interrupts, dma, peripherals, rcc};
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::{channel::Channel, signal::Signal};
use embassy_time::{Duration, Instant, Timer, with_timeout};
use gyronet::coprocessor::DueWindow;
use gyronet::model::{Estimate, GyroNetState};
use gyronet::sensor::xsens::Mti;
use gyronet::{Config, Coprocessor, GyroNet, Micros, TimedFrame, WindowNetwork};
use static_cell::ConstStaticCell;

bind_interrupts!(struct Interrupts {
    USART1 => usart::InterruptHandler<peripherals::USART1>;
    DMA2_STREAM2 => dma::InterruptHandler<peripherals::DMA2_CH2>;
    CAN1_TX => can::TxInterruptHandler<peripherals::CAN1>;
    CAN1_RX0 => can::Rx0InterruptHandler<peripherals::CAN1>;
    CAN1_RX1 => can::Rx1InterruptHandler<peripherals::CAN1>;
    CAN1_SCE => can::SceInterruptHandler<peripherals::CAN1>;
});

/// The tasks share a window and its estimate, and the frames with the number of those that were lost.
static WINDOW: Signal<CriticalSectionRawMutex, DueWindow> = Signal::new();
static ESTIMATE: Signal<CriticalSectionRawMutex, (u32, Estimate)> = Signal::new();
static FRAMES: Channel<CriticalSectionRawMutex, Frame, 24> = Channel::new();
static LOST: AtomicU32 = AtomicU32::new(0);

/// Corrects the samples in the bytes of the sensor.
#[embassy_executor::task]
async fn correct(coprocessor: &'static mut Coprocessor, mut uart: RingBufferedUartRx<'static>) {
    let (mut mti, mut bytes) = (Mti::new(), [0; 64]);
    loop {
        let event = select3(uart.read(&mut bytes), ESTIMATE.wait(), Timer::after_millis(1)).await;
        let now = Micros(Instant::now().as_micros());
        coprocessor.bus(LOST.load(Relaxed), false);
        match event {
            Either3::First(Ok(count)) => {
                for byte in &bytes[..count] {
                    mti.receive(*byte);
                    while let Some(sample) = mti.next_sample() {
                        match sample {
                            Ok(sample) => drop(coprocessor.imu(sample, now, &mut send)),
                            Err(_) => coprocessor.imu_error(),
                        }
                        hand_over(coprocessor);
                    }
                }
            }
            Either3::First(Err(_)) => coprocessor.imu_error(),
            // A late estimate is counted.
            Either3::Second((end, estimate)) => drop(coprocessor.deliver(end, estimate)),
            // A silent sensor is reported.
            Either3::Third(()) => drop(coprocessor.poll(now, &mut send)),
        }
        hand_over(coprocessor);
    }
}

/// Passes a frame to the bus.
fn send(sent: TimedFrame) {
    if sent.frame.convert().is_none_or(|frame| FRAMES.try_send(frame).is_err()) {
        LOST.fetch_add(1, Relaxed);
    }
}

/// Passes a window to the network.
fn hand_over(coprocessor: &mut Coprocessor) {
    if let Some(window) = coprocessor.window() {
        WINDOW.signal(window);
    }
}

/// Sends the frames. If the bus has not accepted a frame for 20 ms, all are dropped, because old rates are useless.
#[embassy_executor::task]
async fn transmit(mut can: Can<'static>) {
    can.enable().await;
    let (mut can, _) = can.split();
    loop {
        let frame = FRAMES.receive().await;
        let mailbox = can.write(&frame).await.mailbox();
        if with_timeout(Duration::from_millis(20), can.flush(mailbox)).await.is_err() {
            can.abort(mailbox);
            LOST.fetch_add(1 + FRAMES.len() as u32, Relaxed);
            FRAMES.clear();
        }
    }
}

/// Computes the windows, below all other tasks.
#[embassy_executor::task]
async fn compute(mut network: GyroNet<'static, GyroNetState>) {
    loop {
        let window = WINDOW.wait().await;
        ESTIMATE.signal((window.end, network.estimate(&window.features)));
    }
}

/// The executors run in the interrupts of peripherals that are not used.
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
    static RECEIVED: ConstStaticCell<[u8; 256]> = ConstStaticCell::new([0; 256]);

    let parts = embassy_stm32::init(clocks());
    let uart = UartRx::new(parts.USART1, parts.PB7, parts.DMA2_CH2, Interrupts, usart::Config::default())
        .expect("115200 baud from 84 MHz")
        .into_ring_buffered(RECEIVED.take());
    let mut can = Can::new(parts.CAN1, parts.PB8, parts.PB9, Interrupts);
    can.set_bitrate(500_000);
    let network = GyroNet::shipped().expect("it comes with the library");

    interrupt::UART4.set_priority(Priority::P6);
    interrupt::UART5.set_priority(Priority::P7);
    let above = ABOVE.start(interrupt::UART4);
    above.spawn(correct(COPROCESSOR.take(), uart).expect("its only one"));
    above.spawn(transmit(can).expect("its only one"));
    BELOW.start(interrupt::UART5).spawn(compute(network).expect("its only one"));
    loop {
        cortex_m::asm::wfi();
    }
}

/// 168 MHz from a crystal of 25 MHz.
fn clocks() -> embassy_stm32::Config {
    let mut config = embassy_stm32::Config::default();
    config.rcc.hse = Some(rcc::Hse { freq: Hertz(25_000_000), mode: rcc::HseMode::Oscillator });
    config.rcc.pll_src = rcc::PllSource::HSE;
    config.rcc.pll = Some(rcc::Pll {
        prediv: rcc::PllPreDiv::DIV25,
        mul: rcc::PllMul::MUL336,
        divp: Some(rcc::PllPDiv::DIV2),
        // The reset value of Q is not allowed.
        divq: Some(rcc::PllQDiv::DIV7),
        divr: None,
    });
    config.rcc.sys = rcc::Sysclk::PLL1_P;
    config.rcc.apb1_pre = rcc::APBPrescaler::DIV4;
    config.rcc.apb2_pre = rcc::APBPrescaler::DIV2;
    config
}

/// Resets after a panic: silence on the bus is better than a frozen value.
#[panic_handler]
fn panic(_: &PanicInfo) -> ! {
    SCB::sys_reset()
}
