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
    use cortex_m_semihosting::{debug, hprintln};
    use gyronet::health::{Source, Status};
    use gyronet::model::gyronet::{GyroNetState, recurrent_words};
    use gyronet::sample::Validity;
    use gyronet::units::SpecificForce;
    use gyronet::{
        AngularRate, Blob, Coprocessor, GyroNet, ImuSample, Micros, TimedFrame, WindowNetwork, weights,
    };
    use panic_semihosting as _;

    /// Units of the default model's Bi-LSTM.
    const UNITS: usize = 4;
    const HALF: usize = UNITS / 2;
    const RECURRENT: usize = recurrent_words(UNITS);
    /// The state of the default model, without room for a larger one; it is not on the stack.
    type State = GyroNetState<UNITS, HALF, RECURRENT>;
    type Model = GyroNet<'static, &'static mut State, UNITS, HALF, RECURRENT>;

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
        let state = cortex_m::singleton!(: State = GyroNetState::ZERO)?;
        let coprocessor = cortex_m::singleton!(: Coprocessor = Coprocessor::START)?;
        Some((coprocessor, Model::with_state(blob, state).ok()?))
    }

    /// Corrects five seconds of samples. Returns whether the last rate is the network's, and within 1 % of the turn's.
    fn run(coprocessor: &mut Coprocessor, mut network: Model) -> bool {
        let mut last = None;
        for number in 0..500 {
            let now = Micros(10_000 * u64::from(number));
            // Pass the frames to your CAN controller here.
            let mut send = |sent: TimedFrame| {
                core::hint::black_box(sent.frame);
            };
            last = coprocessor.imu(read(number, now), now, &mut send).ok();
            if let Some(window) = coprocessor.window() {
                let _ = coprocessor.deliver(window.end, network.estimate(&window.features));
            }
        }
        let Some(rate) = last.map(|last| last.vehicle.prompt) else { return false };
        hprintln!("corrected yaw rate {}e-6 rad/s", (1e6 * rate.rate.rad_per_sec()) as i32);
        let good = rate.status == Status::Ready && rate.source == Source::GyroNet;
        good && (rate.rate.rad_per_sec() - 0.1).abs() < 0.001
    }

    /// Stands in for your sensor: it has a bias of 0.01 rad/s, on a car that is parked for four seconds and then
    /// turns at 0.1 rad/s.
    fn read(number: u32, time: Micros) -> ImuSample {
        // One bit of noise: the monitor reports an axis without noise as stuck.
        let noise = (number % 2) as i32;
        let yaw_rate = if number < 400 { 1_342_177 } else { 14_763_950 };
        ImuSample {
            time,
            specific_force: [noise, noise, 10_286_531 + noise].map(SpecificForce),
            angular_rate: [noise, noise, yaw_rate + noise].map(AngularRate),
            temperature: None,
            validity: Validity::Good,
        }
    }
}
