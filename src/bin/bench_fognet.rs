//! Benchmark of FoGNet on the target, as `bench` is for GyroNet. It is an image of its own because flash cannot hold
//! both networks and the f32 checkpoint of `bench`.
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(not(target_os = "none"))]
fn main() {
    eprintln!("this is a firmware image: run it with `cargo bench-target`");
}

#[cfg(target_os = "none")]
#[path = "support/meter.rs"]
mod meter;

#[cfg(target_os = "none")]
#[path = "support/numbers.rs"]
mod numbers;

#[cfg(target_os = "none")]
mod firmware {
    use crate::meter::Meter;
    use crate::numbers::Numbers;
    use core::cell::RefCell;
    use core::hint::black_box;
    use cortex_m::interrupt::Mutex;
    use cortex_m_semihosting::{debug, hprintln};
    use gyronet::fog::FogCorrector;
    use gyronet::model::fognet::{FogNetState, MinuteNetwork};
    use gyronet::model::seconds::{Minute, STEPS, Second};
    use gyronet::model::{FogBlob, FogNet, weights};
    use gyronet::units::Angle;
    use panic_semihosting as _;
    #[expect(unused_imports, reason = "brings the interrupt vectors to the linker")]
    use stm32f4::stm32f405 as _;

    static STATE: Mutex<RefCell<FogNetState>> = Mutex::new(RefCell::new(FogNetState::ZERO));
    static MINUTE: Mutex<RefCell<Minute>> = Mutex::new(RefCell::new(Minute::EMPTY));

    #[cortex_m_rt::entry]
    fn main() -> ! {
        if let Some(p) = cortex_m::Peripherals::take() {
            let mut meter = Meter::new(p.DCB, p.DWT);
            cortex_m::interrupt::free(|cs| {
                let (state, minute) = (STATE.borrow(cs), MINUTE.borrow(cs));
                fognet(&mut meter, &mut state.borrow_mut(), &mut minute.borrow_mut());
            });
        }
        hprintln!("fognet/state bytes={}", size_of::<FogNetState>());
        hprintln!("fognet/corrector bytes={}", size_of::<FogCorrector>());
        hprintln!("fognet/weights bytes={}", weights::FOGNET.0.len());
        debug::exit(debug::EXIT_SUCCESS);
        loop {
            cortex_m::asm::wfi();
        }
    }

    /// Measures whole windows, the start of a window, and its longest piece.
    fn fognet(meter: &mut Meter, state: &mut FogNetState, minute: &mut Minute) {
        let Ok(blob) = FogBlob::new_checked(&weights::FOGNET.0) else {
            hprintln!("FAILED: FoGNet's weight file is refused");
            return;
        };
        let mut network = FogNet::new(blob, state);
        let mut numbers = Numbers::new(11);
        for name in ["fognet/window", "fognet/window/random", "fognet/window/zero"] {
            for _ in 0..STEPS {
                let mut second = Second { features: [0; _], turn: Angle::ZERO };
                if name != "fognet/window/zero" {
                    second.features.iter_mut().for_each(|value| *value = numbers.within(1 << 24));
                    second.turn = Angle(i64::from(numbers.within(1 << 29)) << 12);
                }
                minute.add(second);
            }
            let Some(window) = minute.window() else { return };
            meter.run(name, || {
                black_box(network.estimate(black_box(&window)));
            });
        }
        let Some(window) = minute.window() else { return };
        meter.run("fognet/start", || network.start(&window));
        // Skip both directions of layer 1, and the first piece of layer 2: the pieces that follow are the longest.
        for _ in 0..=STEPS {
            network.advance();
        }
        meter.run("fognet/piece", || {
            black_box(network.advance());
        });
    }
}
