//! The C interface: its header is made from the Rust source, and `examples/c/main.c`, built with arm-none-eabi-gcc and
//! run in QEMU, sends what this host sends for the same bytes and frames.

use embedded_can::{Frame, Id};
use gyronet::can::wheel::{WheelReceiver, WheelSettings};
use gyronet::coprocessor::{Config, Coprocessor, TimedFrame};
use gyronet::sample::{PERIOD_US, TestSignal};
use gyronet::sensor::xsens::{MtData2, Mti};
use gyronet::sensor::{ByteSource, Source};
use gyronet::{GyroNet, Micros};
use gyronet_host_tests::recordings::workspace;
use gyronet_host_tests::require::{self, Need};
use gyronet_host_tests::wire::{data_frame, id11};
use gyronet_tools::target::bench;
use gyronet_tools::target::stack::functions;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Steps of 10 ms: the car stands for four seconds, then turns at 6 deg/s, and at the end the sensor is silent.
const STEPS: u32 = 600;
/// The wheels of `main.c` have no fault bit.
const STANDING: [u8; 8] = [0x1A, 0x6F, 0x1A, 0x6F, 0x1A, 0x6F, 0x1A, 0x6F];
const DRIVING: [u8; 8] = [0x27, 0x10, 0x26, 0x10, 0x27, 0x10, 0x26, 0x10];

fn folder() -> PathBuf {
    workspace().join("examples/c")
}

fn run(command: &mut Command) -> String {
    let output = command.output().unwrap_or_else(|error| panic!("{command:?}: {error}"));
    let text =
        String::from_utf8_lossy(&output.stderr).into_owned() + &String::from_utf8_lossy(&output.stdout);
    assert!(output.status.success(), "{command:?}: {text}");
    text
}

#[test]
fn c_header_is_that_of_the_source() {
    let config = cbindgen::Config::from_file(folder().join("cbindgen.toml")).expect("its settings");
    let made = cbindgen::Builder::new().with_config(config).with_src(folder().join("src/lib.rs")).generate();
    let mut header = Vec::new();
    made.expect("the source can be read").write(&mut header);
    let path = folder().join("gyronet.h");
    if std::env::var_os("GYRONET_WRITE_PAGES").is_some() {
        std::fs::write(&path, &header).expect("the header can be written");
    }
    assert!(std::fs::read(path).ok() == Some(header), "stale: run this test with GYRONET_WRITE_PAGES=1");
}

fn inputs() -> impl Iterator<Item = (u64, Vec<[u8; 8]>, Vec<u8>)> {
    (0..STEPS).map(|step| {
        let stands = step < 400;
        let sample = TestSignal::turning(if stands { 0.5 } else { 6.5 }).sample(step);
        let bytes = MtData2::of(&sample, step as u16).emit().to_vec();
        let frames = if step % 2 == 0 { vec![if stands { STANDING } else { DRIVING }] } else { vec![] };
        (u64::from(step) * PERIOD_US, frames, if step < STEPS - 20 { bytes } else { vec![] })
    })
}

fn input_file() -> Vec<u8> {
    let mut file = Vec::new();
    for (now, frames, bytes) in inputs() {
        file.extend(now.to_le_bytes());
        file.push(frames.len() as u8);
        for data in frames {
            file.extend(frame_bytes(0xAA, &data));
        }
        file.push(bytes.len() as u8);
        file.extend(bytes);
    }
    file
}

/// A frame of 11 bits as the structure of C lays it out.
fn frame_bytes(id: u32, data: &[u8]) -> [u8; 16] {
    let mut bytes = [0; 16];
    bytes[..4].copy_from_slice(&id.to_le_bytes());
    bytes[5] = data.len() as u8;
    bytes[6..6 + data.len()].copy_from_slice(data);
    bytes
}

fn host() -> Vec<[u8; 16]> {
    let mut settings = WheelSettings::TOYOTA;
    settings.signals.iter_mut().flatten().for_each(|signal| signal.valid_when = None);
    let wheels = Some(WheelReceiver::new(settings).expect("checked settings"));
    let mut coprocessor = Coprocessor::new(Config { wheels, ..Config::DEFAULT });
    let (mut network, mut mti) = (GyroNet::shipped().expect("its weights"), Mti::new());
    let mut sent = Vec::new();
    let mut sink = |frame: TimedFrame| {
        let Id::Standard(id) = frame.frame.id() else { panic!("29 bits") };
        sent.push(frame_bytes(id.as_raw().into(), frame.frame.data()));
    };
    for (now, frames, bytes) in inputs() {
        let now = Micros(now);
        for data in frames {
            let frame = data_frame(id11(0xAA), &data);
            coprocessor.can(&frame, now).expect("a wheel frame");
        }
        for byte in bytes {
            mti.receive(byte);
            while let Some(sample) = mti.next_sample() {
                coprocessor.imu(sample.expect("a sample"), now, &mut sink).expect("in order");
                coprocessor.estimate(&mut network);
            }
        }
        coprocessor.poll(now, &mut sink).expect("the time goes on");
    }
    sent
}

fn build(scratch: &Path) -> PathBuf {
    let target = scratch.join("images");
    run(Command::new(env!("CARGO"))
        .current_dir(workspace())
        .args(["build", "--release", "--config", "profile.release.debug=false", "--quiet"])
        .args(["-p", "gyronet-c", "--lib", "--target", bench::TARGET])
        .arg("--target-dir")
        .arg(&target));
    let library = target.join(bench::TARGET).join("release/libgyronet_c.a");
    let elf = scratch.join("c-example.elf");
    run(Command::new("arm-none-eabi-gcc")
        .current_dir(folder())
        .args(
            "-mcpu=cortex-m4 -mthumb -mfpu=fpv4-sp-d16 -mfloat-abi=hard -Os -std=c11 -Wall -Wextra -Werror"
                .split(' '),
        )
        .args("-ffreestanding -nostdlib -Wl,--gc-sections -T qemu.ld main.c board_qemu.c".split(' '))
        .arg(library)
        .arg("-o")
        .arg(&elf));
    elf
}

#[test]
fn a_board_in_c_sends_what_the_host_sends() {
    let Some(()) = require::qemu() else { return };
    let Some(()) = require::program(Need::Gcc, "arm-none-eabi-gcc") else { return };
    let elf = build(Path::new(env!("CARGO_TARGET_TMPDIR")));
    let symbols = functions(&std::fs::read(&elf).expect("just built")).expect("an image");
    let panics: Vec<_> = symbols.iter().filter(|name| name.contains("panic")).collect();
    assert!(panics.is_empty(), "the library can panic: {panics:?}");
    let run_in = tempfile::tempdir().expect("a folder");
    std::fs::write(run_in.path().join("input.bin"), input_file()).expect("the input");
    run(Command::new("qemu-system-arm")
        .current_dir(run_in.path())
        .args([
            "-machine",
            bench::MACHINE,
            "-nographic",
            "-semihosting-config",
            "enable=on,target=native",
            "-kernel",
        ])
        .arg(&elf));
    let sent = std::fs::read(run_in.path().join("output.bin")).expect("the frames");
    let whole = |frame: &[u8]| {
        frame_bytes(u32::from_le_bytes([frame[0], frame[1], frame[2], frame[3]]), &frame[6..14])
    };
    let sent: Vec<[u8; 16]> = sent.chunks_exact(16).map(whole).collect();
    let expected = host();
    assert!(expected.len() > 3_000, "{}", expected.len());
    let first = sent.iter().zip(&expected).position(|(sent, expected)| sent != expected);
    assert_eq!((first, sent.len()), (None, expected.len()));
}
