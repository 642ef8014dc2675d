//! The command `gyronet monitor`: logs, sockets, tables, ends.

use super::{gyronet, text};
use gyronet::can::DataFrame;
use gyronet::can::config::Config;
use gyronet::can::encoder::CanEncoder;
use gyronet::can::fog_encoder::FogEncoder;
use gyronet::can::slcan;
use gyronet::can::yaw::FOG_IDS;
use gyronet::estimate::{VehicleSample, YawEstimate};
use gyronet::units::{AngularRate, Micros, SpecificForce, Yaw};
use gyronet_tools::drive::candump::Log;
use std::io::{Read, Write};
use std::net::TcpListener;
use std::path::PathBuf;
use std::process::Output;
use std::time::Instant;

/// Frames of so many samples at 1 deg/s.
fn frames(samples: u32) -> Vec<DataFrame> {
    let mut encoder = CanEncoder::new(Config::DEFAULT);
    let rate = AngularRate::from_rad_per_sec(1_f32.to_radians()).unwrap();
    let sample = |tick: u32| VehicleSample {
        live: YawEstimate { rate, quality: gyronet::health::Quality::Good, ..YawEstimate::default() },
        delayed: YawEstimate {
            rate,
            yaw: Yaw(i64::from(rate.0) * i64::from(tick)),
            quality: gyronet::health::Quality::Good,
            ..YawEstimate::default()
        },
        roll_rate: AngularRate::ZERO,
        pitch_rate: AngularRate::ZERO,
        specific_force: [SpecificForce(0); 3],
        temperature: None,
        tick,
    };
    (0..samples).flat_map(|tick| encoder.encode(&sample(tick))).collect()
}

fn file(name: &str, content: &[u8]) -> PathBuf {
    let path = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(name);
    std::fs::write(&path, content).unwrap();
    path
}

fn monitor(arguments: &[&str]) -> (Output, String, String) {
    let output = gyronet(&[&["monitor"], arguments].concat());
    let (out, err) = (text(&output.stdout), text(&output.stderr));
    (output, out, err)
}

fn log(name: &str, frames: &[DataFrame]) -> PathBuf {
    let mut log = Vec::new();
    let mut out = Log::new(&mut log);
    for (k, frame) in frames.iter().enumerate() {
        out.frame(Micros(k as u64 / 6 * 10_000), frame).unwrap();
    }
    out.finish().unwrap();
    file(name, &log)
}

#[test]
fn a_log_is_summed_up() {
    let mut frames = frames(500);
    frames.remove(6 * 100 + 3);
    let log = log("drive.log", &frames);
    let (output, out, err) = monitor(&[log.to_str().unwrap()]);
    assert!(output.status.success(), "{err}");
    print!("{out}");
    for part in ["1.000000 deg/s", "4.98999", "Raw, good", "2999, 0 of others, 600", " 1, repeated 0"] {
        assert!(out.contains(part), "{part:?} in {out}");
    }
    // The same values, and the log's own time, not the time to read it.
    let (_, out, err) = monitor(&[log.to_str().unwrap(), "--json"]);
    let json: serde_json::Value = serde_json::from_str(&out).expect(&err);
    for (name, value) in [
        ("time_s", 4.99),
        ("rate_deg_per_s", 1.0),
        ("correction_deg_per_s", 0.0),
        ("drop_in_deg_per_s", 1.0),
        ("lost", 1.0),
        ("repeated", 0.0),
        ("out_of_sequence", 0.0),
        ("damaged", 0.0),
        ("unreadable", 0.0),
    ] {
        assert_eq!(json[name].as_f64(), Some(value), "{name}: {json}");
    }
    assert!((json["yaw_deg"].as_f64().unwrap() - 4.99).abs() < 1e-5, "{json}");
    assert_eq!(
        (&json["source"], &json["quality"], &json["faults"]),
        (&"Raw".into(), &"good".into(), &"none".into())
    );
    assert!(json["sigma_deg_per_s"].is_null() && json["latency_ms"].is_null(), "{json}");
}

#[test]
fn a_fibre_optic_gyro_is_a_second_block() {
    let mut feed = FogEncoder::new(FOG_IDS);
    let rate = AngularRate::from_rad_per_sec(2_f32.to_radians()).unwrap();
    let sample = |tick: i64| YawEstimate {
        rate,
        yaw: Yaw(i64::from(rate.0) * tick),
        quality: gyronet::health::Quality::Good,
        ..YawEstimate::default()
    };
    let mut all = frames(100);
    (0..100).for_each(|tick| feed.send(&sample(tick), |frame| all.push(frame)));
    // An angle of it.
    all.remove(600 + 3 * 50 + 1);
    let log = log("fog.log", &all);
    let (_, out, err) = monitor(&[log.to_str().unwrap()]);
    print!("{out}");
    for part in
        ["fibre-optic gyro\nyaw rate              2.000000 deg/s", "899, 0 of others", " 1, repeated 0"]
    {
        assert!(out.contains(part), "{part:?} in {out}{err}");
    }
    let (_, out, err) = monitor(&[log.to_str().unwrap(), "--json"]);
    let json: serde_json::Value = serde_json::from_str(&out).expect(&err);
    assert_eq!((&json["rate_deg_per_s"], &json["fog"]["rate_deg_per_s"]), (&1.0.into(), &2.0.into()));
    assert!((json["fog"]["yaw_deg"].as_f64().unwrap() - 1.98).abs() < 1e-6, "{json}");
}

#[test]
fn a_socket_is_asked_to_open_and_read_to_its_end() {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = listener.local_addr().unwrap().to_string();
    let board = std::thread::spawn(move || {
        let (mut stream, _) = listener.accept().unwrap();
        let mut hello = [0; 8];
        stream.read_exact(&mut hello).unwrap();
        // The end of a line that was under way, then frames.
        stream.write_all(b"4B0080\r").unwrap();
        for frame in frames(200) {
            stream.write_all(&slcan::emit(&frame).unwrap()).unwrap();
        }
        hello
    });
    let (output, out, err) = monitor(&[&address]);
    assert!(output.status.success(), "{err}");
    assert_eq!(&board.join().unwrap(), b"\rC\rS6\rO\r");
    assert!(out.contains("1200, 0 of others") && out.contains("unreadable lines 0"), "{out}");
}

#[test]
fn it_ends_when_it_should() {
    // A line that says nothing.
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = listener.local_addr().unwrap().to_string();
    let start = Instant::now();
    let (output, out, err) = monitor(&[&address, "--for", "1.5"]);
    let elapsed = start.elapsed().as_secs_f64();
    assert!(output.status.success() && (1.4..10.0).contains(&elapsed), "{elapsed} s: {err}");
    assert!(out.contains("rate - deg/s, yaw - deg"), "a line a second, even of silence: {out}");
    let (output, out, err) = monitor(&[log("once.log", &frames(10)).to_str().unwrap(), "--once"]);
    assert!(output.status.success(), "{err}");
    assert!(out.contains(" 6, 0 of others"), "the first set only: {out}");
}

/// Those by which a receiver's checksums can be tried out.
#[test]
fn the_frames_on_the_page_are_good() {
    let page = std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/../src/can/README.md")).unwrap();
    let frames = page.split('`').filter(|word| word.len() == 20 && word.contains('#'));
    let good: String = frames.map(|frame| format!("(1.000000) can0 {frame}\n")).collect();
    let bad = good.replace("D1\n", "D0\n").replace("02\n", "03\n");
    for (text, damaged) in [(good, 0), (bad, 2)] {
        let (_, out, err) = monitor(&[file("page.log", text.as_bytes()).to_str().unwrap(), "--json"]);
        let json: serde_json::Value = serde_json::from_str(&out).expect(&err);
        assert_eq!((&json["frames"], &json["damaged"]), (&2.into(), &damaged.into()), "{text}");
    }
}

#[test]
fn what_cannot_be_read_is_named() {
    let closed = TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().to_string();
    let text = file("no.log", b"t_s,acc_x\n0.01,3\n");
    let foreign = file("foreign.log", b"(1.000000) can0 123#00\n");
    let (text, foreign) = (text.to_str().unwrap(), foreign.to_str().unwrap());
    for (arguments, part) in [
        (&["/no/such/port"][..], "/no/such/port: neither a file, host:port, nor a serial port"),
        (&[&closed], "cannot connect"),
        (&[text], "no.log: no CAN frame in it"),
        (&[foreign, "--once"], "foreign.log: no complete set of messages"),
        (&[foreign, "--for=-1"], "invalid value '-1'"),
    ] {
        let (output, _, err) = monitor(arguments);
        assert!(!output.status.success() && err.contains(part), "{arguments:?}: {err}");
    }
}
