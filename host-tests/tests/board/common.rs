//! The board of these tests: an MTi on USART1, SLCAN on USART2 at 921600, the service line on USART6, CAN.

use crate::service;
use embedded_can::Frame;
use gyronet::can::DataFrame;
use gyronet::can::yaw::{AngleMessage, RateMessage};
use gyronet::health::Faults;
use gyronet::service::message::AllCounters;
use gyronet_host_tests::board::{self, Board, Event};
use gyronet_host_tests::recordings::workspace;
use gyronet_host_tests::wire::wheels;
pub use gyronet_host_tests::wire::{id11 as id, raw};
use gyronet_host_tests::{replay, require};
use gyronet_tools::bundled;
use std::io::Write;
use std::path::PathBuf;
use std::process::{Command, Stdio};
use std::time::Duration;

pub const IMU: usize = 1;
pub const SLCAN: usize = 2;
pub const SERVICE: usize = 6;
pub const MS: Duration = Duration::from_millis(1);
pub const SECOND: Duration = Duration::from_secs(1);
pub const SAMPLE: Duration = Duration::from_millis(10);
/// Time from power-on until the image listens to all lines: the boot loader checks the image for 170 ms.
pub const START: Duration = Duration::from_millis(300);
pub const SET: usize = 6;

/// The image that is flashed, for a test that is skipped (aloud) where it cannot be built.
pub fn elf() -> Option<PathBuf> {
    board::firmware("netduino-plus-2", env!("CARGO_TARGET_TMPDIR"), "coprocessor")
}

pub fn unpowered() -> Option<Board> {
    let mut board = Board::unpowered(&elf()?)?;
    board.configure("USART2.baud", 921_600);
    board.configure("USART3.baud", 921_600);
    Some(board)
}

pub fn boot() -> Option<Board> {
    let mut board = unpowered()?;
    board.power_on();
    Some(board)
}

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
    replay::frames(&samples.concat())
}

/// Messages with the rate of the inertial sensor.
pub fn rates(timed: &[(Duration, DataFrame)]) -> Vec<(Duration, RateMessage)> {
    let rates = timed.iter().filter(|(_, frame)| frame.id() == id(0x1A0));
    rates.map(|(time, frame)| (*time, RateMessage::parse(frame.data()).expect("eight bytes"))).collect()
}

/// Longest time between two rates, of at least so many.
pub fn gap(timed: &[(Duration, DataFrame)], least: usize) -> Duration {
    let rates = rates(timed);
    assert!(rates.len() >= least, "{} rates", rates.len());
    rates.windows(2).map(|pair| pair[1].0 - pair[0].0).max().expect("rates")
}

pub fn frames(timed: &[(Duration, DataFrame)]) -> Vec<DataFrame> {
    timed.iter().map(|(_, frame)| *frame).collect()
}

pub fn angles(frames: &[DataFrame]) -> impl Iterator<Item = AngleMessage> {
    let angles = frames.iter().filter(|frame| frame.id() == id(0x1A1));
    angles.map(|frame| AngleMessage::parse(frame.data()).expect("eight bytes"))
}

pub fn faults(frames: &[DataFrame]) -> Vec<Faults> {
    angles(frames).map(|angle| angle.faults).collect()
}

/// A vehicle that stands, with its wheels and all that the board computes, from now on.
pub fn stand(board: &mut Board, samples: u32) {
    let now = board.counts().time;
    let still: Vec<_> = (0..samples as usize).map(|k| replay::turning(k, 0.001)).collect();
    send(board, &still, now);
    stop_wheels(board, samples, now);
}

/// Frames of wheels that stand, one every 10 ms, from a time on.
pub fn stop_wheels(board: &mut Board, frames: u32, from: Duration) {
    (0..frames).for_each(|k| board.can_send_at(&wheels(0.0), from + SAMPLE * k));
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

pub fn times(kind: &str, events: &[Event]) -> Vec<Duration> {
    events.iter().filter(|event| event.kind == kind).map(|event| event.time).collect()
}

/// The times at which a controller was back that was off the bus six times in 400 ms: each time for twice as long, and for
/// this many recessive bits at 500 kbit/s.
pub fn back_at_growing_intervals(events: &[Event], bits: u64, late: Duration) -> Vec<Duration> {
    let (off, back) = (times("bus_off", events), times("bus_off_ended", events));
    println!("off at {off:?}, back at {back:?}");
    // 10 + 20 + 40 + 80 + 160 ms and what it takes to fail again are less than 400 ms; 320 ms end after the fault.
    assert_eq!((off.len(), back.len()), (6, 6));
    for (k, (off, back)) in off.iter().zip(&back).enumerate() {
        let promised = 10 * MS * (1 << k) + Duration::from_micros(2 * bits);
        assert!((*back - *off).abs_diff(promised) < late, "{:?} for {promised:?}", *back - *off);
    }
    back
}

/// No register was used before its clock had come, and no pin is too slow for its bit rate.
pub fn assert_well_set(board: &mut Board) {
    let wrong = |kind: &str| ["early_access", "slow_pin", "ignored_write"].contains(&kind);
    let wrong: Vec<_> = board.events().into_iter().filter(|event| wrong(&event.kind)).collect();
    assert_eq!(wrong, []);
}
