//! The board of these tests: an MTi on USART1, SLCAN on USART2 at 921600, the service line on USART6, CAN.

use crate::service;
use embedded_can::{Frame, Id};
use gyronet::can::yaw::AngleMessage;
use gyronet::can::{DataFrame, slcan};
use gyronet::health::Faults;
use gyronet::service::message::{AllCounters, Info};
use gyronet_host_tests::board::{self, Board};
use gyronet_host_tests::recordings::workspace;
pub use gyronet_host_tests::wire::id11 as id;
use gyronet_host_tests::{inputs, replay, require};
use gyronet_tools::bundled;
use std::io::Write;
use std::path::PathBuf;
use std::process::{Command, Stdio};
use std::time::Duration;

/// Lines of the board.
pub const IMU: usize = 1;
pub const SLCAN: usize = 2;
pub const SERVICE: usize = 6;
pub const MS: Duration = Duration::from_millis(1);
pub const SECOND: Duration = Duration::from_secs(1);
pub const SAMPLE: Duration = Duration::from_millis(10);
/// Time from power-on until the image listens to all lines: the boot loader checks the image for 170 ms.
pub const START: Duration = Duration::from_millis(300);
/// Frames of a sample.
pub const SET: usize = 6;

/// The image that is flashed, for a test that is skipped (aloud) where it cannot be built.
pub fn elf() -> Option<PathBuf> {
    board::firmware("netduino-plus-2", env!("CARGO_TARGET_TMPDIR"), "coprocessor")
}

/// A board with the image in its flash and without power.
pub fn unpowered() -> Option<Board> {
    let mut board = Board::unpowered(&elf()?)?;
    board.configure("USART2.baud", 921_600);
    board.configure("USART3.baud", 921_600);
    Some(board)
}

/// A board that has just been switched on.
pub fn boot() -> Option<Board> {
    let mut board = unpowered()?;
    board.power_on();
    Some(board)
}

/// A board that listens to all lines.
pub fn started() -> Option<Board> {
    let mut board = boot()?;
    board.run(START);
    Some(board)
}

/// Runs until the core sleeps, so that a register can be changed with no instruction and no handler under way.
pub fn fall_asleep(board: &mut Board) {
    let step = Duration::from_micros(10);
    let is_asleep = |board: &mut Board| {
        let before = board.counts().instructions;
        board.run(step);
        board.counts().instructions == before
    };
    assert!((0..10_000).any(|_| is_asleep(board)), "the core never sleeps");
}

/// Samples of the simulated drive, as the sensor sends them.
pub fn drive(samples: usize) -> Vec<Vec<u8>> {
    let rows = bundled::simulated_drive().expect("it comes with the tools").rows.into_iter();
    rows.take(samples).enumerate().map(|(k, row)| replay::message(k, &row.sample)).collect()
}

/// Sends samples, one every 10 ms, from a time on.
pub fn send(board: &mut Board, samples: &[Vec<u8>], from: Duration) {
    for (k, sample) in samples.iter().enumerate() {
        board.send_at(IMU, sample, from + SAMPLE * k as u32);
    }
}

pub fn host(samples: &[Vec<u8>]) -> Vec<DataFrame> {
    let lines = replay::lines(&samples.concat());
    lines.iter().map(|line| slcan::parse(line).expect("a frame")).collect()
}

pub fn frames(timed: &[(Duration, DataFrame)]) -> Vec<DataFrame> {
    timed.iter().map(|(_, frame)| *frame).collect()
}

/// The identifier of a frame, without those of 29 bits.
pub fn raw(frame: &DataFrame) -> u16 {
    match frame.id() {
        Id::Standard(id) => id.as_raw(),
        Id::Extended(_) => u16::MAX,
    }
}

/// Faults of the angle messages.
pub fn faults(frames: &[DataFrame]) -> Vec<Faults> {
    let angles = frames.iter().filter(|frame| frame.id() == id(0x1A1));
    angles.map(|frame| AngleMessage::parse(frame.data()).expect("eight bytes").faults).collect()
}

/// A vehicle that stands, with its wheels and all that the board computes, from now on.
pub fn stand(board: &mut Board, samples: u32) {
    let now = board.counts().time;
    for k in 0..samples {
        board.send_at(IMU, &replay::turning(k as usize, 0.001), now + SAMPLE * k);
        board.can_send_at(&inputs::wheels(0.0), now + SAMPLE * k);
    }
}

pub fn info(board: &mut Board) -> Info {
    service::info(board)
}

pub fn counters(board: &mut Board) -> AllCounters {
    service::on_line(board).counters().expect("a response")
}

/// A line of a candump log; `separator` is `#`, or `##1` for CAN FD with the higher bit rate.
pub fn logged(time: Duration, id: u16, separator: &str, data: &[u8]) -> String {
    let digits: String = data.iter().map(|byte| format!("{byte:02X}")).collect();
    format!("({:.6}) can0 {id:03X}{separator}{digits}\n", time.as_secs_f64())
}

/// What a client with cantools and the DBC file prints of a candump log; `None`, said aloud, without Python.
pub fn read_log(client: &str, log: &str) -> Option<String> {
    let python = require::python(&["cantools"])?;
    let mut child = Command::new(python)
        .arg(workspace().join("host-tests/tests/clients").join(client))
        .arg(workspace().join("tools/gyronet.dbc"))
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .expect("Python runs");
    child.stdin.take().expect("piped").write_all(log.as_bytes()).expect("it reads");
    let output = child.wait_with_output().expect("it ends");
    let text = String::from_utf8_lossy(&output.stdout).trim().to_owned();
    println!("{text}");
    assert!(output.status.success(), "{text}");
    Some(text)
}

pub fn resets(board: &mut Board) -> Vec<(Duration, String)> {
    let events = board.events();
    let resets = events.iter().filter(|event| event.kind == "reset");
    resets.map(|event| (event.time, event.text("cause").to_owned())).collect()
}
