//! Benchmark of the kernels and networks on the target. Prints one line for each: `name stack=N`, with
//! `cycles=N` from the DWT cycle counter where that runs (on a board).
//!
//! Each measured region is enclosed by two marker instructions that do nothing; a plugin of the emulator counts the
//! instructions between them (`tools/bench/m4count.c`). `cargo bench-target` runs all that and prints instructions
//! and modelled cycles.
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(not(target_os = "none"))]
fn main() {
    eprintln!("this is a firmware image: run it with `cargo bench-target`");
}

#[cfg(target_os = "none")]
mod support;

#[cfg(target_os = "none")]
#[path = "support/meter.rs"]
mod meter;

#[cfg(target_os = "none")]
mod firmware {
    use crate::meter::Meter;
    use crate::random_records;
    use crate::support::Numbers;
    use crate::support::random_model;
    use core::cell::RefCell;
    use core::hint::black_box;
    use core::mem::MaybeUninit;
    use cortex_m::interrupt::Mutex;
    use cortex_m_semihosting::{debug, hprintln};
    use embedded_can::{Frame, StandardId};
    use gyronet::can::DataFrame;
    use gyronet::can::wheel::{WheelReceiver, WheelSettings};
    use gyronet::fog::FogCorrector;
    use gyronet::model::blob::{HIDDEN, Shape};
    use gyronet::model::fognet::{FogNetState, MinuteNetwork};
    use gyronet::model::gyronet::GyroNetState;
    use gyronet::model::seconds::{Minute, STEPS, Second};
    use gyronet::model::window::{FEATURES, Features, WINDOW};
    use gyronet::model::{Blob, Estimate, FogBlob, FogNet, GyroNet, WindowNetwork, weights};
    use gyronet::nn::Aligned;
    use gyronet::nn::dense::Dense;
    use gyronet::nn::lstm::{self, DirectionWeights, Scratch};
    use gyronet::sample::{ImuSample, PERIOD_US, Validity};
    use gyronet::uds::signature;
    use gyronet::units::{Angle, AngularRate, Micros, SpecificForce};
    use gyronet::{Config, Coprocessor, TimedFrame};
    use panic_semihosting as _;
    #[expect(unused_imports, reason = "brings the interrupt vectors to the linker")]
    use stm32f4::stm32f405 as _;

    random_records!(FOG_2_2, 60, 120, 40, 3);
    random_records!(GYRO_1, 60, 6, 127, 2);

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
        coprocessor(meter);
        kernels(meter);
        signature(meter);
        hprintln!("gyronet/state bytes={}", size_of::<GyroNetState<HIDDEN>>());
        hprintln!("gyronet/weights bytes={}", weights::GYRONET.0.len());
        hprintln!("fognet/state bytes={}", size_of::<FogNetState>());
        hprintln!("fognet/corrector bytes={}", size_of::<FogCorrector>());
        hprintln!("fognet/weights bytes={}", weights::FOGNET.0.len());
    }

    fn gyronet(meter: &mut Meter) {
        let Ok(blob) = Blob::new_checked(&weights::GYRONET.0) else {
            hprintln!("FAILED: the weight file is refused");
            return;
        };
        // Too large for the stack.
        let Some(state) = cortex_m::singleton!(: GyroNetState<HIDDEN> = GyroNetState::ZERO) else { return };
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
        network.start(&window);
        meter.run("gyronet/piece", || {
            black_box(network.advance());
        });
    }

    /// Measures whole windows of FoGNet, the start of one, and its longest piece.
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

    /// Measures a window of models with a linear part and 0 to 32 units, of the paper's model, and of the default
    /// one.
    fn sizes(meter: &mut Meter, state: &mut GyroNetState<HIDDEN>) {
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

    /// Measures the coprocessor without the network: five samples, each with a frame of standing wheels and the
    /// message set that the sample produces. One of the five takes the next window and delivers an estimate.
    fn coprocessor(meter: &mut Meter) {
        let Some(place) = cortex_m::singleton!(: MaybeUninit<Coprocessor> = MaybeUninit::uninit()) else {
            return;
        };
        let wheels = WheelReceiver::new(WheelSettings::TOYOTA).ok();
        let coprocessor = place.write(Coprocessor::new(Config { wheels, ..Config::DEFAULT }));
        // 0x1A6F is 6767: -67.67 + 0.01 x 6767 km/h is standstill.
        let Some(standing) = StandardId::new(0xAA)
            .and_then(|id| DataFrame::new(id, &[0x1A, 0x6F, 0x1A, 0x6F, 0x1A, 0x6F, 0x1A, 0x6F]))
        else {
            return;
        };
        let mut numbers = Numbers::new(3);
        let mut five_samples = |from: u32| {
            for tick in from..from + 5 {
                let time = Micros(u64::from(tick) * PERIOD_US);
                let sample = ImuSample {
                    time,
                    specific_force: [
                        SpecificForce(numbers.within(1 << 14)),
                        SpecificForce(0),
                        SpecificForce(10_286_530),
                    ],
                    angular_rate: [AngularRate(0), AngularRate(0), AngularRate(numbers.within(1 << 18))],
                    temperature: None,
                    validity: Validity::Good,
                };
                let _ = black_box(coprocessor.can(black_box(&standing), time));
                let mut send = |sent: TimedFrame| {
                    black_box(sent);
                };
                let _ = black_box(coprocessor.imu(black_box(sample), time, &mut send));
                if let Some(due) = coprocessor.window() {
                    let estimate = Estimate { corrections: [AngularRate(1_000); WINDOW], ..Estimate::NONE };
                    let _ = coprocessor.deliver(due.end, estimate);
                }
            }
        };
        // Run past static initialisation and the first windows.
        (0..80).for_each(|n| five_samples(5 * n));
        meter.run("coprocessor/five_samples", || five_samples(400));
    }

    /// Measures the check of a valid signature (RFC 8032 7.1, test 1), and the digest of a block of a download.
    fn signature(meter: &mut Meter) {
        const PUBLIC: [u8; 32] = *b"\xd7\x5a\x98\x01\x82\xb1\x0a\xb7\xd5\x4b\xfe\xd3\xc9\x64\x07\x3a\x0e\xe1\x72\xf3\xda\xa6\x23\x25\xaf\x02\x1a\x68\xf7\x07\x51\x1a";
        const SIGNATURE: [u8; 64] = *b"\xe5\x56\x43\x00\xc3\x60\xac\x72\x90\x86\xe2\xcc\x80\x6e\x82\x8a\x84\x87\x7f\x1e\xb8\xe5\xd9\x74\xd8\x73\xe0\x65\x22\x49\x01\x55\x5f\xb8\x82\x15\x90\xa3\x3b\xac\xc6\x1e\x39\x70\x1c\xf9\xb4\x6b\xd2\x5b\xf5\xf0\x59\x5b\xbe\x24\x65\x51\x41\x43\x8e\x7a\x10\x0b";
        let mut is_valid = false;
        meter.run("signature/verify", || is_valid = signature::is_valid(&PUBLIC, &[], &SIGNATURE));
        if !is_valid {
            hprintln!("signature/verify: refused");
        }
        meter.run("signature/block", || _ = signature::digest(black_box(&[0x55; 256])));
    }

    fn kernels(meter: &mut Meter) {
        // Too large for the stack.
        let scratch = cortex_m::singleton!(: Scratch<60, 30, 5> = Scratch::ZERO);
        let room = cortex_m::singleton!(: [u32; DirectionWeights::recurrent_words(60)] = [0; _]);
        let Some((scratch, room)) = scratch.zip(room) else { return };
        let x = [0x0123_4567; 5 * 120];
        let (narrow, wide) = (GYRO_1.direction(60, 6), FOG_2_2.direction(60, 120));
        let pair = &mut scratch.projection[..1];
        meter.run("kernel/project_6x60", || lstm::project(&narrow, &x[..6], pair));
        meter.run("kernel/project_120x60", || lstm::project(&wide, &x[..120], pair));
        meter.run("kernel/project_120x60x5", || lstm::project(&wide, &x, &mut scratch.projection));
        meter.run("kernel/copy_60", || {
            black_box(wide.through(room, true));
        });
        let Scratch { cell_state, hidden: [a, b], projection: [[projection, _], ..] } = scratch;
        meter.run("kernel/step_60_first", || lstm::step(&wide, projection, None, cell_state, a));
        meter.run("kernel/step_60", || lstm::step(&wide, projection, Some(a), cell_state, b));
        let near = wide.through(room, false);
        meter.run("kernel/step_60_from_ram", || lstm::step(&near, projection, Some(a), cell_state, b));
        meter.run("kernel/dense_60", || {
            black_box(Dense::partial(black_box(&[3; 60]), b));
        });
    }
}
