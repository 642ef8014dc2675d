//! Window models on cores without the DSP extension: the image `small_core` on an emulated Cortex-M0 and Cortex-M3
//! prints the estimates that this host computes, word by word. How many instructions a window takes is printed.

use gyronet::model::blob::Shape;
use gyronet::model::{Blob, GyroNet, WindowNetwork};
use gyronet::nn::Aligned;
use gyronet_host_tests::{image, models, require};
use gyronet_tools::target::bench;
use std::fmt::Write;

/// A board: its feature and emulated machine, its target, the frequency of its SysTick, and its models with the most
/// instructions that a window may take.
struct Board {
    name: &'static str,
    target: &'static str,
    hertz: u64,
    models: &'static [(u16, u64)],
}

const BOARDS: [Board; 2] = [
    Board {
        name: "microbit",
        target: "thumbv6m-none-eabi",
        hertz: 16_000_000,
        models: &[(0, 36_000), (8, 390_000), (16, 1_010_000)],
    },
    Board {
        name: "lm3s6965evb",
        target: "thumbv7m-none-eabi",
        hertz: 12_500_000,
        models: &[(0, 4_500), (8, 176_000), (16, 505_000), (60, 5_350_000)],
    },
];

/// Output of the image for a model.
fn lines<const LEN: usize>(units: u16) -> Vec<String> {
    let file = Aligned(models::file::<LEN>(Shape { units, linear: true }, 19));
    let mut network = GyroNet::new(Blob::new_checked(&file.0).expect("a random model"));
    let mut numbers = models::Numbers::new(7);
    let line = |n| {
        let estimate = network.estimate(&models::window(&mut numbers, n));
        let mut line = format!("units_{units} {n}");
        for rate in estimate.corrections {
            let _ = write!(line, " {:08x}", rate.0);
        }
        format!("{line} {}", estimate.clamped_inputs)
    };
    (0..8).map(line).collect()
}

fn expected(units: u16) -> Vec<String> {
    macro_rules! sizes {
        ($($units:literal),*) => {
            match units {
                $($units => lines::<{ Shape { units: $units, linear: true }.file_len(0) }>(units),)*
                _ => panic!("no model of {units} units"),
            }
        };
    }
    sizes!(0, 8, 16, 60)
}

#[test]
fn small_cores_compute_what_the_host_does() {
    let Some(()) = require::qemu() else { return };
    for Board { name, target, hertz, models } in BOARDS {
        let elf = image::firmware_for((name, target), env!("CARGO_TARGET_TMPDIR"), "small_core");
        let Some(elf) = elf else { return };
        // An instruction takes a nanosecond.
        let (printed, _) =
            bench::emulate(name, &elf, &["-icount", "shift=0"]).unwrap_or_else(|e| panic!("{e}"));
        for (units, most) in models {
            let head = format!("units_{units} bytes=");
            let line =
                printed.lines().find(|line| line.starts_with(&head)).unwrap_or_else(|| panic!("{printed}"));
            let (_, ticks) = line.split_once("ticks=").expect("the ticks of a window");
            let (ticks, wrapped) = ticks.split_once(' ').expect("whether they are all");
            let instructions = ticks.parse::<u64>().expect("a number") * 1_000_000_000 / hertz;
            println!("{name}: linear part and {units} units: {instructions} instructions a window");
            assert_eq!(wrapped, "wrapped=false");
            assert!(instructions <= *most, "{name}, {units} units: {instructions}");
            let head = format!("units_{units} ");
            let estimates = printed.lines().filter(|line| line.starts_with(&head) && !line.contains('='));
            assert_eq!(estimates.collect::<Vec<_>>(), expected(*units), "{name}, {units} units");
        }
        assert_eq!(printed.lines().filter(|line| line.contains("ticks=")).count(), models.len(), "{printed}");
    }
}
