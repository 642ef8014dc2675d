//! Messages of more than seven bytes in CAN frames (ISO 15765-2), and every way to break their order.

use gyronet::uds::isotp::{BLOCK, MAX_MESSAGE, TIMEOUT_MS, Transport};
use gyronet_host_tests::tester::{frame, segment};

/// Gives a whole request to a transport; returns the number of flow controls that it took.
fn give(transport: &mut Transport, request: &[u8]) -> usize {
    let mut controls = 0;
    for data in segment(request) {
        transport.receive(&data, 0);
        while let Some(sent) = transport.next_frame(0) {
            assert_eq!(sent[..3], [0x30, BLOCK, 0]);
            controls += 1;
        }
    }
    controls
}

fn long(length: usize) -> Vec<u8> {
    (0..length).map(|k| k as u8).collect()
}

#[test]
fn a_response_keeps_to_the_block_and_the_gap_that_the_tester_names() {
    let mut transport = Transport::IDLE;
    let response = long(40);
    give(&mut transport, &[0x22, 1, 2]);
    transport.answer(|_, out| out.extend_from_slice(&response).expect("it fits"));
    let first = transport.next_frame(0).expect("the first frame");
    assert_eq!(first[..2], [0x10, 40]);
    let mut got = first[2..].to_vec();
    assert_eq!(transport.next_frame(0), None, "it waits for a flow control");
    // Two frames at a time, 5 ms apart.
    let (mut now, mut sent, mut times) = (0, 0, Vec::new());
    while got.len() < response.len() {
        transport.receive(&frame(&[0x30, 2, 5], &[]), now);
        for _ in 0..20 {
            // A frame is on the bus for two milliseconds.
            if times.last().is_some_and(|begun| now == begun + 2) {
                transport.frames_left(now);
            }
            if let Some(data) = transport.next_frame(now) {
                sent += 1;
                assert_eq!(data[0], 0x20 | sent);
                got.extend(&data[1..]);
                times.push(now);
            }
            now += 1;
        }
    }
    got.truncate(response.len());
    assert_eq!(got, response);
    // Case bus/04: 5 ms from the end of a frame, which was within the millisecond before the report.
    assert_eq!(times, [0, 8, 20, 28, 40]);
    assert!(transport.is_idle());
}

#[test]
fn a_frame_out_of_order_ends_the_request_and_the_next_one_is_taken() {
    let mut transport = Transport::IDLE;
    let frames = segment(&long(60));
    for (lost, repeated) in [(Some(3), None), (None, Some(3))] {
        let broken = frames.iter().enumerate().flat_map(|(k, data)| {
            let copies = if lost == Some(k) { 0 } else { 1 + usize::from(repeated == Some(k)) };
            std::iter::repeat_n(data, copies)
        });
        broken.for_each(|data| {
            transport.receive(data, 0);
            let _ = transport.next_frame(0);
        });
        assert_eq!(transport.request(), None);
        assert!(transport.is_idle());
    }
    assert_eq!(transport.errors.sequence, 2);
    give(&mut transport, &[0x3E, 0]);
    assert_eq!(transport.request(), Some(&[0x3E, 0][..]));
}

#[test]
fn a_request_that_is_too_long_is_refused_by_its_first_frame() {
    let mut transport = Transport::IDLE;
    let [high, low] = (MAX_MESSAGE as u16 + 1).to_be_bytes();
    let too_long = [0x10 | high, low, 0, 0, 0, 0, 0, 0];
    // 4 GB less one, in the long form.
    let four_gb = [0x10, 0x00, 0xFF, 0xFF, 0xFF, 0xFF, 0x36, 1];
    for (k, first) in [too_long, four_gb].iter().enumerate() {
        transport.receive(first, 0);
        let refusal = transport.next_frame(0).expect("a flow control");
        assert_eq!(refusal[0], 0x32);
        assert_eq!(transport.errors.overflow, k as u32 + 1);
        assert!(transport.is_idle());
    }
}

#[test]
fn a_tester_that_falls_silent_is_given_up_after_a_second() {
    let mut transport = Transport::IDLE;
    // The clock wraps around meanwhile.
    let start = u32::MAX - 100;
    transport.receive(&segment(&long(60))[0], start);
    let _ = transport.next_frame(start);
    transport.expire(start.wrapping_add(TIMEOUT_MS - 1));
    assert!(!transport.is_idle());
    transport.expire(start.wrapping_add(TIMEOUT_MS));
    assert!(transport.is_idle());
    // And one that does not let the response go on.
    give(&mut transport, &[0x22, 1, 2]);
    transport.answer(|_, out| out.extend_from_slice(&long(20)).expect("it fits"));
    let _ = transport.next_frame(0);
    for wait in 0..11 {
        assert!(!transport.is_idle(), "{wait}");
        transport.receive(&frame(&[0x31, 0, 0], &[]), 0);
    }
    assert!(transport.is_idle(), "ten waits are the most");
    assert_eq!(transport.errors.timeout, 2);
    // And a frame that never leaves.
    give(&mut transport, &[0x22, 1, 2]);
    transport.answer(|_, out| out.extend_from_slice(&long(20)).expect("it fits"));
    let _ = transport.next_frame(0);
    transport.receive(&frame(&[0x30, 0, 1], &[]), 0);
    assert!(transport.next_frame(0).is_some() && transport.next_frame(500).is_none());
    transport.expire(TIMEOUT_MS);
    assert!(transport.is_idle() && transport.errors.timeout == 3);
}

#[test]
fn a_tester_that_begins_again_is_answered_for_the_new_request() {
    let mut transport = Transport::IDLE;
    for data in &segment(&long(60))[..4] {
        transport.receive(data, 0);
        let _ = transport.next_frame(0);
    }
    give(&mut transport, &long(30));
    assert_eq!(transport.request(), Some(&*long(30)));
    // A whole one is not replaced before it is answered.
    transport.receive(&frame(&[2], &[0x3E, 0]), 0);
    assert_eq!(transport.request(), Some(&*long(30)));
    assert_eq!(transport.errors.sequence, 1);
    assert_eq!(transport.errors.unexpected, 1);
}

#[test]
fn what_the_standard_does_not_have_is_counted_and_answered_by_nothing() {
    let mut transport = Transport::IDLE;
    let bad: [&[u8]; 9] = [
        &[],
        &[0x00, 0x3E, 0],
        // Longer than the frame, or than a frame can be.
        &[0x05, 0x3E, 0],
        &[0x08, 1, 2, 3, 4, 5, 6, 7],
        // A first frame of a message that fits a single one, or cut short.
        &[0x10, 0x07, 1, 2, 3, 4, 5, 6],
        &[0x10, 0x20, 1, 2],
        // Nobody waits for these.
        &[0x21, 1, 2, 3],
        &[0x30, 0, 0],
        &[0x40, 1, 2],
    ];
    for (k, data) in bad.into_iter().enumerate() {
        transport.receive(data, 0);
        assert_eq!((transport.next_frame(0), transport.request()), (None, None), "{data:02x?}");
        assert_eq!(transport.errors.unexpected, k as u32 + 1, "{data:02x?}");
    }
}

#[test]
fn a_tester_s_request_arrives_whole_and_one_that_is_too_long_is_not_sent() {
    let (mut tester, mut board) = (Transport::IDLE, Transport::IDLE);
    assert!(!tester.send(&long(MAX_MESSAGE + 1)));
    for length in 1..=MAX_MESSAGE {
        let request = long(length);
        assert!(tester.send(&request), "{length}");
        for now in 0..1_000 {
            if let Some(data) = tester.next_frame(now) {
                board.receive(&data, now);
                tester.frames_left(now);
            }
            if let Some(data) = board.next_frame(now) {
                tester.receive(&data, now);
            }
        }
        assert_eq!(board.request(), Some(&*request), "{length}");
        assert!(board.answer(|_, _| ()) && tester.is_idle());
    }
    assert_eq!((tester.errors, board.errors), Default::default());
}

/// ISO 15765-2 9.6.5.5: codes from 0xF1 to 0xF9 are hundreds of microseconds.
#[test]
fn a_flow_control_sets_the_gap_or_ends_the_response() {
    for (code, gap) in [(0, 0), (3, 3), (0xF1, 1), (0xF9, 1), (0xF0, 0x7F), (0xFA, 0x7F)] {
        let mut transport = Transport::IDLE;
        assert!(transport.send(&long(30)) && transport.next_frame(0).is_some());
        transport.receive(&[0x30, 0, code], 0);
        assert!(transport.next_frame(0).is_some());
        transport.frames_left(0);
        let next = (0..200).find(|now| transport.next_frame(*now).is_some());
        assert_eq!(next, Some(if gap == 0 { 0 } else { gap + 1 }), "{code:x}");
    }
    let mut transport = Transport::IDLE;
    assert!(transport.send(&long(30)) && transport.next_frame(0).is_some());
    transport.receive(&[0x42, 0, 0], 0);
    assert!(!transport.is_idle(), "no flow control");
    transport.receive(&[0x32, 0, 0], 0);
    assert!(transport.is_idle() && transport.errors.overflow == 1);
}
