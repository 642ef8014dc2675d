//! Reads PX4 ULog files with the `px4-ulog` crate: the combined IMU, GNSS and wheel encoders.
//!
//! PX4's body axes are x forward, y right, z down; they are converted to y left, z up.

use super::input::{Input, read_up_to};
use super::log::Log;
use super::value::{Fix, Value};
use px4_ulog::stream_parser::LogParser;
use px4_ulog::stream_parser::model::{DataMessage, FlattenedFieldType as Type};

/// First bytes of a ULog file.
pub const MAGIC: &[u8] = b"ULog\x01\x12\x35";
/// Length of the file header, bytes.
const HEAD: usize = 16;

/// Reads a file, including its magic. Reading ends at the first damage, which is counted.
///
/// The crate panics on records that are too short, so it gets only the kinds of records that a drive needs, one at a
/// time, after a check of their length.
pub fn read(input: &mut Input<'_>, log: &mut Log) -> std::io::Result<()> {
    let mut take = |message: &DataMessage<'_>| add(message, log);
    let mut parser = LogParser::default();
    parser.set_data_message_callback(&mut take);
    let mut short = 0;
    let mut record = read_up_to(input, HEAD)?;
    let damage = loop {
        if let Err(error) = parser.consume_bytes(&record) {
            break Some(format!("corrupt from here on: {}", error.description));
        }
        record = read_up_to(input, 3)?;
        let [low, high, kind] = record[..] else {
            break (!record.is_empty()).then(|| "the file ends within a record".to_owned());
        };
        let len = usize::from(u16::from_le_bytes([low, high]));
        record.extend(read_up_to(input, len)?);
        if record.len() < 3 + len {
            break Some("the file ends within a record".to_owned());
        }
        let least = match kind {
            b'B' => 40,
            b'F' => 1,
            b'A' => 4,
            b'D' => 2,
            _ => usize::MAX,
        };
        if len < least {
            short += u64::from(least < usize::MAX);
            record.clear();
        }
    };
    drop(parser);
    for _ in 0..short {
        log.drop("records that are too short".to_owned());
    }
    if let Some(damage) = damage {
        log.drop(damage);
    }
    Ok(())
}

fn add(message: &DataMessage<'_>, log: &mut Log) {
    let name = message.flattened_format.message_name();
    let channel = match message.multi_id.value() {
        0 => name.to_owned(),
        instance => format!("{name}.{instance}"),
    };
    let fields = Fields(message);
    let value = match name {
        "sensor_combined" => fields.imu(),
        "vehicle_gps_position" | "sensor_gps" => fields.fix(),
        "wheel_encoders" => return fields.wheels(&channel, log),
        _ => return log.pass_over(name),
    };
    match (fields.seconds(), value) {
        (Some(seconds), Some(value)) => log.add(&channel, seconds, value),
        _ => log.drop(format!("{channel}: a field is missing or of another type")),
    }
}

struct Fields<'a>(&'a DataMessage<'a>);

impl Fields<'_> {
    fn number(&self, name: &str) -> Option<f64> {
        let field = self.0.flattened_format.field_iter().find(|field| field.flattened_field_name == name)?;
        let bytes = self.0.data.get(field.offset as usize..)?;
        Some(match field.field_type {
            Type::Float => f64::from(f32::from_le_bytes(*bytes.first_chunk()?)),
            Type::Double => f64::from_le_bytes(*bytes.first_chunk()?),
            Type::Int32 => f64::from(i32::from_le_bytes(*bytes.first_chunk()?)),
            Type::UInt64 => u64::from_le_bytes(*bytes.first_chunk()?) as f64,
            Type::UInt8 => f64::from(*bytes.first()?),
            _ => return None,
        })
    }

    fn vector<const N: usize>(&self, name: &str) -> Option<[f64; N]> {
        let mut vector = [0.0; N];
        for (k, component) in vector.iter_mut().enumerate() {
            *component = self.number(&format!("{name}[{k}]"))?;
        }
        Some(vector)
    }

    fn seconds(&self) -> Option<f64> {
        Some(1e-6 * self.number("timestamp")?)
    }

    fn imu(&self) -> Option<Value> {
        let [force, rate] = ["accelerometer_m_s2", "gyro_rad"].map(|name| self.vector(name));
        let up = |[x, y, z]: [f64; 3]| [x, -y, -z];
        Some(Value::Imu(up(force?), up(rate?)))
    }

    /// Returns the GNSS fix. Latitude and longitude are in 1e-7 degrees, or in degrees in logs since version 1.15.
    fn fix(&self) -> Option<Value> {
        let old = ["lat", "lon"].map(|name| Some(1e-7 * self.number(name)?));
        let new = ["latitude_deg", "longitude_deg"].map(|name| self.number(name));
        let [latitude, longitude] = if new[0].is_some() { new } else { old };
        let fixed = self.number("fix_type")? >= 2.0;
        let degrees = if fixed { [latitude?, longitude?] } else { [f64::NAN; 2] };
        let velocity = || {
            let variance = self.number("c_variance_rad")?;
            // Despite its name, the field holds the receiver's standard deviation.
            Some([self.number("vel_m_s")?, self.number("cog_rad")?, variance])
        };
        Some(Value::Position(Fix { degrees, sigma_m: self.number("eph"), velocity: velocity() }))
    }

    fn wheels(&self, channel: &str, log: &mut Log) {
        let Some(seconds) = self.seconds() else { return };
        for k in 0..2 {
            if let Some(rate) = self.number(&format!("wheel_speed[{k}]")) {
                log.add(&format!("{channel}/wheel_speed[{k}]"), seconds, Value::Number(rate));
            }
        }
    }
}
