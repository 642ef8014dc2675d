//! Tests SLCAN: a host's commands to the board, and the bytes that the monitor reads from a line or a log.

use embedded_can::{Frame, StandardId};
use gyronet::can::DataFrame;
use gyronet::can::config::Config;
use gyronet::can::slcan::port::Port;
use gyronet::can::slcan::{emit, parse, parse_stamped};
use gyronet::units::Micros;
use gyronet_tools::client::monitor::Monitor;
use gyronet_tools::client::monitor::line::{Splitter, parse_line};

/// The answers of a board besides frames.
const ANSWERS: [&[u8]; 3] = [b"", b"V0101", b"NGYRO"];

/// Receives bytes as a host's commands, while frames are sent over a line that accepts a few bytes at a time. The
/// output must be whole lines, each an answer or the frame that was sent.
pub fn board(data: &[u8]) {
    let own = DataFrame::new(StandardId::MAX, &[1, 2, 3]).expect("a frame");
    let mut port = Port::<4>::new(500_000);
    let mut sent = Vec::new();
    for (k, byte) in (0..).zip(data) {
        if k % 8 == 0 {
            port.enqueue(own, Micros(k * 10_000));
        }
        port.receive(*byte, |frame| {
            let line = emit(&frame).expect("a data frame");
            assert_eq!(parse(&line[..line.len() - 1]), Ok(frame));
            k % 2 == 0
        });
        if let Some(outgoing) = port.outgoing() {
            assert!(!outgoing.is_empty());
            let accepted = outgoing.len().min(usize::from(byte & 7));
            sent.extend_from_slice(&outgoing[..accepted]);
            port.sent(accepted);
        }
    }
    while let Some(outgoing) = port.outgoing() {
        sent.extend_from_slice(outgoing);
        let len = outgoing.len();
        port.sent(len);
    }
    assert!(sent.last().is_none_or(|byte| matches!(byte, b'\r' | 7)), "an incomplete line");
    for line in sent.split(|byte| matches!(byte, b'\r' | 7)) {
        let is_status = matches!(line, [b'F', _, _]);
        let is_own = parse(line) == Ok(own)
            || parse_stamped(line).is_ok_and(|(frame, _): (DataFrame, _)| frame == own);
        assert!(ANSWERS.contains(&line) || is_status || is_own, "{:?}", String::from_utf8_lossy(line));
    }
}

/// Passes bytes to the monitor as from a serial line or a log. A parsed frame must survive emitting and parsing.
pub fn host(data: &[u8]) {
    let mut splitter = Splitter::default();
    let mut monitor = Monitor::new(&Config::DEFAULT);
    for (k, byte) in data.iter().enumerate() {
        let Some(line) = splitter.feed(*byte) else { continue };
        let _ = monitor.take_line(&line, k as f64 * 1e-3);
        if let Ok((_, frame)) = parse_line(&line) {
            let line = emit(&frame).expect("a data frame");
            let line = std::str::from_utf8(&line).expect("ASCII");
            assert_eq!(parse_line(line), Ok((None, frame)));
        }
    }
    let state = &monitor.state;
    let values = [state.rate, state.yaw, state.correction, state.sigma, state.latency];
    assert!(values.into_iter().chain([monitor.drop_in]).flatten().all(f64::is_finite));
}
