//! The monitor counts what is lost, repeated and damaged, and loses no angle over it.

use embedded_can::{Frame, StandardId};
use gyronet::can::config::{Config, Settings};
use gyronet::can::encoder::CanEncoder;
use gyronet::can::{DataFrame, slcan};
use gyronet::units::{AngularRate, Micros, Yaw};
use gyronet_host_tests::synthetic;
use gyronet_tools::client::monitor::line::{NoFrame, Splitter, parse_line};
use gyronet_tools::client::monitor::source::{Lines, Source, SourceError};
use gyronet_tools::client::monitor::{Counts, Monitor};
use std::io::{Read, Write};
use std::net::TcpListener;
use std::time::{Duration, Instant};

/// Frames of a car that turns at 50 deg/s, and how far it has turned, deg.
fn drive(config: Config, samples: u32) -> (Vec<DataFrame>, f64) {
    let mut encoder = CanEncoder::new(config);
    let rate = AngularRate::from_rad_per_sec(50_f32.to_radians()).expect("in range");
    let mut frames = Vec::new();
    for tick in 0..samples {
        let sample = synthetic::vehicle(tick, rate, Yaw(i64::from(rate.0) * i64::from(tick)));
        frames.extend(encoder.encode(&sample));
    }
    (frames, rate.rad_per_sec().to_degrees() * f64::from(samples - 1) / 100.0)
}

#[test]
fn a_good_line_has_nothing_to_count() {
    let config = Config::new(Settings::DEFAULT).expect("checked");
    let (frames, turned) = drive(config, 1000);
    let mut monitor = Monitor::new(&config);
    for (k, frame) in frames.iter().enumerate() {
        let line = slcan::emit(frame).expect("a data frame");
        let stamped = slcan::emit_stamped(frame, Micros(k as u64 * 1000)).expect("a data frame");
        let text = |line: &[u8]| String::from_utf8_lossy(line).into_owned();
        assert_eq!(parse_line(&text(&line)), Ok((None, *frame)));
        assert_eq!(parse_line(&text(&stamped)), Ok((Some(k as f64 / 1000.0), *frame)));
        assert_eq!(monitor.take(frame, k as f64 / 600.0), k % 6 == 5, "a set is whole with its detail");
    }
    assert_eq!(monitor.counts, Counts { frames: 6000, ..Counts::default() });
    let yaw = monitor.state.yaw.expect("known");
    assert!((yaw - turned).abs() < 1e-6, "{yaw} {turned}");
    assert!((monitor.frames_per_second().expect("ten seconds") - 600.0).abs() < 1.0);
    assert!((monitor.state.rate.expect("known") - 50.0).abs() < 1e-5);
    assert!((monitor.drop_in.expect("known") - 50.0).abs() < 0.006);
    let json = monitor.json(9.99);
    assert_eq!((&json["source"], &json["quality"]), (&"Model".into(), &"good".into()));
    assert_eq!((&json["faults"], &json["correction_deg_per_s"]), (&"none".into(), &0.0.into()));
    println!("{json}\n{monitor}");
}

#[test]
fn lost_repeated_and_damaged_messages_are_counted() {
    let config = Config::new(Settings::DEFAULT).expect("checked");
    let (frames, turned) = drive(config, 1000);
    let mut monitor = Monitor::new(&config);
    for (k, frame) in frames.iter().enumerate() {
        // Six frames a sample: TX1 to TX3, rate, angle, detail.
        match (k / 6, k % 6) {
            // Three angles are lost.
            (100..=102, 4) => {}
            (200, 3) => {
                monitor.take(frame, 0.0);
                monitor.take(frame, 0.0);
            }
            (300, 5) | (400, 0) => {
                let mut data = [0; 8];
                data.copy_from_slice(frame.data());
                data[4] ^= 0x80;
                monitor.take(&DataFrame::new(frame.id(), &data).expect("eight bytes"), 0.0);
            }
            // So is a TX3.
            (500, 2) => {}
            _ => drop(monitor.take(frame, 0.0)),
        }
    }
    let other = DataFrame::new(StandardId::new(0x123).expect("11 bits"), &[]).expect("no bytes");
    monitor.take(&other, 0.0);
    assert_eq!(monitor.take_line("t17480080004B0080", 0.0), None);
    assert_eq!(monitor.take_line("V0101", 0.0), None);
    // A damaged message is missing too, when the next one comes.
    let due = Counts {
        frames: 5997,
        foreign: 1,
        lost: 6,
        repeated: 1,
        damaged: 2,
        out_of_sequence: 0,
        unreadable: 1,
    };
    assert_eq!(monitor.counts, due);
    let yaw = monitor.state.yaw.expect("known");
    assert!((yaw - turned).abs() < 1e-6, "{yaw} {turned}");
}

#[test]
fn lines_of_a_log_are_frames_or_refused() {
    let id = StandardId::new(0x174).expect("11 bits");
    let frame = DataFrame::new(id, &[0xD0, 0x87]).expect("two bytes");
    assert_eq!(parse_line("(1436509052.249713) can0 174#D087\n"), Ok((Some(1_436_509_052.249_713), frame)));
    let extended = parse_line("(0.5) vcan0 18F00980#FF").expect("a frame").1;
    assert!(extended.is_extended());
    for line in [
        "",
        "\r",
        "V0101",
        "F00",
        "(1.0) can0 174#D08",
        "(1.0) can0 9999#00",
        "(1.0)",
        "(x) can0 174#",
        "(1.0) can0 174#\u{e9}",
        "t1748",
    ] {
        assert_eq!(parse_line(line), Err(NoFrame), "{line:?}");
    }
}

#[test]
fn bytes_become_lines() {
    let mut splitter = Splitter::default();
    let bytes = [&b"V0101\r\r\x07t1230\r\n"[..], &[b'x'; 1_000_000], b"\rN\r", b"\xFF\r", b"no end"].concat();
    let lines: Vec<String> = bytes.iter().filter_map(|byte| splitter.feed(*byte)).collect();
    let long = "x".repeat(128);
    assert_eq!(lines, ["V0101", "t1230", &long, "N", "\u{FFFD}"]);
}

#[test]
fn a_board_is_read_over_tcp_until_it_goes() {
    const LIMIT: Duration = Duration::from_secs(60);
    let config = Config::DEFAULT;
    let (frames, _) = drive(config, 500);
    let listener = TcpListener::bind("127.0.0.1:0").expect("a port");
    let address = listener.local_addr().expect("a port").to_string();
    let board = std::thread::spawn(move || {
        let mut line = listener.accept().expect("the monitor").0;
        // A connection that is closed with unread bytes is reset, and the other end loses what it has not read.
        let mut commands = Vec::new();
        while !commands.ends_with(b"O\r") {
            let mut byte = [0];
            line.read_exact(&mut byte).expect("the monitor opens");
            commands.extend(byte);
        }
        for frame in &frames {
            line.write_all(&slcan::emit(frame).expect("a data frame")).expect("the monitor reads");
        }
    });
    let mut source = Source::open(&address, 0, config.settings().bits_per_second).expect("it listens");
    let (mut monitor, start) = (Monitor::new(&config), Instant::now());
    // The board goes: that is an end, not a wait.
    let end = loop {
        assert!(start.elapsed() < LIMIT, "{:?}", monitor.counts);
        match source.read() {
            Ok(Lines::Some(lines)) => {
                for line in &lines {
                    let _ = monitor.take_line(line, 0.0);
                }
            }
            end => break end,
        }
    };
    board.join().expect("every line was taken");
    assert_eq!(monitor.counts, Counts { frames: 3_000, ..Counts::default() });
    assert!(matches!(end, Ok(Lines::End) | Err(SourceError::Read { .. })), "{end:?}");
}
