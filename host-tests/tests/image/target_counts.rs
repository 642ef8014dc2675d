//! The kernels cost no more on the target than the bars that the project has set itself, counted in
//! the emulator (instructions, and modelled cycles at zero wait states), and they are right there.

use gyronet::model::fognet::FogNetState;
use gyronet::model::seconds::Minute;
use gyronet::model::{FogBlob, FogNet, weights};
use gyronet_host_tests::{image, models, require};
use gyronet_tools::target::bench;
use gyronet_tools::target::size::ImageSize;

struct Bar {
    name: &'static str,
    instructions: u64,
    cycles: u64,
}

/// CMSIS-NN s8 takes 3,471,492 instructions and 4,346,655 modelled cycles for a whole window (`--cmsis-nn`).
const BARS: [Bar; 3] = [
    Bar { name: "default/window", instructions: 3_200, cycles: 4_400 },
    Bar { name: "gyronet/window", instructions: 1_345_000, cycles: 1_560_000 },
    Bar { name: "fognet/window", instructions: 23_800_000, cycles: 26_100_000 },
];

#[test]
fn kernels_cost_no_more_than_their_bars() {
    let Some(()) = require::qemu() else { return };
    let Some(bench) = image::firmware(env!("CARGO_TARGET_TMPDIR"), bench::IMAGE) else { return };
    let counts = bench::measure(&bench).unwrap_or_else(|error| panic!("{error}"));
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

/// The kernels on the targets, the Cortex-M4 and the NUCLEO-H563ZI's Cortex-M33, equal their portable definition, and
/// the outputs of GyroNet and FoGNet there equal this host's.
#[test]
fn kernels_on_the_target_equal_the_hosts() {
    let Some(()) = require::qemu() else { return };
    let gyronet = models::hashes::gyronet(&mut models::gyronet());
    let (mut state, mut minute) = (FogNetState::ZERO, Minute::EMPTY);
    let blob = FogBlob::new_checked(&weights::FOGNET.0).expect("the weights are good");
    let fognet = models::hashes::fognet(&mut FogNet::new(blob, &mut state), &mut minute);
    let fognet = fognet.expect("minutes are full");
    let m33 = ("mps2-an505", "thumbv8m.main-none-eabihf");
    for (board, machine) in [(("netduino-plus-2", bench::TARGET), bench::MACHINE), (m33, m33.0)] {
        let scratch = env!("CARGO_TARGET_TMPDIR");
        let Some(elf) = image::firmware_for(board, scratch, "selftest") else { return };
        assert!(
            ImageSize::read(&std::fs::read(&elf).expect("an image")).expect("an ELF file").kernels > 0,
            "{machine} has the DSP extension"
        );
        let (printed, _) = bench::emulate(machine, &elf, &[]).unwrap_or_else(|error| panic!("{error}"));
        println!("{printed}");
        assert!(printed.contains(&format!("gyronet hash={gyronet:08x}\n")), "{printed}");
        assert!(printed.contains(&format!("fognet hash={fognet:08x}\n")), "{printed}");
    }
}
