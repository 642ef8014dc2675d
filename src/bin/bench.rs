//! Counts the kernels, networks and parsers on the target: one line each, `name cycles=N` from the
//! DWT cycle counter on a board, `name ticks=N` from SysTick where there is none (QEMU).
//!
//! Each measured region lies between two marker instructions that do nothing; an instruction
//! counter in the emulator sums up between them (`tools/bench/m4count.c`). `cargo bench-target`
//! runs all that and prints instructions and modelled cycles.
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(not(target_os = "none"))]
fn main() {
    eprintln!("this is a firmware image: run it with `cargo bench-target`");
}

#[cfg(target_os = "none")]
mod support;

#[cfg(target_os = "none")]
#[path = "support/checkpoint.rs"]
mod checkpoint;

#[cfg(target_os = "none")]
#[path = "support/meter.rs"]
mod meter;

#[cfg(target_os = "none")]
#[path = "support/parsers.rs"]
mod parsers;

#[cfg(target_os = "none")]
mod firmware {
    use crate::meter::Meter;
    use crate::random_records;
    use crate::support::Numbers;
    use core::cell::RefCell;
    use core::hint::black_box;
    use cortex_m::interrupt::Mutex;
    use cortex_m_semihosting::{debug, hprintln};
    use gyronet::model::gyronet::GyroNetState;
    use gyronet::model::{Blob, GyroNet, WindowNetwork, weights};
    use gyronet::nn::bilstm::{Layer, Run};
    use gyronet::nn::dense::Dense;
    use gyronet::nn::lstm::{self, Direction, Scratch};
    use gyronet::window::{FEATURES, Features, WINDOW};
    use panic_semihosting as _;
    #[expect(unused_imports, reason = "brings the interrupt vectors to the linker")]
    use stm32f4::stm32f405 as _;

    random_records!(FOG_1_1, 90, 10, 80, 4);
    random_records!(FOG_1_2, 90, 180, 27, 5);
    random_records!(FOG_2_1, 60, 2, 127, 6);
    random_records!(FOG_2_2, 60, 120, 40, 3);
    random_records!(GYRO_1, 60, 6, 127, 2);

    /// Steps of a FoGNet window.
    const FOG_STEPS: usize = 60;

    /// Working memory of a FoGNet window: its two networks run one after the other.
    struct FogState {
        input: [u32; FOG_STEPS * 5],
        f1: [i32; FOG_STEPS],
        between: [u32; FOG_STEPS * 90],
        first: Scratch<90, 46>,
        second: Scratch<60, 30>,
    }

    static FOG_STATE: Mutex<RefCell<FogState>> = Mutex::new(RefCell::new(FogState {
        input: [0; _],
        f1: [0; _],
        between: [0; _],
        first: Scratch::ZERO,
        second: Scratch::ZERO,
    }));

    #[cortex_m_rt::entry]
    fn main() -> ! {
        if let Some(p) = cortex_m::Peripherals::take() {
            run(&mut Meter::new(p.SYST, p.DCB, p.DWT));
        }
        debug::exit(debug::EXIT_SUCCESS);
        loop {
            cortex_m::asm::wfi();
        }
    }

    fn run(meter: &mut Meter) {
        meter.run("empty", || {});
        gyronet(meter);
        kernels(meter);
        crate::parsers::run(meter);
        cortex_m::interrupt::free(|cs| fognet(meter, &mut FOG_STATE.borrow(cs).borrow_mut()));
        hprintln!("gyronet/state bytes={}", size_of::<GyroNetState>());
        hprintln!("fognet/state bytes={}", size_of::<FogState>());
        hprintln!("gyronet/weights bytes={}", weights::DEFAULT.0.len());
    }

    fn gyronet(meter: &mut Meter) {
        let Ok(blob) = Blob::new_checked(&weights::DEFAULT.0) else {
            hprintln!("FAILED: the weight file is refused");
            return;
        };
        let mut network = GyroNet::new(blob);
        let mut numbers = Numbers::new(9);
        let mut window: [Features; WINDOW] = [[0; FEATURES]; WINDOW];
        // The same work for any input: ten random windows, zeros, the ends of the range.
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
        meter.run("gyronet/newest", || {
            black_box(network.estimate_newest(black_box(&window)));
        });
        network.start(&window);
        meter.run("gyronet/piece", || {
            black_box(network.advance());
        });
        match crate::checkpoint::network() {
            Some(mut reference) => meter.run("gyronet/f32", || {
                black_box(reference.estimate(black_box(&window)));
            }),
            None => hprintln!("FAILED: the checkpoint is not to be read"),
        }
    }

    fn kernels(meter: &mut Meter) {
        let mut scratch = Scratch::<60, 30>::ZERO;
        let x = [0x0123_4567; 120];
        let (narrow, wide) = (GYRO_1.direction(60, 6), FOG_2_2.direction(60, 120));
        meter.run("kernel/project_6x60", || lstm::project(&narrow, &x[..6], &mut scratch.projection));
        meter.run("kernel/project_120x60", || lstm::project(&wide, &x, &mut scratch.projection));
        let Scratch { cell_state, hidden: [a, b], projection: [projection, _] } = &mut scratch;
        meter.run("kernel/step_60_first", || lstm::step(&wide, projection, None, cell_state, a));
        meter.run("kernel/step_60", || lstm::step(&wide, projection, Some(a), cell_state, b));
        meter.run("kernel/dense_60", || {
            black_box(Dense::partial(black_box(&[3; 60]), b));
        });
    }

    /// Both directions from one set of weights.
    fn layer(direction: Direction<'_>) -> Layer<'_> {
        Layer { forward: direction, backward: direction }
    }

    /// The recurrent part of FoGNet at its sizes, weights random: LSTM1 with FC1, then LSTM2.
    fn fognet(meter: &mut Meter, state: &mut FogState) {
        let FogState { input, f1, between, first, second } = state;
        let mut numbers = Numbers::new(11);
        input.iter_mut().for_each(|word| *word = gyronet::nn::pack(numbers.within(1024) as i16, 512));
        let lstm1 = [layer(FOG_1_1.direction(90, 10)), layer(FOG_1_2.direction(90, 180))];
        let lstm2 = [layer(FOG_2_1.direction(60, 2)), layer(FOG_2_2.direction(60, 120))];
        meter.run("fognet/window", || {
            let mut run = Run::new();
            while run.advance(&lstm1, input, between, first, |_, step, hidden| {
                f1[step] = f1[step].wrapping_add(Dense::partial(&[5; 90], hidden));
            }) {}
            for (word, sum) in input.iter_mut().zip(f1.iter()) {
                *word = gyronet::nn::pack((*sum >> 16) as i16, 256);
            }
            let mut run = Run::new();
            let mut f2 = 0i32;
            while run.advance(
                &lstm2,
                &input[..FOG_STEPS],
                &mut between[..FOG_STEPS * 60],
                second,
                |_, _, hidden| {
                    f2 = f2.wrapping_add(Dense::partial(&[5; 60], hidden));
                },
            ) {}
            black_box(f2);
        });
        let mut run = Run::new();
        // Past both directions of layer 1, and the first piece of layer 2: the longest ones.
        for _ in 0..=FOG_STEPS {
            run.advance(&lstm1, input, between, first, |_, _, _| {});
        }
        meter.run("fognet/piece", || {
            run.advance(&lstm1, input, between, first, |_, _, _| {});
        });
    }
}
