//! SLCAN: a host's commands to the board, and the bytes that a host reads from a line.

use embedded_can::{Frame, StandardId};
use gyronet::can::DataFrame;
use gyronet::can::slcan::port::Port;
use gyronet::can::slcan::{emit, parse, parse_stamped};
use gyronet::units::Micros;
use gyronet_tools::client::bus::{Bus, Line, SlcanBus};
use std::io::{Read, Result, Write};

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

struct Bytes<'a>(&'a [u8]);

impl Read for Bytes<'_> {
    fn read(&mut self, to: &mut [u8]) -> Result<usize> {
        self.0.read(to)
    }
}

impl Write for Bytes<'_> {
    fn write(&mut self, bytes: &[u8]) -> Result<usize> {
        Ok(bytes.len())
    }

    fn flush(&mut self) -> Result<()> {
        Ok(())
    }
}

impl Line for Bytes<'_> {}

/// Passes bytes to a host as from a serial line. A parsed frame must survive emitting and parsing.
pub fn host(data: &[u8]) {
    let mut bus = SlcanBus::new(Bytes(data));
    while let Ok(frames) = bus.receive() {
        for frame in frames {
            let line = emit(&frame).expect("a data frame");
            assert_eq!(parse(&line[..line.len() - 1]), Ok(frame));
        }
    }
}
