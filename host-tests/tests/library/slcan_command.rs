//! The host's side of an SLCAN line: what python-can and slcand send, and what must never be.

use embedded_can::Frame;
use gyronet::can::DataFrame;
use gyronet::can::slcan::assembler::{LineAssembler, MAX_HOST_LINE, TooLong};
use gyronet::can::slcan::host::{Session, StatusFlags};
use gyronet::can::slcan::{self, SlcanError};
use gyronet::units::Micros;
use gyronet_host_tests::wire::{data_frame, id11};

/// Everything that is answered to what a host sends.
fn converse(session: &mut Session, bytes: &[u8]) -> (Vec<u8>, Vec<DataFrame>) {
    let mut assembler = LineAssembler::new();
    let (mut answers, mut frames) = (Vec::new(), Vec::new());
    for byte in bytes {
        let reaction = match assembler.receive(*byte) {
            None => continue,
            Some(Ok(line)) => session.execute(line, StatusFlags::default()),
            Some(Err(TooLong)) => session.refuse(),
        };
        answers.extend(reaction.answer);
        frames.extend(reaction.frame);
    }
    (answers, frames)
}

fn session() -> Session {
    Session::new(500_000)
}

#[test]
fn commands_of_known_clients_are_answered() {
    // python-can with a bit rate: close, rate, no data rate, open, and open again.
    assert_eq!(converse(&mut session(), b"C\rS6\r\rO\rO\r").0, b"\r\r\r\r\r");
    assert_eq!(converse(&mut session(), b"C\rS6\rL\r").0, b"\r\r\r");
    // slcand -o -s6, status read, closed at the end.
    assert_eq!(converse(&mut session(), b"C\rS6\rF\rO\rC\r").0, b"\r\rF00\r\r\r");
    // Version and serial number have the shape that python-can takes apart.
    assert_eq!(converse(&mut session(), b"V\rN\r").0, b"V0101\rNGYRO\r");
    // A terminal that ends lines its own way.
    assert_eq!(converse(&mut session(), b"V\r\nZ0\r\n").0, b"V0101\r\r");
}

#[test]
fn a_session_is_open_from_o_or_l_until_c() {
    let mut session = session();
    let mut after = |line: &[u8]| {
        converse(&mut session, line);
        session.open
    };
    let open = [&b"V\r"[..], b"O\r", b"S6\r", b"C\r", b"CO\r", b"L\r", b"C\r"].map(&mut after);
    assert_eq!(open, [false, true, true, false, false, true, false]);
}

#[test]
fn other_commands_are_refused() {
    let bel = b"\x07";
    for line in [
        &b"S5\r"[..],
        b"S9\r",
        b"S\r",
        b"S66\r",
        b"Z2\r",
        b"Z\r",
        b"X1\r",
        b"s031C\r",
        b"CC\r",
        b"r1230\r",
        b"t12\r",
        b"t1230123456789012345678901234567890\r",
        b"c\r",
        b"Q\r",
    ] {
        let mut session = session();
        let (answer, frames) = converse(&mut session, line);
        assert_eq!((answer.as_slice(), frames.len()), (&bel[..], 0), "{}", line.escape_ascii());
        assert_eq!(session.refused, 1);
    }
    let rates = [10, 20, 50, 100, 125, 250, 500, 800, 1_000];
    for (digit, kilobits) in rates.into_iter().enumerate() {
        let line = format!("S{digit}\r");
        assert_eq!(converse(&mut Session::new(kilobits * 1_000), line.as_bytes()).0, b"\r", "{kilobits}");
        assert_eq!(converse(&mut Session::new(kilobits * 1_000 + 1), line.as_bytes()).0, bel);
    }
}

#[test]
fn frames_from_the_host_are_taken() {
    let (answer, frames) = converse(&mut session(), b"t0AA21A6F\rT18FEBF0B101\r");
    assert_eq!(answer, b"\r\r");
    assert_eq!(frames.len(), 2);
    assert_eq!(frames[0].data(), [0x1A, 0x6F]);
    assert!(frames[1].is_extended());
}

#[test]
fn time_stamps_come_on_demand() {
    let mut session = session();
    assert!(!session.stamped);
    converse(&mut session, b"Z1\r");
    assert!(session.stamped);
    // Closing does not end the output, nor change it.
    converse(&mut session, b"C\r");
    assert!(session.stamped);
    converse(&mut session, b"Z0\r");
    assert!(!session.stamped);

    let frame = data_frame(id11(0x174), &[1, 2]);
    for (ms, text) in [(0, "0000"), (59_999, "EA5F"), (60_000, "0000"), (123_456, "0D80")] {
        let (mut line, time) = ([0; slcan::MAX_STAMPED_LINE], Micros(ms * 1000 + 999));
        let length = slcan::encode(&frame, Some(time), &mut line).expect("a data frame");
        assert_eq!(&line[..length], format!("t17420102{text}\r").as_bytes());
        let (again, stamp) = slcan::parse_stamped::<DataFrame>(&line[..length - 1]).expect("as written");
        assert_eq!((again, u64::from(stamp)), (frame, ms % 60_000));
    }
    assert_eq!(slcan::parse_stamped::<DataFrame>(b"t174001G0"), Err(SlcanError::Digit { at: 7 }));
    assert_eq!(slcan::parse_stamped::<DataFrame>(b"t1740"), Err(SlcanError::Length));
}

#[test]
fn long_lines_end_somewhere() {
    let mut assembler = LineAssembler::new();
    for _ in 0..100_000 {
        assert_eq!(assembler.receive(b'A'), None);
    }
    assert_eq!(assembler.receive(b'\r'), Some(Err(TooLong)));
    for byte in *b"V" {
        assert_eq!(assembler.receive(byte), None);
    }
    assert_eq!(assembler.receive(b'\r'), Some(Ok(&b"V"[..])));
    for _ in 0..MAX_HOST_LINE {
        assert_eq!(assembler.receive(b'B'), None);
    }
    assert_eq!(assembler.receive(b'\r'), Some(Ok(&[b'B'; MAX_HOST_LINE][..])));
}
