//! The image's SLCAN line in QEMU: a host's commands, wheel frames from it, and a line that takes
//! nothing for a while.

use embedded_can::{Frame, Id, StandardId};
use gyronet::can::bosch::{SignalStatus, TX1_ID, Tx1};
use gyronet::can::yaw::{AngleMessage, Faults};
use gyronet::can::{DataFrame, slcan};
use gyronet_host_tests::{image, qemu, replay};
use std::time::Duration;

const LIMIT: Duration = Duration::from_secs(60);
const IMU: usize = 1;
const SLCAN: usize = 2;
/// Frames of one sample.
const SET: usize = 6;
const ANGLE: Id = Id::Standard(StandardId::new(0x1A1).unwrap());

fn boot(test: &str) -> Option<qemu::Board> {
    let elf = image::coprocessor(test, env!("CARGO_TARGET_TMPDIR"))?;
    Some(qemu::Board::boot(&elf, SLCAN, &[]))
}

/// Bytes of a vehicle that stands, or seems to turn a little.
fn standing(samples: impl IntoIterator<Item = usize>) -> Vec<u8> {
    samples.into_iter().flat_map(|number| replay::turning(number, 0.001)).collect()
}

/// Frames among lines, answers left out.
fn frames(lines: &[Vec<u8>]) -> Vec<DataFrame> {
    lines.iter().filter_map(|line| slcan::parse(line).ok()).collect()
}

#[test]
fn board_answers_a_host() {
    const NAME: &str = "board_answers_a_host";
    let Some(mut board) = boot(NAME) else { return };
    // Frames come before anybody has asked for any.
    board.send(IMU, &standing(0..5), LIMIT);
    assert_eq!(frames(&board.lines(SLCAN, b'\r', 5 * SET, LIMIT)).len(), 5 * SET);
    // python-can and slcand, then a question that is not understood.
    board.send(SLCAN, b"C\rS6\r\rO\rV\rN\rF\rX\rZ1\r", LIMIT);
    let lines = board.lines(SLCAN, b'\r', 5 * SET + 8, LIMIT);
    let text: Vec<String> = lines[5 * SET..].iter().map(|line| line.escape_ascii().to_string()).collect();
    assert_eq!(text, ["", "", "", "", "V0101", "NGYRO", "F00", "\\x07"]);
    // With time stamps: milliseconds of the part's clock. Closing ends nothing.
    board.send(SLCAN, b"C\r", LIMIT);
    let _ = board.lines(SLCAN, b'\r', 5 * SET + 9, LIMIT);
    board.send(IMU, &standing(5..8), LIMIT);
    let lines = board.lines(SLCAN, b'\r', 8 * SET + 9, LIMIT);
    let stamped = lines[5 * SET + 9..].iter().map(|line| slcan::parse_stamped::<DataFrame>(line));
    let stamps: Vec<u16> = stamped.map(|frame| frame.expect("a stamped line").1).collect();
    assert_eq!(stamps, [[50; SET], [60; SET], [70; SET]].concat());
}

#[test]
fn board_takes_wheel_frames() {
    const NAME: &str = "board_takes_wheel_frames";
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

#[test]
fn board_with_a_stalled_line() {
    const NAME: &str = "board_with_a_stalled_line";
    let Some(mut board) = boot(NAME) else { return };
    const BEFORE: usize = 50;
    const ALL: usize = 450;
    let expected = frames(&replay::lines(&standing(0..ALL + 10)));
    board.send(IMU, &standing(0..BEFORE), LIMIT);
    let _ = board.lines(SLCAN, b'\r', BEFORE * SET, LIMIT);
    board.stall(SLCAN, true);
    board.send(IMU, &standing(BEFORE..ALL), LIMIT);
    // Time for the board to take them; nothing can be heard of it.
    std::thread::sleep(Duration::from_secs(5));
    assert_eq!(board.lines(SLCAN, b'\r', BEFORE * SET, LIMIT).len(), BEFORE * SET);
    board.stall(SLCAN, false);
    board.send(SLCAN, b"F\r", LIMIT);
    board.send(IMU, &standing(ALL..ALL + 10), LIMIT);
    let last = |frames: &[DataFrame]| frames.last().map(|frame| (frame.id(), frame.data().to_vec()));
    // Detail is the last of a set and has no fault bits: as on the host, to its counter.
    let lines = board.lines_until(SLCAN, b'\r', LIMIT, |lines| last(&frames(lines)) == last(&expected));
    assert!(lines.contains(&b"F02".to_vec()), "the host is told");
    let sent = frames(&lines);
    let dropped = expected.len() - sent.len();
    println!("{NAME}: {} frames made, {} sent, {dropped} dropped", expected.len(), sent.len());
    assert!(dropped >= 100 * SET, "{dropped} frames were dropped while the line stood still");
    // What was sent is what was made, in its order; only the fault is told beside it.
    let known = |frame: &DataFrame| (frame.id(), frame.data()[3..7].to_vec(), frame.data()[2]);
    let same = |a: &DataFrame, b: &DataFrame| if a.id() == ANGLE { known(a) == known(b) } else { a == b };
    let before = BEFORE * SET;
    for (number, frame) in sent.iter().enumerate() {
        let made = if number < before { number } else { number + dropped };
        assert!(same(frame, &expected[made]), "frame {number}");
    }
    let bus = |frame: &&DataFrame| {
        frame.id() == ANGLE
            && AngleMessage::parse(frame.data()).is_ok_and(|m| m.faults.0 & Faults::BUS.0 != 0)
    };
    assert_eq!(sent[..before].iter().filter(bus).count(), 0);
    assert!(sent[before..].iter().filter(bus).count() > 0, "the bus is told");
    assert_eq!(sent[sent.len() - 9 * SET..].iter().filter(bus).count(), 0, "and told that it is over");
}
