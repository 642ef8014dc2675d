//! The monitor counts what is lost, repeated and damaged, and loses no angle over it.

use embedded_can::{Frame, StandardId};
use gyronet::can::DataFrame;
use gyronet::can::config::{Config, Settings};
use gyronet::can::encoder::CanEncoder;
use gyronet::units::{AngularRate, Yaw};
use gyronet_host_tests::synthetic;
use gyronet_tools::client::monitor::line::{NoFrame, Splitter, parse_line};
use gyronet_tools::client::monitor::{Counts, Monitor};

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
