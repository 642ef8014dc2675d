//! The coprocessor under RTIC: samples and frames in one task, the model in a task of lower priority.
//!
//! `cargo run -p gyronet-images --example rtic --features stm32f405 --target thumbv7em-none-eabihf` runs it in QEMU: four
//! seconds of a parked car; the exit status reports whether every frame was sent. Replace the port and the
//! controller of `parked_car.rs` with those of your HAL. The firmware of the repository (`src/bin/coprocessor`) is the
//! complete application.
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(not(target_os = "none"))]
fn main() {
    eprintln!("this example runs on a Cortex-M: add --features stm32f405 --target thumbv7em-none-eabihf");
}

#[cfg(target_os = "none")]
mod parked_car;

#[cfg(target_os = "none")]
#[allow(unsafe_code, reason = "RTIC generates it; none is written here")]
#[rtic::app(device = stm32f4::stm32f405, peripherals = false)]
mod app {
    use crate::parked_car::{Controller, PERIOD_US, Port, exit_at_the_end};
    use cortex_m::peripheral::SYST;
    use cortex_m::peripheral::syst::SystClkSource;
    use gyronet::model::GyroNetState;
    use gyronet::sensor::{serial::Serial, xsens::Mti};
    use gyronet::{Config, Coprocessor, GyroNet, Micros, QueuedCan, WindowNetwork};
    use panic_semihosting as _;
    use stm32f4::stm32f405::Interrupt;

    /// The core clock that QEMU assumes for SysTick.
    const CLOCK_HZ: u32 = 168_000_000;

    #[shared]
    struct Shared {
        coprocessor: &'static mut Coprocessor,
    }

    #[local]
    struct Local {
        imu: Serial<Port, Mti>,
        can: QueuedCan<Controller>,
        now: Micros,
        network: Option<GyroNet<'static, GyroNetState>>,
    }

    #[init(local = [coprocessor: Coprocessor = Coprocessor::new(Config::DEFAULT)])]
    fn init(cx: init::Context) -> (Shared, Local) {
        let coprocessor = cx.local.coprocessor;
        let network = GyroNet::shipped().ok();
        start(cx.core.SYST);
        let (imu, can) = (Serial::new(Port::default(), Mti::new()), QueuedCan::new(Controller::default()));
        (Shared { coprocessor }, Local { imu, can, now: Micros(0), network })
    }

    /// Starts a timer with the period of the samples. On a board 1 ms reports a silent sensor sooner.
    fn start(mut timer: SYST) {
        timer.set_clock_source(SystClkSource::Core);
        timer.set_reload((u64::from(CLOCK_HZ) * PERIOD_US / 1_000_000 - 1) as u32);
        timer.enable_interrupt();
        timer.enable_counter();
    }

    /// Corrects a sample and sends its frames; the window that becomes due is left to the task below.
    #[task(binds = SysTick, priority = 2, local = [imu, can, now], shared = [coprocessor])]
    fn output(mut cx: output::Context) {
        let (imu, can, now) = (cx.local.imu, cx.local.can, *cx.local.now);
        let inputs = cx.shared.coprocessor.lock(|coprocessor| {
            coprocessor.step(now, imu, can, None);
            *coprocessor.input_counters()
        });
        exit_at_the_end(now, can.controller(), &inputs);
        cx.local.now.0 += PERIOD_US;
        // The task below has the vector of a peripheral that this board does not use.
        rtic::pend(Interrupt::UART5);
    }

    /// Computes a window. The coprocessor uses the estimate two samples later, so its computing time changes no frame.
    #[task(binds = UART5, priority = 1, local = [network], shared = [coprocessor])]
    fn window(mut cx: window::Context) {
        let due = cx.shared.coprocessor.lock(|coprocessor| coprocessor.window());
        if let (Some(due), Some(network)) = (due, cx.local.network) {
            let estimate = network.estimate(&due.features);
            // The coprocessor counts a late estimate.
            let _ = cx.shared.coprocessor.lock(|coprocessor| coprocessor.deliver(due.end, estimate));
        }
    }
}
