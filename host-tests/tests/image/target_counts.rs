//! The kernels cost no more on the target than the bars that the project has set itself, counted in
//! the emulator (instructions, and modelled cycles at zero wait states), and they are right there.

use gyronet::model::fognet::{FogNetState, MinuteNetwork};
use gyronet::model::seconds::{Minute, STEPS, Second};
use gyronet::model::window::{Features, WINDOW};
use gyronet::model::{Blob, FogBlob, FogNet, GyroNet, WindowNetwork, weights};
use gyronet::units::Angle;
use gyronet_host_tests::{image, qemu};
use gyronet_tools::target::bench;
use gyronet_tools::target::size::ImageSize;

struct Bar {
    name: &'static str,
    instructions: u64,
    cycles: u64,
}

/// CMSIS-NN s8 takes 3,471,492 instructions and 4,346,655 modelled cycles for a whole window (`--cmsis-nn`).
const BARS: [Bar; 4] = [
    Bar { name: "default/window", instructions: 3_200, cycles: 4_400 },
    Bar { name: "gyronet/window", instructions: 1_345_000, cycles: 1_560_000 },
    Bar { name: "fognet/window", instructions: 23_800_000, cycles: 26_100_000 },
    // What keeps a task of the same priority waiting.
    Bar { name: "fognet/piece", instructions: 210_000, cycles: 230_000 },
];

#[test]
fn kernels_cost_no_more_than_their_bars() {
    let Some(()) = qemu::available() else { return };
    let Some(bench) = image::firmware(env!("CARGO_TARGET_TMPDIR"), bench::IMAGE) else { return };
    let counts = bench::measure(&bench::workspace(), &bench).unwrap_or_else(|error| panic!("{error}"));
    for Bar { name, instructions, cycles } in BARS {
        let count = counts.get(name).expect(name);
        println!("{count:?}");
        assert!(count.instructions <= instructions && count.cycles <= cycles, "{count:?}");
    }
    // Ten random windows, zeros, the ends of the range: the same work to the instruction.
    assert_eq!(counts.starting_with("gyronet/window").count(), 12);
    assert!(counts.constant(), "{counts:?}");

    let size = |name: &str| counts.sizes.iter().find(|(n, _)| n == name).expect("the image prints it").1;
    assert!(size("gyronet/weights") <= 126_000);
    assert!(size("gyronet/state") <= 28_000);
    assert!(size("fognet/state") <= 36_000);
    let stack = counts.get("gyronet/window").expect("measured").stack;
    assert!(stack <= 1_280, "{stack} bytes of stack for a window");
}

#[test]
fn kernels_fit_in_8_kib() {
    let Some(elf) = image::firmware(env!("CARGO_TARGET_TMPDIR"), "coprocessor") else {
        return;
    };
    let size = ImageSize::read(&elf).expect("an ELF file");
    println!("{size:?}");
    assert!(size.kernels > 0 && size.kernels <= 8 * 1024, "{size:?}");
}

/// The kernels on the targets, the Cortex-M4 and the NUCLEO-H563ZI's Cortex-M33, equal their portable definition, and
/// the outputs of GyroNet and FoGNet there equal this host's.
#[test]
fn kernels_on_the_target_equal_the_hosts() {
    let Some(()) = qemu::available() else { return };
    let m33 = ("mps2-an505", "thumbv8m.main-none-eabihf");
    for (board, machine) in [(("netduino-plus-2", bench::TARGET), bench::MACHINE), (m33, m33.0)] {
        let scratch = env!("CARGO_TARGET_TMPDIR");
        let Some(elf) = image::firmware_for(board, scratch, "selftest") else { return };
        assert!(ImageSize::read(&elf).expect("an ELF file").kernels > 0, "{machine} has the DSP extension");
        let (printed, _) = bench::emulate(machine, &elf, &[]).unwrap_or_else(|error| panic!("{error}"));
        println!("{printed}");
        assert!(printed.contains(&format!("gyronet hash={:08x}\n", hash())), "{printed}");
        assert!(printed.contains(&format!("fognet hash={:08x}\n", fognet_hash())), "{printed}");
    }
}

/// Returns the CRC-32 that the self-test prints: over the corrections of sixteen random windows.
fn hash() -> u32 {
    let mut network = GyroNet::new(Blob::new_checked(&weights::GYRONET.0).expect("the weights are good"));
    let mut digest = gyronet::model::blob::CRC.digest();
    let mut numbers = Xorshift(7);
    for _ in 0..16 {
        let window: [Features; WINDOW] = std::array::from_fn(|_| {
            std::array::from_fn(|k| numbers.within(if k < 3 { 10 << 20 } else { 1 << 25 }))
        });
        let estimate = network.estimate(&window);
        for rate in estimate.corrections {
            digest.update(&rate.0.to_le_bytes());
        }
    }
    digest.finalize()
}

/// Returns the CRC-32 that the self-test prints for FoGNet: over the estimates of three random windows.
fn fognet_hash() -> u32 {
    let mut state = FogNetState::ZERO;
    let blob = FogBlob::new_checked(&weights::FOGNET.0).expect("the weights are good");
    let mut network = FogNet::new(blob, &mut state);
    let mut minute = Minute::EMPTY;
    let mut digest = gyronet::model::blob::CRC.digest();
    let mut numbers = Xorshift(8);
    for _ in 0..3 {
        for _ in 0..STEPS {
            let features = std::array::from_fn(|k| {
                numbers.within(if !(3..=5).contains(&k) { 10 << 20 } else { 1 << 25 })
            });
            let turn = Angle(i64::from(numbers.within(1 << 29)) << 14);
            minute.add(Second { features, turn });
        }
        let window = minute.window().expect("it is full");
        let estimate = network.estimate(&window);
        for angle in [estimate.correction, estimate.linear] {
            digest.update(&angle.0.to_le_bytes());
        }
    }
    digest.finalize()
}

/// The images' random numbers (`src/bin/support`).
struct Xorshift(u32);

impl Xorshift {
    fn within(&mut self, limit: i32) -> i32 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 17;
        self.0 ^= self.0 << 5;
        (self.0 >> 1) as i32 % (2 * limit + 1) - limit
    }
}
