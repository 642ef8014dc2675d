//! `own_board.rs` as an image for a Cortex-M: replace the port and the controller of `parked_car.rs` with those of your
//! HAL, and the clock with your timer.
//!
//! `cargo run -p gyronet-images --example cortex_m --features stm32f405 --target thumbv7em-none-eabihf` runs it in QEMU: four
//! seconds of a parked car; the exit status reports whether every frame was sent.
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(not(target_os = "none"))]
fn main() {
    eprintln!("this example runs on a Cortex-M: add --features stm32f405 --target thumbv7em-none-eabihf");
}

#[cfg(target_os = "none")]
mod own_board;
#[cfg(target_os = "none")]
mod parked_car;

#[cfg(target_os = "none")]
mod firmware {
    use crate::own_board::poll;
    use crate::parked_car::{Bus, PERIOD_US, Port, exit_at_the_end};
    use cortex_m_semihosting::debug;
    use gyronet::model::gyronet::GyroNetState;
    use gyronet::sensor::{serial::Serial, xsens::Mti};
    use gyronet::{Blob, Config, Coprocessor, GyroNet, Micros, TransmitQueue, weights};
    use panic_semihosting as _;
    #[expect(unused_imports, reason = "links the interrupt vectors")]
    use stm32f4::stm32f405 as _;

    type Network = GyroNet<'static, &'static mut GyroNetState>;

    #[cortex_m_rt::entry]
    fn main() -> ! {
        match parts() {
            Some((coprocessor, network)) => run(coprocessor, network),
            None => loop {
                debug::exit(debug::EXIT_FAILURE);
            },
        }
    }

    /// Creates both over statics, because they are too large for the stack (about 10 and 27 KB).
    fn parts() -> Option<(&'static mut Coprocessor, Network)> {
        let coprocessor = cortex_m::singleton!(: Coprocessor = Coprocessor::START)?;
        coprocessor.configure(&Config::DEFAULT);
        let state = cortex_m::singleton!(: GyroNetState = GyroNetState::ZERO)?;
        let weights = Blob::new_checked(&weights::DEFAULT.0).ok()?;
        Some((coprocessor, GyroNet::with_state(weights, state).ok()?))
    }

    fn run(coprocessor: &mut Coprocessor, mut network: Network) -> ! {
        let mut imu = Serial::new(Port::default(), Mti::new());
        let (mut queue, mut can) = (TransmitQueue::new(), Bus::default());
        let mut now = Micros(0);
        loop {
            poll(coprocessor, &mut network, &mut imu, &mut queue, &mut can, now);
            exit_at_the_end(now, &can, coprocessor.input_counters().imu_errors + queue.dropped());
            // A board reads its timer here.
            now.0 += PERIOD_US;
        }
    }
}
