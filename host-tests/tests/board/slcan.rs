//! The SLCAN line of the board: a host's commands.

use crate::common::{self, SAMPLE, SET, SLCAN, START};
use embedded_can::Frame;
use gyronet::can::{DataFrame, slcan};
use gyronet_host_tests::board::Board;
use gyronet_host_tests::replay;
use gyronet_host_tests::wire::id11;
use std::time::Duration;

fn standing(board: &mut Board, samples: std::ops::Range<usize>) {
    let now = board.counts().time;
    let samples: Vec<_> = samples.map(|number| replay::turning(number, 0.001)).collect();
    common::send(board, &samples, now);
}

#[test]
fn board_answers_the_commands_of_a_host() {
    let Some(mut board) = common::started() else { return };
    // No frame comes before somebody has asked for it.
    standing(&mut board, 0..5);
    board.run(SAMPLE * 6);
    assert_eq!(board.sent(SLCAN), b"");
    // python-can and slcand, then a question that is not understood; time stamps from then on.
    board.send(SLCAN, b"C\rS6\r\rO\rV\rN\rF\rX\rZ1\r");
    board.run(SAMPLE);
    let text = String::from_utf8(board.sent(SLCAN)).expect("ASCII");
    let answers: Vec<&str> =
        text.split_terminator(['\r', '\u{7}']).filter(|line| !line.starts_with('t')).collect();
    assert!(text.contains('\u{7}'), "{text:?}");
    assert_eq!(answers.join(" ").split_whitespace().collect::<Vec<_>>(), ["V0101", "NGYRO", "F00"]);
    // The stamps are milliseconds of the board's clock, of rates and of diagnosis alike.
    let begun = board.counts().time;
    standing(&mut board, 12..15);
    board.send(SLCAN, b"t7E08023E005555555555\r");
    board.run(SAMPLE * 4);
    let sent = board.sent(SLCAN);
    let stamped =
        sent.split(|byte| *byte == b'\r').filter_map(|line| slcan::parse_stamped::<DataFrame>(line).ok());
    let stamps: Vec<_> = stamped.map(|(frame, at)| (frame.id(), Duration::from_millis(at.into()))).collect();
    let response = id11(0x7E8);
    assert!(stamps.iter().any(|(id, _)| *id == response) && stamps.len() > 3 * SET, "{stamps:?}");
    // Stamps count from the image's start, which follows the boot loader.
    let past = begun - START..begun + SAMPLE * 4;
    assert!(stamps.iter().all(|(_, at)| past.contains(at)), "{stamps:?} from {begun:?} on");
    assert!(stamps.is_sorted_by_key(|(_, at)| *at), "{stamps:?}");
    // Closed again, it carries diagnosis alone.
    board.send(SLCAN, b"C\r");
    standing(&mut board, 15..18);
    board.send(SLCAN, b"t7E08023E005555555555\r");
    board.run(SAMPLE * 4);
    let text = String::from_utf8(board.sent(SLCAN)).expect("ASCII");
    assert_eq!(text.matches('t').count(), 1, "{text:?}");
    assert!(text.contains("t7E8"), "{text:?}");
}

/// Case bus/11: the line is no adapter.
#[test]
fn a_frame_that_the_board_does_not_use_is_refused_and_counted() {
    let Some(mut board) = common::started() else { return };
    let _ = board.sent(SLCAN);
    let before = common::counters(&mut board).lines.service_errors;
    board.send(SLCAN, b"t1232AABB\rT000001232AABB\rt0AA81A6F1A6F1A6F1A6F\r");
    board.run(SAMPLE);
    assert_eq!(board.sent(SLCAN), b"\x07\x07\x07", "wheels are not used either");
    assert_eq!(common::counters(&mut board).lines.service_errors - before, 3);
    assert_eq!(common::frames(&board.can_frames()), [], "and nothing is passed on");
}
