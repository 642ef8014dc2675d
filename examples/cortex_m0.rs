//! The coprocessor on a Cortex-M0 with 16 KiB of RAM, with the default model.
//!
//! `cargo run -p gyronet-images --release --example cortex_m0 --features microbit --target thumbv6m-none-eabi` runs it in
//! QEMU: a parked car and a turn; the exit status reports whether the last rate is that of the turn.
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(not(target_os = "none"))]
fn main() {
    eprintln!("this example runs on a Cortex-M0: add --features microbit --target thumbv6m-none-eabi");
}

#[cfg(target_os = "none")]
mod firmware {
    use core::convert::Infallible;
    use cortex_m_semihosting::{debug, hprintln};
    use gyronet::health::{Source, Status};
    use gyronet::model::GyroNetState;
    use gyronet::sample::TestSignal;
    use gyronet::{Blob, Bus, Config, Coprocessor, DataFrame, GyroNet, Sink, TimedFrame, weights};
    use panic_semihosting as _;

    type Model = GyroNet<'static, &'static mut GyroNetState>;

    #[cortex_m_rt::entry]
    fn main() -> ! {
        let passed = parts().is_some_and(|(coprocessor, network)| run(coprocessor, network));
        debug::exit(if passed { debug::EXIT_SUCCESS } else { debug::EXIT_FAILURE });
        loop {
            cortex_m::asm::wfi();
        }
    }

    /// Creates both over statics, because they are too large for the stack.
    fn parts() -> Option<(&'static mut Coprocessor, Model)> {
        let blob = Blob::new_checked(&weights::DEFAULT.0).ok()?;
        let state = cortex_m::singleton!(: GyroNetState = GyroNetState::ZERO)?;
        let coprocessor = cortex_m::singleton!(: Coprocessor = const { Coprocessor::new(Config::DEFAULT) })?;
        Some((coprocessor, Model::with_state(blob, state).ok()?))
    }

    /// Corrects five seconds of samples: a car that is parked for four and then turns at 6 deg/s, by a gyro with a bias of
    /// 0.5 deg/s. Returns whether the last rate is the network's, and within 1 % of the turn's.
    fn run(coprocessor: &mut Coprocessor, mut network: Model) -> bool {
        let mut can = NoBus;
        let mut last = None;
        for number in 0..500 {
            let signal = TestSignal::turning(if number < 400 { 0.5 } else { 6.5 });
            let sample = signal.sample(number);
            // Replace it with what your sensor has given: a sample, an error, or nothing.
            let mut reading = Some(Ok::<_, Infallible>(sample));
            last = coprocessor.step(sample.time, &mut reading, &mut can, Some(&mut network)).observation;
        }
        let Some(rate) = last.map(|last| last.vehicle.live) else { return false };
        let deg_per_sec = rate.rate.rad_per_sec().to_degrees();
        hprintln!("corrected yaw rate {} millidegrees a second", (1e3 * deg_per_sec) as i32);
        let good = rate.status == Status::Ready && rate.source == Source::Model;
        good && (deg_per_sec - 6.0).abs() < 0.06
    }

    /// Stands in for your CAN controller; [`gyronet::QueuedCan`] is one over the traits of `embedded-can`.
    struct NoBus;

    impl Sink for NoBus {
        fn frame(&mut self, sent: TimedFrame) {
            core::hint::black_box(sent.frame);
        }
    }

    impl Bus for NoBus {
        fn receive(&mut self) -> Option<DataFrame> {
            None
        }

        fn flush(&mut self) {}

        fn lost(&self) -> u32 {
            0
        }
    }
}
