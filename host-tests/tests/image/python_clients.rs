//! Clients that we did not write: python-can reads our SLCAN, cantools decodes by our DBC file.
//!
//! The library stands in for the board, with a rate that is exactly 0.001 deg/s. Skipped, aloud, where `GYRONET_PYTHON` (or `python3`) has no python-can,
//! pyserial and cantools.

use gyronet::can::config::Config;
use gyronet::can::encoder::CanEncoder;
use gyronet::can::slcan;
use gyronet::can::slcan::assembler::LineAssembler;
use gyronet::can::slcan::host::{Session, StatusFlags};
use gyronet::estimate::VehicleSample;
use gyronet::units::{AngularRate, Yaw};
use gyronet_host_tests::require;
use gyronet_host_tests::synthetic;
use std::collections::BTreeMap;
use std::io::{self, ErrorKind, Read, Write};
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::path::Path;
use std::process::Command;

const MINUTE: u32 = 6_000;
const PERIOD_S: f64 = 0.01;
/// Half a least bit of the angle, 360 deg / 2^32: deg.
const HALF_ANGLE_LSB: f64 = 4.2e-8;
/// The rounding of a sum of a hundred thousand floats.
const FLOATS: f64 = 1e-8;
const FOLDER: &str = env!("CARGO_MANIFEST_DIR");

const PACKAGES: &[&str] = &["can", "serial", "cantools"];

/// A parked car that seems to turn at 0.001 deg/s.
fn parked(tick: u32, yaw: &mut Yaw) -> VehicleSample {
    let rate = AngularRate::from_rad_per_sec(0.001_f32.to_radians()).expect("in range");
    yaw.0 += i64::from(rate.0);
    synthetic::vehicle(tick, rate, *yaw)
}

/// Serves the client until it is gone. Returns the yaw turned by then.
fn serve(mut stream: TcpStream, config: Config, samples: u32) -> io::Result<Yaw> {
    let mut yaw = Yaw::default();
    match converse(&mut stream, config, samples, &mut yaw) {
        // Gone with the answer to its last words unread.
        Err(error) if !matches!(error.kind(), ErrorKind::ConnectionReset | ErrorKind::BrokenPipe) => {
            Err(error)
        }
        _ => Ok(yaw),
    }
}

/// Answers between frames, and behind the last one: a slow client asks then.
fn converse(stream: &mut TcpStream, config: Config, samples: u32, yaw: &mut Yaw) -> io::Result<()> {
    let mut encoder = CanEncoder::new(config);
    let mut session = Session::new(config.settings().bits_per_second);
    let mut assembler = LineAssembler::new();
    // A board sends from the start; here the client must not miss the first frame, since the
    // sums are compared.
    let mut opened = false;
    let mut tick = 0;
    loop {
        let sending = opened && tick < samples;
        let mut bytes = [0; 64];
        stream.set_nonblocking(sending)?;
        let count = match stream.read(&mut bytes) {
            Ok(0) => return Ok(()),
            Ok(count) => count,
            Err(error) if error.kind() == ErrorKind::WouldBlock => 0,
            Err(error) => return Err(error),
        };
        stream.set_nonblocking(false)?;
        for byte in bytes.iter().take(count) {
            if let Some(Ok(line)) = assembler.receive(*byte) {
                opened |= line == b"O";
                stream.write_all(&session.execute(line, StatusFlags::default()).answer)?;
            }
        }
        if sending {
            for frame in encoder.encode(&parked(tick, yaw)) {
                stream.write_all(&slcan::emit(&frame).expect("a data frame"))?;
            }
            tick += 1;
        }
    }
}

#[test]
fn python_sums_the_whole_angle_of_a_minute() {
    let Some(python) = require::python("python_sums_the_whole_angle_of_a_minute", PACKAGES) else { return };
    let listener = TcpListener::bind("127.0.0.1:0").expect("a port");
    let address = listener.local_addr().expect("a port");
    let board = std::thread::spawn(move || serve(listener.accept()?.0, Config::DEFAULT, MINUTE));
    let sums = Sums::read(&python, address, MINUTE);
    sums.check(MINUTE);
    let yaw = board.join().expect("no panic").expect("the line holds").rad().to_degrees();
    assert!((sums.yaw - yaw).abs() <= HALF_ANGLE_LSB + FLOATS, "{} {yaw}", sums.yaw);
    // The sum of what a receiver gets without the residual: nothing at all.
    assert_eq!((sums.good, sums.plain), (MINUTE, 0.0));
    assert!((sums.plain_error() - 3.6).abs() < 0.001);
}

struct Sums {
    frames: u32,
    good: u32,
    drop_in: f64,
    full: f64,
    plain: f64,
    yaw: f64,
}

impl Sums {
    fn read(python: &str, address: SocketAddr, samples: u32) -> Self {
        let output = Command::new(python)
            .arg(Path::new(FOLDER).join("tests/clients/integrate.py"))
            .arg(format!("socket://{address}"))
            .arg(Path::new(FOLDER).join("../tools/gyronet.dbc"))
            .arg(samples.to_string())
            .output()
            .expect("python runs");
        let text = String::from_utf8_lossy(&output.stdout);
        println!("{text}");
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let said: BTreeMap<&str, &str> = text.lines().filter_map(|line| line.split_once(' ')).collect();
        assert_eq!((said["version"], said["serial"]), ("1 1", "GYRO"));
        assert_eq!(said["counters"], "15 good");
        let sum = |name| said[name].parse::<f64>().expect("a number");
        let count =
            |name| said[name].split(' ').next().and_then(|count| count.parse().ok()).expect("a number");
        Self {
            frames: count("frames"),
            good: count("good"),
            drop_in: sum("drop_in"),
            full: sum("full"),
            plain: sum("plain"),
            yaw: sum("yaw"),
        }
    }

    /// Checks that both encoders sum up to the accumulated yaw, within half an LSB for one period.
    fn check(&self, samples: u32) {
        assert_eq!(self.frames, 6 * samples);
        let rows = [("drop-in", self.drop_in, 0.005), ("own", self.full, 1e-6)];
        for (name, sum, lsb) in rows {
            let (error, limit) = ((sum - self.yaw).abs(), lsb / 2.0 * PERIOD_S);
            println!(
                "{name}: sum is off by {error:.3e} deg; half an LSB for a period is {limit:.3e}, half an LSB of the angle {HALF_ANGLE_LSB:.1e}"
            );
            assert!(error <= limit + HALF_ANGLE_LSB + FLOATS, "{name}: {sum} {}", self.yaw);
        }
        println!("plainly rounded, the drop-in message would be off by {:.3} deg/h", self.plain_error());
    }

    /// deg/h.
    fn plain_error(&self) -> f64 {
        (self.yaw - self.plain) / (f64::from(self.good) * PERIOD_S) * 3_600.0
    }
}
