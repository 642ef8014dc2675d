//! Clients that we did not write: python-can reads our SLCAN, cantools decodes by our DBC file.
//!
//! The library stands in for the board. Skipped, aloud, where `GYRONET_PYTHON` (or `python3`)
//! has no python-can, pyserial and cantools.

use gyronet::can::config::{BoschSettings, Config, Settings};
use gyronet::can::feeds::Feeds;
use gyronet::can::slcan::assembler::LineAssembler;
use gyronet::can::slcan::host::{Session, StatusFlags};
use gyronet::can::{DataFrame, slcan};
use gyronet::units::{AngularRate, Yaw};
use gyronet::vehicle::VehicleSample;
use gyronet_host_tests::require::{self, Need};
use gyronet_host_tests::synthetic;
use std::collections::BTreeMap;
use std::io::{self, Read, Write};
use std::net::{TcpListener, TcpStream};
use std::path::Path;
use std::process::Command;

const MINUTE: u32 = 6_000;
const FOLDER: &str = env!("CARGO_MANIFEST_DIR");

fn python(test: &str) -> Option<String> {
    let python = std::env::var("GYRONET_PYTHON").unwrap_or_else(|_| "python3".to_owned());
    let check = Command::new(&python).args(["-c", "import can, serial, cantools"]).output();
    let found = if check.is_ok_and(|output| output.status.success()) {
        Ok(python)
    } else {
        Err(format!("{python} has no python-can, pyserial and cantools"))
    };
    require::wants(test, Need::Python, found)
}

/// A parked car that seems to turn at 0.001 deg/s.
fn parked(tick: u32, yaw: &mut Yaw) -> VehicleSample {
    let rate = AngularRate::from_rad_per_sec(0.001_f32.to_radians()).expect("in range");
    yaw.0 += i64::from(rate.0);
    synthetic::vehicle(tick, rate, *yaw)
}

/// The board: answers between frames, sends whatever it is told.
fn serve(mut stream: TcpStream, config: Config, samples: u32) -> io::Result<Yaw> {
    let mut feeds = Feeds::new(config);
    let mut session = Session::new(config.settings().bits_per_second);
    let mut assembler = LineAssembler::new();
    let mut yaw = Yaw::default();
    // A board sends from the start; here the client must not miss the first frame, since the
    // sums are compared.
    let mut opened = false;
    let mut tick = 0;
    while tick < samples {
        let mut bytes = [0; 64];
        stream.set_nonblocking(opened)?;
        let count = match stream.read(&mut bytes) {
            Ok(count) => count,
            Err(error) if error.kind() == io::ErrorKind::WouldBlock => 0,
            Err(error) => return Err(error),
        };
        stream.set_nonblocking(false)?;
        for byte in bytes.iter().take(count) {
            if let Some(Ok(line)) = assembler.push(*byte) {
                opened |= line == b"O";
                stream.write_all(&session.process(line, StatusFlags::default()).answer)?;
            }
        }
        if opened {
            for frame in feeds.process::<DataFrame>(&parked(tick, &mut yaw)) {
                stream.write_all(&slcan::emit(&frame).expect("a data frame"))?;
            }
            tick += 1;
        }
    }
    // Until the client is gone; it may say something more.
    while stream.read(&mut [0; 64]).is_ok_and(|count| count > 0) {}
    Ok(yaw)
}

#[test]
fn the_whole_angle_of_a_minute() {
    compare("the_whole_angle_of_a_minute", MINUTE);
}

#[test]
#[ignore = "python-can takes a minute for it"]
fn the_whole_angle_of_ten_minutes() {
    compare("the_whole_angle_of_ten_minutes", 10 * MINUTE);
}

fn compare(test: &str, samples: u32) {
    let Some(python) = python(test) else { return };
    // One drop-in message and our own, so that Python keeps up.
    let bosch = Some(BoschSettings { tx1_only: true });
    let config = Config::new(Settings { bosch, ..Settings::DEFAULT }).expect("checked");
    let listener = TcpListener::bind("127.0.0.1:0").expect("a port");
    let channel = format!("socket://{}", listener.local_addr().expect("a port"));
    let board = std::thread::spawn(move || serve(listener.accept()?.0, config, samples));
    let output = Command::new(python)
        .arg(Path::new(FOLDER).join("tests/clients/integrate.py"))
        .arg(channel)
        .arg(Path::new(FOLDER).join("../tools/gyronet.dbc"))
        .arg(samples.to_string())
        .output()
        .expect("python runs");
    let text = String::from_utf8_lossy(&output.stdout);
    println!("{text}");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let yaw = board.join().expect("no panic").expect("the line holds").rad().to_degrees();
    let said: BTreeMap<&str, &str> = text.lines().filter_map(|line| line.split_once(' ')).collect();
    assert_eq!((said["version"], said["serial"]), ("1 1", "GYRO"));
    assert_eq!(
        said["frames"],
        (4 * samples - 1).to_string(),
        "the last message of the last set is not awaited"
    );
    assert_eq!(said["counters"], "15 good");
    let sum = |name| said[name].parse::<f64>().expect("a number");
    // Half an LSB for one period; sums of a hundred thousand floats need a little.
    assert!((sum("drop_in") - yaw).abs() <= 0.0025 * 0.01 + 1e-8, "{} {yaw}", sum("drop_in"));
    assert!((sum("full") - yaw).abs() <= 0.5e-6 * 0.01 + 1e-8, "{} {yaw}", sum("full"));
    assert!((sum("yaw") - yaw).abs() <= 4.2e-8 + 1e-8, "{} {yaw}", sum("yaw"));
}
