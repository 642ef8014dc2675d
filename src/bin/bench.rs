//! Benchmark of the kernels and networks on the target. Prints one line for each: `name stack=N`, with
//! `cycles=N` from the DWT cycle counter where that runs (on a board).
//!
//! Each measured region is enclosed by two marker instructions that do nothing; a plugin of the emulator counts the
//! instructions between them (`tools/bench/m4count.c`). `cargo bench-target` runs all that and prints instructions
//! and modelled cycles.
#![no_std]
#![no_main]

#[path = "support/meter.rs"]
mod meter;
mod support;

use crate::meter::Meter;
use crate::support::Numbers;
use crate::support::random_model;
use core::cell::RefCell;
use core::hint::black_box;
use cortex_m::interrupt::Mutex;
use cortex_m_semihosting::{debug, hprintln};
use gyronet::model::blob::Shape;
use gyronet::model::fognet::{FogNetState, MinuteNetwork};
use gyronet::model::gyronet::LargestState;
use gyronet::model::seconds::{Minute, STEPS, Second};
use gyronet::model::window::{FEATURES, Features, WINDOW};
use gyronet::model::{Blob, FogBlob, FogNet, GyroNet, WindowNetwork, weights};
use gyronet::nn::Aligned;
use gyronet::nn::lstm::{self, Scratch};
use gyronet::units::Angle;
use panic_semihosting as _;
#[expect(unused_imports, reason = "brings the interrupt vectors to the linker")]
use stm32f4::stm32f405 as _;

random_records!(FOG_2_2, 60, 120, 40, 3);

static FOG: Mutex<RefCell<(FogNetState, Minute)>> =
    Mutex::new(RefCell::new((FogNetState::ZERO, Minute::EMPTY)));

#[cortex_m_rt::entry]
fn main() -> ! {
    if let Some(p) = cortex_m::Peripherals::take() {
        run(&mut Meter::new(p.DCB, p.DWT));
    }
    debug::exit(debug::EXIT_SUCCESS);
    loop {
        cortex_m::asm::wfi();
    }
}

fn run(meter: &mut Meter) {
    meter.run("empty", || {});
    gyronet(meter);
    cortex_m::interrupt::free(|cs| fognet(meter, &mut FOG.borrow(cs).borrow_mut()));
    kernels(meter);
    hprintln!("gyronet/state bytes={}", size_of::<LargestState>());
    hprintln!("gyronet/weights bytes={}", weights::GYRONET.0.len());
    hprintln!("fognet/state bytes={}", size_of::<FogNetState>());
    hprintln!("fognet/weights bytes={}", weights::FOGNET.0.len());
}

fn gyronet(meter: &mut Meter) {
    let Ok(blob) = Blob::new_checked(&weights::GYRONET.0) else {
        hprintln!("FAILED: the weight file is refused");
        return;
    };
    // Too large for the stack.
    let Some(state) = cortex_m::singleton!(: LargestState = LargestState::ZERO) else { return };
    sizes(meter, state);
    let Ok(mut network) = GyroNet::with_state(blob, state) else { return };
    let mut numbers = Numbers::new(9);
    let mut window: [Features; WINDOW] = [[0; FEATURES]; WINDOW];
    // Any input must cost the same: ten random windows, zeros, and the ends of the range.
    for n in 0..12 {
        for value in window.iter_mut().flatten() {
            *value = match n {
                10 => 0,
                11 => [i32::MAX, i32::MIN][numbers.next() as usize % 2],
                _ => numbers.within(1 << 24),
            };
        }
        let name = match n {
            0 => "gyronet/window",
            10 => "gyronet/window/zero",
            11 => "gyronet/window/extreme",
            _ => "gyronet/window/random",
        };
        meter.run(name, || {
            black_box(network.estimate(black_box(&window)));
        });
    }
}

fn fognet(meter: &mut Meter, (state, minute): &mut (FogNetState, Minute)) {
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
}

/// Measures a window of models with a linear part and 0 to 32 units, of the paper's model, and of the default
/// one.
fn sizes(meter: &mut Meter, state: &mut LargestState) {
    macro_rules! model {
        ($units:literal) => {{
            const SHAPE: Shape = Shape { units: $units, linear: true };
            static FILE: Aligned<[u8; SHAPE.file_len(0)]> = Aligned(random_model::file(SHAPE, 19));
            (concat!("units_", $units, "/window"), FILE.0.as_slice())
        }};
    }
    // Flash has no room for a second model of the paper's size.
    let paper = ("units_60/window", weights::GYRONET.0.as_slice());
    let default = ("default/window", weights::DEFAULT.0.as_slice());
    let models = [model!(0), model!(8), model!(16), model!(32), paper, default];
    let window = random_model::window(&mut Numbers::new(19), 0);
    for (name, file) in models {
        let network = Blob::new_checked(file).and_then(|blob| GyroNet::with_state(blob, &mut *state));
        match network {
            Ok(mut network) => meter.run(name, || {
                black_box(network.estimate(black_box(&window)));
            }),
            Err(error) => hprintln!("FAILED: {}", error),
        }
    }
}

fn kernels(meter: &mut Meter) {
    // Too large for the stack.
    let Some(scratch) = cortex_m::singleton!(: Scratch<60, 30, 5> = Scratch::ZERO) else { return };
    let (x, weights) = ([0x0123_4567; 5 * 120], FOG_2_2.direction(60, 120));
    let pair = &mut scratch.projection[..1];
    meter.run("kernel/project_120x60", || lstm::project(&weights, &x[..120], pair));
    meter.run("kernel/project_120x60x5", || lstm::project(&weights, &x, &mut scratch.projection));
    let Scratch { cell_state, hidden: [a, b], projection: [[projection, _], ..] } = scratch;
    meter.run("kernel/step_60", || lstm::step(&weights, projection, Some(a), cell_state, b));
}
