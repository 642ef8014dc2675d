//! The monitor counts what is lost, repeated and damaged, and loses no angle over it.

use embedded_can::{Frame, StandardId};
use gyronet::can::config::{Config, Settings};
use gyronet::can::feeds::Feeds;
use gyronet::can::{DataFrame, slcan};
use gyronet::units::{AngularRate, Micros, Yaw};
use gyronet_host_tests::synthetic;
use gyronet_tools::monitor::{Counts, Monitor, NoFrame, parse_line};

/// Frames of a car that turns at 50 deg/s, and how far it has turned, deg.
fn drive(config: Config, samples: u32) -> (Vec<DataFrame>, f64) {
    let mut feeds = Feeds::new(config);
    let rate = AngularRate::from_rad_per_sec(50_f32.to_radians()).expect("in range");
    let mut frames = Vec::new();
    for tick in 0..samples {
        let sample = synthetic::vehicle(tick, rate, Yaw(i64::from(rate.0) * i64::from(tick)));
        frames.extend(feeds.process::<DataFrame>(&sample));
    }
    (frames, rate.rad_per_sec().to_degrees() * f64::from(samples - 1) / 100.0)
}

#[test]
fn a_good_line() {
    let config = Config::new(Settings::DEFAULT).expect("checked");
    let (frames, turned) = drive(config, 1000);
    let mut monitor = Monitor::new(&config);
    for (k, frame) in frames.iter().enumerate() {
        let line = slcan::emit(frame).expect("a data frame");
        let stamped = slcan::emit_stamped(frame, Micros(k as u64 * 1000)).expect("a data frame");
        let text = |line: &[u8]| String::from_utf8_lossy(line).into_owned();
        assert_eq!(parse_line(&text(&line)), Ok((None, *frame)));
        assert_eq!(parse_line(&text(&stamped)), Ok((Some(k as f64 / 1000.0), *frame)));
        monitor.take(frame);
    }
    // TX2 and TX3 are no yaw.
    let counts = Counts { frames: 4000, foreign: 2000, ..Counts::default() };
    assert_eq!(monitor.counts, counts);
    assert!((monitor.state.yaw - turned).abs() < 1e-6, "{} {turned}", monitor.state.yaw);
    assert!((monitor.state.rate.expect("known") - 50.0).abs() < 1e-5);
    assert!((monitor.state.drop_in.expect("known") - 50.0).abs() < 0.006);
    let row = monitor.row(9.99);
    assert_eq!(row.split(',').count(), Monitor::HEADING.split(',').count());
    assert!(row.contains(",GyroNet,Good,0,0,,"), "{row}");
    println!("{}\n{row}\n{monitor}", Monitor::HEADING);
}

#[test]
fn a_bad_line() {
    let config = Config::new(Settings::DEFAULT).expect("checked");
    let (frames, turned) = drive(config, 1000);
    let mut monitor = Monitor::new(&config);
    for (k, frame) in frames.iter().enumerate() {
        // Six frames a sample: TX1 to TX3, rate, angle, detail.
        match (k / 6, k % 6) {
            // Three angles are lost.
            (100..=102, 4) => {}
            (200, 3) => {
                monitor.take(frame);
                monitor.take(frame);
            }
            (300, 5) | (400, 0) => {
                let mut data = [0; 8];
                data.copy_from_slice(frame.data());
                data[4] ^= 0x80;
                monitor.take(&DataFrame::new(frame.id(), &data).expect("eight bytes"));
            }
            _ => monitor.take(frame),
        }
    }
    // A damaged message is missing too, when the next one comes.
    let due = Counts { frames: 3998, foreign: 2000, lost: 5, repeated: 1, damaged: 2, out_of_sequence: 0 };
    assert_eq!(monitor.counts, due);
    assert!((monitor.state.yaw - turned).abs() < 1e-6, "{} {turned}", monitor.state.yaw);
}

#[test]
fn logs() {
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
