//! The SLCAN line of the board: a host's commands.

use crate::common::{self, SAMPLE, SET, SLCAN, START};
use gyronet::can::{DataFrame, slcan};
use gyronet_host_tests::board::Board;
use gyronet_host_tests::replay;

fn standing(board: &mut Board, samples: std::ops::Range<usize>) {
    let now = board.counts().time;
    for (k, number) in samples.enumerate() {
        board.send_at(common::IMU, &replay::turning(number, 0.001), now + SAMPLE * k as u32);
    }
}

#[test]
fn board_answers_the_commands_of_a_host() {
    let Some(mut board) = common::boot("board_answers_the_commands_of_a_host") else { return };
    board.run(START);
    // Frames come before anybody has asked for any.
    standing(&mut board, 0..5);
    board.run(SAMPLE * 6);
    let sent = board.sent(SLCAN);
    assert_eq!(sent.split(|byte| *byte == b'\r').filter(|line| line.starts_with(b"t")).count(), 5 * SET);
    // python-can and slcand, then a question that is not understood; time stamps from then on.
    board.send(SLCAN, b"C\rS6\r\rO\rV\rN\rF\rX\rZ1\r");
    board.run(SAMPLE);
    let text = String::from_utf8(board.sent(SLCAN)).expect("ASCII");
    let answers: Vec<&str> =
        text.split_terminator(['\r', '\u{7}']).filter(|line| !line.starts_with('t')).collect();
    assert!(text.contains('\u{7}'), "{text:?}");
    assert_eq!(answers.join(" ").split_whitespace().collect::<Vec<_>>(), ["V0101", "NGYRO", "F00"]);
    // Closing ends nothing. The stamps are milliseconds of the sensor's clock.
    board.send(SLCAN, b"C\r");
    standing(&mut board, 12..15);
    board.run(SAMPLE * 4);
    let sent = board.sent(SLCAN);
    let stamped =
        sent.split(|byte| *byte == b'\r').filter_map(|line| slcan::parse_stamped::<DataFrame>(line).ok());
    let stamps: Vec<u16> = stamped.map(|(_, at)| at).collect();
    for stamp in [120, 130, 140] {
        assert!(stamps.iter().filter(|at| **at == stamp).count() >= SET, "{stamps:?}");
    }
}
