//! Times of diagnosis on the virtual board's bus, with all messages of the board beside it:
//! `cargo test --test board -- timing --nocapture` prints them.

use crate::common::{self, MS, SAMPLE, START, drive, id, raw, stand};
use crate::service;
use embedded_can::Frame;
use gyronet_host_tests::board::{Board, Seen};
use gyronet_host_tests::stored::other_weights;
use gyronet_host_tests::tester::{Tester, frame, segment};
use gyronet_host_tests::wire::{bytes, data_frame};
use gyronet_tools::reference::identifiers;
use std::time::Duration;

/// P2 and P2* of the standard, as the board's answer to 10 03 has them.
const P2: Duration = Duration::from_millis(50);
const P2_STAR: Duration = Duration::from_secs(5);
/// The configuration: more than ten frames.
const LONG: [u8; 3] = [0x22, 1, 0];

fn tester(board: &mut Board, data: &[u8]) {
    board.can_send(&data_frame(id(0x7E0), &frame(data, &[])));
}

/// A response, and the time from the end of the request on the bus to the begin of the first response to it.
struct Timed {
    message: Vec<u8>,
    first: Duration,
    pending: usize,
}

fn timed(board: &mut Board, request: &[u8]) -> Timed {
    let _ = board.bus_log();
    let (mut asked, mut newest, mut first) = (Duration::ZERO, Duration::ZERO, None);
    let mut tester = Tester::default();
    let message = tester.ask(request, 10_000, |frames| {
        frames.iter().for_each(|data| board.can_send(&data_frame(id(0x7E0), data)));
        board.run(MS);
        assert!(first.is_none() || board.counts().time - newest < P2_STAR, "{request:02x?}");
        let diagnosis = |seen: &Seen| (0x7E0..=0x7E8).contains(&raw(&seen.frame));
        let mut sent = Vec::new();
        for seen in board.bus_log().into_iter().filter(diagnosis) {
            let data: [u8; 8] = seen.frame.data().try_into().expect("eight bytes");
            let is_control = data[0] >> 4 == 3;
            if seen.own {
                sent.push(data);
            }
            if seen.own && !is_control {
                first.get_or_insert(seen.start - asked);
                newest = seen.end;
            } else if !seen.own && !is_control {
                asked = seen.end;
            }
        }
        sent
    });
    let message = message.unwrap_or_else(|| panic!("{request:02x?}: no whole response"));
    Timed { message, first: first.expect("it came"), pending: tester.pending }
}

/// Case bus/04: ISO 15765-2 counts the separation time from the end of a frame to the begin of the next one.
#[test]
fn separation_times_are_kept_on_the_bus() {
    let Some(mut board) = common::boot() else { return };
    common::send(&mut board, &drive(500), START);
    board.run(START + SAMPLE * 50);
    println!("wanted, then least, median and largest gap in ms");
    for code in [0x00, 0xF1, 0xF5, 0xF9, 0x01, 0x02, 0x03, 0x05, 0x0A, 0x14] {
        let wanted = match code {
            0xF1..=0xF9 => Duration::from_micros(100 * (code - 0xF0)),
            ms => MS * ms as u32,
        };
        let _ = board.bus_log();
        service::send(&mut board, &LONG);
        board.run(5 * MS);
        tester(&mut board, &[0x30, 0, code as u8]);
        board.run(20 * MS + 16 * (wanted + 3 * MS));
        let log = board.bus_log();
        let sent: Vec<_> = log.iter().filter(|seen| raw(&seen.frame) == 0x7E8).collect();
        let first = sent[0].frame.data();
        let length = usize::from(first[0] & 0xF) << 8 | usize::from(first[1]);
        assert_eq!((first[0] >> 4, sent.len() - 1), (1, (length - 6).div_ceil(7)), "of {length} bytes");
        let mut gaps: Vec<_> = sent[1..].windows(2).map(|pair| pair[1].start - pair[0].end).collect();
        gaps.sort();
        let ms = |gap: Duration| gap.as_secs_f64() * 1e3;
        let [least, median, largest] = [gaps[0], gaps[gaps.len() / 2], gaps[gaps.len() - 1]];
        println!("  {:5.1} {:7.3} {:7.3} {:7.3}", ms(wanted), ms(least), ms(median), ms(largest));
        assert!(least >= wanted, "{code:02x}: {least:?}");
        assert!(largest < wanted + 5 * MS, "{code:02x}: {largest:?}");
    }
}

/// Case bus/05: a trouble waits to be stored with an erase.
#[test]
fn the_first_requests_of_a_session_are_answered_in_time() {
    let Some(mut board) = common::boot() else { return };
    board.run(START + Duration::from_secs(3));
    let mut pending = 0;
    for request in [&[0x10, 3][..], &[0x22, 0xF1, 0x86], &[0x22, 0xF1, 0x89], &[0x22, 0xF1, 0x97]] {
        let answer = timed(&mut board, request);
        println!("{request:02x?}: {:02x?} in {:?}, {} pending", answer.message, answer.first, answer.pending);
        assert_eq!(answer.message[0], request[0] + 0x40);
        assert!(answer.first <= P2, "{:?}", answer.first);
        pending += answer.pending;
    }
    assert_eq!(pending, 1, "the erase was announced");
    assert!(board.events().iter().any(|event| event.kind == "flash_erase"), "and done");
}

/// Every request under full load, one behind the other.
#[test]
fn no_response_is_later_than_p2_without_a_wait() {
    let Some(mut board) = common::started() else { return };
    stand(&mut board, 3_500);
    board.run(Duration::from_secs(5));
    let reads = identifiers().rows.into_iter().filter(|row| row[4].starts_with("0x22"));
    let reads = reads.map(|row| bytes(&format!("22{}", row[0])));
    let others = "1003 3E00 1901FF 1902FF 190A 14FFFFFF 8502 8501 280301 280001 31010204 2701";
    let others = others.split(' ').map(bytes);
    let stores = service::storing(&service::at_latitude(48.0));
    let file = other_weights(1);
    let download = [&[0x34, 0, 0x44, 0, 0, 0, 0][..], &(file.len() as u32).to_be_bytes()].concat();
    let last = [stores.clone(), stores, vec![0x10, 2], download, [&[0x36, 1], &file[..256]].concat()];
    let mut times = Vec::new();
    for request in reads.chain(others).chain(last) {
        let answer = timed(&mut board, &request);
        assert!(answer.first <= P2, "{request:02x?}: {:?}", answer.first);
        assert_eq!(answer.message[0], request[0] + 0x40, "{request:02x?}: {:02x?}", answer.message);
        times.push(answer.first);
        if answer.pending > 0 {
            // A standstill is to be proven again after a gap.
            board.run(Duration::from_secs(4));
        }
    }
    times.sort();
    for (low, high) in [(0, 1), (1, 2), (2, 3), (3, 5), (5, 10), (10, 20), (20, 50)] {
        let count = times.iter().filter(|time| (low * MS..high * MS).contains(*time)).count();
        println!("{low:2} to {high:2} ms: {count}");
    }
    println!("the longest {:?}", times[times.len() - 1]);
}

/// Case bus/20.
#[test]
fn a_setting_that_is_stored_leaves_no_troubles() {
    let Some(mut board) = common::started() else { return };
    stand(&mut board, 1_200);
    board.run(Duration::from_secs(5));
    assert_eq!(timed(&mut board, &[0x19, 2, 8]).message, [0x59, 2, 0x7F], "a healthy board");
    assert_eq!(timed(&mut board, &[0x10, 3]).message[0], 0x50);
    assert_eq!(timed(&mut board, &service::storing(&service::at_latitude(48.0))).message, [0x6E, 1, 0]);
    board.run(Duration::from_secs(3));
    assert!(board.events().iter().any(|event| event.kind == "flash_erase"));
    assert_eq!(timed(&mut board, &[0x19, 2, 8]).message, [0x59, 2, 0x7F]);
}

/// Two testers at once, and one that vanishes in the middle of a response and of a request.
#[test]
fn a_second_tester_waits_in_silence_and_no_longer_than_a_second() {
    let Some(mut board) = common::started() else { return };
    service::send(&mut board, &LONG);
    board.run(5 * MS);
    // The second one, on the service line.
    let asked = b"t7E08023E005555555555\r";
    board.send(common::SERVICE, asked);
    board.run(20 * MS);
    assert_eq!(board.sent(common::SERVICE), b"\r", "its frame is taken and not answered");
    tester(&mut board, &[0x30, 0, 0]);
    board.run(20 * MS);
    let sent = common::frames(&board.can_frames());
    assert!(sent.iter().filter(|frame| raw(frame) == 0x7E8 && frame.data()[0] >> 4 == 2).count() > 9);
    for begun in [&LONG[..], &[0x2E; 20]] {
        tester(&mut board, &segment(begun)[0]);
        board.run(900 * MS);
        let _ = board.sent(common::SERVICE);
        board.send(common::SERVICE, asked);
        board.run(20 * MS);
        assert_eq!(board.sent(common::SERVICE), b"\r");
        board.run(100 * MS);
        board.send(common::SERVICE, asked);
        board.run(20 * MS);
        assert_eq!(board.sent(common::SERVICE), b"\rt7E88027E00CCCCCCCCCC\r");
    }
    let errors = timed(&mut board, &[0x22, 1, 7]).message;
    let [unexpected, timeout] = [6, 18].map(|at| errors[at]);
    assert_eq!((unexpected, timeout), (3, 2), "{errors:02x?}");
}
