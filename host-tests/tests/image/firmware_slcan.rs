//! The image's SLCAN line in QEMU: a host's commands, wheel frames from it, and a line that takes
//! nothing for a while.

use embedded_can::{Frame, Id, StandardId};
use gyronet::can::bosch::{SignalStatus, TX1_ID, Tx1};
use gyronet::can::yaw::{AngleMessage, Faults};
use gyronet::can::{DataFrame, slcan};
use gyronet_host_tests::{image, qemu, replay};
use std::path::Path;
use std::time::{Duration, Instant};

const LIMIT: Duration = Duration::from_secs(60);
/// A busy host may try so often.
const ATTEMPTS: usize = 5;
const IMU: usize = 1;
const SLCAN: usize = 2;
/// Frames of one sample.
const SET: usize = 6;
const ANGLE: Id = Id::Standard(StandardId::new(0x1A1).unwrap());

fn boot(test: &str) -> Option<qemu::Board> {
    let elf = image::coprocessor(test, env!("CARGO_TARGET_TMPDIR"))?;
    Some(qemu::Board::boot(&elf, SLCAN, &[]))
}

/// Returns the bytes of a vehicle that stands, or seems to turn a little.
fn standing(samples: impl IntoIterator<Item = usize>) -> Vec<u8> {
    samples.into_iter().flat_map(|number| replay::turning(number, 0.001)).collect()
}

/// Returns the lines that are no frames.
fn answers(lines: &[Vec<u8>]) -> Vec<String> {
    let frame = |line: &&Vec<u8>| !line.starts_with(b"t");
    lines.iter().filter(frame).map(|line| line.escape_ascii().to_string()).collect()
}

/// Returns the status of the rate in TX1.
fn status(frame: &DataFrame) -> Option<SignalStatus> {
    let tx1 = (frame.id() == Id::Standard(TX1_ID)).then(|| Tx1::parse(frame.data()));
    Some(tx1?.expect("a good checksum").yaw_rate_status)
}

/// Returns the frames among lines, without the answers.
fn frames(lines: &[Vec<u8>]) -> Vec<DataFrame> {
    lines.iter().filter_map(|line| slcan::parse(line).ok()).collect()
}

#[test]
fn the_board_answers_the_commands_of_a_host() {
    const NAME: &str = "the_board_answers_the_commands_of_a_host";
    let Some(mut board) = boot(NAME) else { return };
    // Frames come before anybody has asked for any.
    board.send(IMU, &standing(0..5), LIMIT);
    assert!(frames(&board.lines(SLCAN, b'\r', 5 * SET, LIMIT)).len() >= 5 * SET);
    // python-can and slcand, then a question that is not understood.
    board.send(SLCAN, b"C\rS6\r\rO\rV\rN\rF\rX\rZ1\r", LIMIT);
    let lines = board.lines_until(SLCAN, b'\r', LIMIT, |lines| answers(lines).len() == 8);
    assert_eq!(answers(&lines), ["", "", "", "", "V0101", "NGYRO", "F00", "\\x07"]);
    // With time stamps: milliseconds of the part's clock. Closing ends nothing.
    board.send(SLCAN, b"C\r", LIMIT);
    let closed = board.lines_until(SLCAN, b'\r', LIMIT, |lines| answers(lines).len() == 9);
    board.send(IMU, &standing(5..8), LIMIT);
    // What the board says while it hears nothing is left out.
    let stamps = |lines: &[Vec<u8>]| -> Vec<u16> {
        let stamped = lines[closed.len()..].iter().filter_map(|line| slcan::parse_stamped(line).ok());
        stamped
            .filter(|(frame, _)| status(frame) == Some(SignalStatus::INITIALISING))
            .map(|(_, at)| at)
            .collect()
    };
    let lines = board.lines_until(SLCAN, b'\r', LIMIT, |lines| stamps(lines).len() >= 3);
    assert_eq!(stamps(&lines), [50, 60, 70]);
}

#[test]
fn wheel_frames_hold_back_initialisation_and_are_missed() {
    const NAME: &str = "wheel_frames_hold_back_initialisation_and_are_missed";
    let Some(mut board) = boot(NAME) else { return };
    // Ten samples for each wheel frame: 3.5 s at 50 km/h, as long standing, then silence.
    const EACH: usize = 10;
    let mut lines = 0;
    for round in 0..90 {
        let hundredths: u16 = match round {
            0..35 => (50 + 67) * 100,
            _ => 6_767,
        };
        if round < 80 {
            let data = [hundredths.to_be_bytes(); 4].concat();
            let id = StandardId::new(0xAA).expect("11 bits");
            let frame = DataFrame::new(id, &data).expect("eight bytes");
            board.send(SLCAN, &slcan::emit(&frame).expect("a data frame"), LIMIT);
            // Its answer: the board has it.
            lines += 1;
            let _ = board.lines(SLCAN, b'\r', lines, LIMIT);
        }
        board.send(IMU, &standing(round * EACH..(round + 1) * EACH), LIMIT);
        lines += EACH * SET;
        let _ = board.lines(SLCAN, b'\r', lines, LIMIT);
    }
    let frames = frames(&board.lines(SLCAN, b'\r', lines, LIMIT));
    let of = |id: Id| frames.iter().filter(move |frame| frame.id() == id);
    let status = |frame: &DataFrame| Tx1::parse(frame.data()).expect("a good checksum").yaw_rate_status;
    let good = of(Id::Standard(TX1_ID)).position(|frame| status(frame) == SignalStatus::OK);
    // The wheels have been slow for less than half a second, so not known to move: 3 s from there.
    assert_eq!(good, Some(350 + 300));
    let faults: Vec<Faults> =
        of(ANGLE).map(|frame| AngleMessage::parse(frame.data()).expect("eight bytes").faults).collect();
    let silent = faults.iter().position(|faults| faults.0 & Faults::WHEELS.0 != 0);
    // The last frame came with the time stamp of sample 789; 0.1 s is not yet over at 799.
    assert_eq!(silent, Some(800));
    assert!(faults[800..].iter().all(|faults| faults.0 & Faults::WHEELS.0 != 0));
}

/// Samples that the board with a stalled line gets.
const ALL: usize = 1_500;

/// Returns the samples' grid steps since the start, if the board has time for an answer.
fn ticks(device: &mut qemu::Tester) -> Option<u32> {
    let response = device.ask(&[0x22, 0x01, 0x08]).ok()?;
    response.last_chunk().map(|word| u32::from_be_bytes(*word))
}

/// Returns all lines of a board whose line stood still for a while, once the last frame is among them; `None`: the host
/// was so busy that the board found its sensor silent in between, and reported it.
fn stalled_line(elf: &Path, end: &DataFrame) -> Option<Vec<Vec<u8>>> {
    let mut board = qemu::Board::boot(elf, qemu::SERVICE, &[]);
    let mut device = board.device(LIMIT);
    // The line is stalled until the board has taken some; the others are still on their way, so
    // that it hears something all the time.
    board.stall(SLCAN, true);
    board.send(IMU, &standing(0..ALL), LIMIT);
    let until = Instant::now() + LIMIT;
    // The tick fits a frame: idle answers in the little time that it has.
    while ticks(&mut device).is_none_or(|ticks| ticks <= 200) {
        assert!(Instant::now() < until, "the board stands still");
    }
    assert!(board.lines(SLCAN, b'\r', 0, LIMIT).is_empty());
    board.stall(SLCAN, false);
    board.send(SLCAN, b"F\r", LIMIT);
    loop {
        let counters = device.counters().ok();
        let lines = board.lines(SLCAN, b'\r', 0, LIMIT);
        if frames(&lines).contains(end) {
            return Some(lines);
        }
        // When all samples are in it is silent, and that comes behind their frames.
        if counters.is_some_and(|all| all.watch.silences > u32::from(all.pipeline.samples as usize == ALL)) {
            return None;
        }
        assert!(Instant::now() < until, "the last frame does not come: {counters:?}");
    }
}

#[test]
fn a_stalled_line_costs_the_oldest_frames() {
    const NAME: &str = "a_stalled_line_costs_the_oldest_frames";
    let Some(elf) = image::coprocessor(NAME, env!("CARGO_TARGET_TMPDIR")) else { return };
    let expected = frames(&replay::lines(&standing(0..ALL)));
    // Detail is the last of a set and has no fault bits: as on the host, to its counter.
    let end = expected.last().expect("frames");
    let lines = (0..ATTEMPTS).find_map(|_| stalled_line(&elf, end)).expect("a host that is not so busy");
    let last = |lines: &[Vec<u8>]| frames(lines).iter().position(|frame| frame == end);
    assert!(lines.contains(&b"F02".to_vec()), "the host is informed");
    let sent = &frames(&lines)[..=last(&lines).expect("it is there")];
    let dropped = expected.len() - sent.len();
    println!("{NAME}: {} frames made, {} sent, {dropped} dropped", expected.len(), sent.len());
    assert!(dropped >= 100 * SET, "{dropped} frames were dropped while the line stood still");
    // What was sent is what was made, in its order; only the fault is reported beside it.
    let known = |frame: &DataFrame| (frame.id(), frame.data()[3..7].to_vec(), frame.data()[2]);
    let same = |a: &DataFrame, b: &DataFrame| if a.id() == ANGLE { known(a) == known(b) } else { a == b };
    // What the line had taken before it stalled.
    let before = sent.iter().zip(&expected).take_while(|(sent, made)| same(sent, made)).count();
    println!("{NAME}: {before} frames were on their way");
    for (number, frame) in sent.iter().enumerate() {
        let made = if number < before { number } else { number + dropped };
        assert!(same(frame, &expected[made]), "frame {number}");
    }
    let bus = |frame: &&DataFrame| {
        frame.id() == ANGLE
            && AngleMessage::parse(frame.data()).is_ok_and(|m| m.faults.0 & Faults::BUS.0 != 0)
    };
    assert_eq!(sent[..before].iter().filter(bus).count(), 0);
    assert!(sent[before..].iter().filter(bus).count() > 0, "the fault is reported");
    assert_eq!(sent[sent.len() - 9 * SET..].iter().filter(bus).count(), 0, "and its end");
}
