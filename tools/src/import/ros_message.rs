//! Parses ROS messages of the types that a drive can need, in ROS 1 serialisation and in CDR (ROS 2).
//!
//! The two differ in three ways: CDR aligns each number to its size, ends a string with a zero, and names its byte
//! order; a ROS 1 header begins with a sequence number.

use super::log::Log;
use super::value::{Fix, Value};

/// The serialisation of a message.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Encoding {
    /// ROS 1: packed, little-endian.
    Ros1,
    /// CDR after a header of four bytes.
    Cdr,
}

/// Adds a message to the log under its topic. `recorded` is the recording time, s, for messages whose stamp is zero.
pub fn add(log: &mut Log, topic: &str, kind: &str, encoding: Encoding, bytes: &[u8], recorded: f64) {
    let kind = kind.replace("/msg/", "/");
    let read: fn(&mut Cursor<'_>) -> Option<Value> = match kind.as_str() {
        "sensor_msgs/Imu" => imu,
        "nav_msgs/Odometry" => odometry,
        "sensor_msgs/NavSatFix" => fix,
        "geometry_msgs/TwistStamped" => twist,
        "sensor_msgs/JointState" => return joints(log, topic, encoding, bytes, recorded),
        _ => return log.pass_over(&kind),
    };
    let mut cursor = Cursor::new(encoding, bytes);
    let parsed = cursor.as_mut().and_then(|cursor| Some((cursor.header()?, read(cursor)?)));
    match parsed {
        Some((stamp, value)) => log.add(topic, if stamp > 0.0 { stamp } else { recorded }, value),
        None => log.drop(format!("{topic}: invalid or truncated {kind}")),
    }
}

fn imu(cursor: &mut Cursor<'_>) -> Option<Value> {
    cursor.numbers::<13>()?;
    let rate = cursor.numbers()?;
    // A first covariance element of -1 says that the driver has no such reading.
    let unknown = cursor.numbers::<9>()?[0] == -1.0;
    let force = cursor.numbers()?;
    let unknown = unknown || cursor.numbers::<9>()?[0] == -1.0;
    (!unknown).then_some(Value::Imu(force, rate))
}

fn odometry(cursor: &mut Cursor<'_>) -> Option<Value> {
    cursor.string()?;
    cursor.numbers::<43>()?;
    twist(cursor)
}

fn twist(cursor: &mut Cursor<'_>) -> Option<Value> {
    let [forward, _, _, _, _, yaw] = cursor.numbers()?;
    Some(Value::Odometry(forward, yaw))
}

fn fix(cursor: &mut Cursor<'_>) -> Option<Value> {
    let status = cursor.byte()?.cast_signed();
    cursor.number(2)?;
    let [latitude, longitude, _] = cursor.numbers()?;
    let covariance: [f64; 9] = cursor.numbers()?;
    let known = cursor.byte()? > 0;
    let variance = 0.5 * (covariance[0] + covariance[4]);
    let sigma_m = (known && variance > 0.0).then(|| variance.sqrt());
    // A status below zero means no fix; such a message is not an error.
    let degrees = if status < 0 { [f64::NAN; 2] } else { [latitude, longitude] };
    Some(Value::Position(Fix { degrees, sigma_m, velocity: None }))
}

/// Adds joints as signals TOPIC/NAME in rad/s; drivers of robots report their wheels as joints.
fn joints(log: &mut Log, topic: &str, encoding: Encoding, bytes: &[u8], recorded: f64) {
    let parse = || {
        let mut cursor = Cursor::new(encoding, bytes)?;
        let stamp = cursor.header()?;
        let names = cursor.count(4)?;
        let names: Option<Vec<String>> = (0..names).map(|_| cursor.string()).collect();
        let positions = cursor.count(8)?;
        for _ in 0..positions {
            cursor.f64()?;
        }
        let rates = cursor.count(8)?;
        let rates: Option<Vec<f64>> = (0..rates).map(|_| cursor.f64()).collect();
        Some((stamp, names?, rates?))
    };
    let Some((stamp, names, rates)) = parse() else {
        return log.drop(format!("{topic}: invalid or truncated sensor_msgs/JointState"));
    };
    for (name, rate) in names.iter().zip(rates) {
        log.add(&format!("{topic}/{name}"), if stamp > 0.0 { stamp } else { recorded }, Value::Number(rate));
    }
}

/// A reader of a message's fields.
struct Cursor<'a> {
    encoding: Encoding,
    big_endian: bool,
    bytes: &'a [u8],
    at: usize,
}

impl<'a> Cursor<'a> {
    fn new(encoding: Encoding, bytes: &'a [u8]) -> Option<Self> {
        let (big_endian, bytes) = match encoding {
            Encoding::Ros1 => (false, bytes),
            // Plain CDR, version 1: the second byte is the byte order. Other encapsulations are not supported.
            Encoding::Cdr => match bytes {
                [0, order @ (0 | 1), _, _, rest @ ..] => (*order == 0, rest),
                _ => return None,
            },
        };
        Some(Self { encoding, big_endian, bytes, at: 0 })
    }

    fn take(&mut self, len: usize) -> Option<&'a [u8]> {
        let end = self.at.checked_add(len)?;
        let taken = self.bytes.get(self.at..end)?;
        self.at = end;
        Some(taken)
    }

    fn byte(&mut self) -> Option<u8> {
        self.take(1)?.first().copied()
    }

    /// Reads an unsigned number of up to eight bytes.
    fn number(&mut self, size: usize) -> Option<u64> {
        if self.encoding == Encoding::Cdr {
            self.at = self.at.checked_next_multiple_of(size)?;
        }
        let big_endian = self.big_endian;
        let add = |sum: u64, byte: &u8| sum << 8 | u64::from(*byte);
        let bytes = self.take(size)?;
        Some(if big_endian { bytes.iter().fold(0, add) } else { bytes.iter().rev().fold(0, add) })
    }

    fn u32(&mut self) -> Option<u32> {
        u32::try_from(self.number(4)?).ok()
    }

    fn f64(&mut self) -> Option<f64> {
        self.number(8).map(f64::from_bits)
    }

    fn numbers<const N: usize>(&mut self) -> Option<[f64; N]> {
        let mut numbers = [0.0; N];
        for number in &mut numbers {
            *number = self.f64()?;
        }
        Some(numbers)
    }

    /// Reads the number of elements that follow; `None` if the remaining bytes cannot hold them.
    fn count(&mut self, size: usize) -> Option<usize> {
        let count = self.u32()? as usize;
        (count <= self.bytes.len().saturating_sub(self.at) / size).then_some(count)
    }

    fn string(&mut self) -> Option<String> {
        let len = self.u32()? as usize;
        let bytes = self.take(len)?;
        let bytes = bytes.strip_suffix(&[0]).unwrap_or(bytes);
        Some(String::from_utf8_lossy(bytes).into_owned())
    }

    /// Reads a header and returns its time stamp, s.
    fn header(&mut self) -> Option<f64> {
        if self.encoding == Encoding::Ros1 {
            self.u32()?;
        }
        let (seconds, nanos) = (self.u32()?, self.u32()?);
        self.string()?;
        Some(f64::from(seconds) + 1e-9 * f64::from(nanos))
    }
}
