//! `examples/embassy` on the virtual NUCLEO-H563ZI: it sends what the host makes of the same samples on a bus with CAN FD, and
//! nothing old after the bus was away.

use crate::common::{IMU, SAMPLE, SET, drive, frames};
use gyronet::can::DataFrame;
use gyronet::can::wheel::{WheelReceiver, WheelSettings};
use gyronet::sensor::xsens::Mti;
use gyronet::{Blob, Config, Coprocessor, GyroNet, Micros, TimedFrame, WindowNetwork, weights};
use gyronet_host_tests::board::Board;
use gyronet_host_tests::recordings::workspace;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Duration;

/// Time from power-on to the first sample.
const BEGIN: Duration = Duration::from_millis(100);

fn elf() -> PathBuf {
    const TARGET: &str = "thumbv8m.main-none-eabihf";
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("nucleo");
    let cargo = Command::new(env!("CARGO"))
        .current_dir(workspace())
        .args(["build", "--release", "--locked", "--quiet", "--manifest-path", "examples/embassy/Cargo.toml"])
        .args(["--target", TARGET, "--target-dir"])
        .arg(&folder)
        .status();
    assert!(cargo.is_ok_and(|status| status.success()), "the example is built");
    folder.join(TARGET).join("release/gyronet-nucleo")
}

fn host(samples: &[Vec<u8>]) -> Vec<DataFrame> {
    let wheels = WheelReceiver::new(WheelSettings::TOYOTA).ok();
    let mut coprocessor = Coprocessor::new(Config { wheels, ..Config::DEFAULT });
    let mut network =
        GyroNet::new(Blob::new_checked(&weights::DEFAULT.0).expect("they come with the library"));
    let (mut mti, mut made) = (Mti::new(), Vec::new());
    for (k, byte) in
        samples.iter().enumerate().flat_map(|(k, sample)| sample.iter().map(move |byte| (k, byte)))
    {
        mti.receive(*byte);
        while let Some(sample) = mti.next_sample() {
            let now = Micros(10_000 * k as u64);
            let mut send = |sent: TimedFrame| made.push(sent.frame);
            coprocessor.imu(sample.expect("a sample"), now, &mut send).expect("in order");
            if let Some(window) = coprocessor.window() {
                coprocessor
                    .deliver(window.end, network.estimate(&window.features))
                    .expect("the one that is due");
            }
        }
    }
    made
}

/// A board that has just been switched on, and the samples that it will receive.
fn boot(test: &str, samples: usize) -> Option<(Board, Vec<Vec<u8>>)> {
    let mut board = Board::of("stm32h563", test, &elf())?;
    board.power_on();
    let samples = drive(samples);
    for (k, sample) in samples.iter().enumerate() {
        board.send_at(IMU, sample, BEGIN + SAMPLE * k as u32);
    }
    Some((board, samples))
}

#[test]
#[ignore = "it builds embassy, which takes a minute"]
fn a_nucleo_sends_what_the_host_makes_and_nothing_old() {
    const SAMPLES: usize = 450;
    const AWAY: usize = 40;
    const FD: usize = 64;
    let test = "a_nucleo_sends_what_the_host_makes_and_nothing_old";
    let Some((mut board, samples)) = boot(test, SAMPLES + 2 * AWAY) else { return };
    let made = host(&samples);
    for k in 0..SAMPLES / 2 {
        board.can_fd_send_at(0x300, &[k as u8; FD], BEGIN + SAMPLE * 2 * k as u32);
    }
    board.run(BEGIN + SAMPLE * SAMPLES as u32);
    let sent = frames(&board.can_frames());
    println!("{test}: {} frames", sent.len());
    assert_eq!(sent.len(), SET * SAMPLES);
    assert!(sent == made[..sent.len()], "in order, and the same");

    board.configure("FDCAN1.connected", false);
    board.run(SAMPLE * AWAY as u32);
    assert_eq!(board.can_frames().len(), 0);
    board.configure("FDCAN1.connected", true);
    board.run(SAMPLE * AWAY as u32);
    let sent = frames(&board.can_frames());
    let first = made.iter().position(|frame| *frame == sent[0]).expect("the host's");
    println!("{test}: sample {} is the first after {}", first / SET, SAMPLES + AWAY);
    assert!(first >= SET * (SAMPLES + AWAY - 3) && sent.len() > SET * (AWAY - 10));
}
