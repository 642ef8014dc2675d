//! Writes a replayed drive as an MCAP file for Foxglove: inputs, rates, heading, states, CAN frames
//! (JSON).
//!
//! The heading is a `foxglove.PoseInFrame` and a change of state a `foxglove.Log`; Foxglove has panels for both. The
//! other messages are numbers to plot. Times are those of the recording.

use crate::board::Step;
use embedded_can::{Frame, Id};
use gyronet::coprocessor::TimedFrame;
use gyronet::health::Status;
use gyronet::units::Micros;
use mcap::records::MessageHeader;
use mcap::{Compression, McapError, WriteOptions, Writer};
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::io::{Seek, Write};

/// Levels of a `foxglove.Log`.
const INFO: u8 = 2;
const WARNING: u8 = 3;

pub const LAYOUT: &str = include_str!("foxglove/layout.json");

/// Identifiers of a file's channels.
struct Channels {
    input: u16,
    rate: u16,
    pose: u16,
    status: u16,
    can: u16,
}

pub struct Recorder<W: Write + Seek> {
    writer: Writer<W>,
    channels: Channels,
    last: Option<Status>,
    messages: u64,
}

impl<W: Write + Seek> Recorder<W> {
    pub fn new(out: W) -> Result<Self, McapError> {
        let options = WriteOptions::new()
            .compression(Some(Compression::Lz4))
            .library(concat!("gyronet ", env!("CARGO_PKG_VERSION")));
        let mut writer = Writer::with_options(out, options)?;
        let channels = channels(&mut writer)?;
        Ok(Self { writer, channels, last: None, messages: 0 })
    }

    pub fn step(&mut self, step: &Step) -> Result<(), McapError> {
        let time = step.time;
        let row = &step.input;
        let sample = &row.sample;
        self.message(
            self.channels.input,
            time,
            &json!({
                "timestamp": stamp(time),
                "angular_rate": vector(sample.angular_rate.map(|rate| rate.rad_per_sec())),
                "specific_force": vector(sample.specific_force.map(|force| force.metre_per_sec2())),
                "wheels": row.wheels,
            }),
        )?;
        self.message(self.channels.rate, time, &rate(step, row.reference))?;
        let half = 0.5 * step.vehicle.delayed.yaw.rad();
        self.message(
            self.channels.pose,
            time,
            &json!({
                "timestamp": stamp(time),
                "frame_id": "start",
                "pose": {
                    "position": vector([0.0; 3]),
                    "orientation": { "x": 0.0, "y": 0.0, "z": half.sin(), "w": half.cos() },
                },
            }),
        )?;
        let status = step.vehicle.live.status;
        if self.last != Some(status) {
            let level = if status == Status::Ready { INFO } else { WARNING };
            self.message(
                self.channels.status,
                time,
                &json!({
                    "timestamp": stamp(time),
                    "level": level,
                    "message": format!("{status:?}").to_lowercase(),
                    "name": "gyronet",
                    "file": "",
                    "line": 0,
                }),
            )?;
        }
        self.last = Some(status);
        for TimedFrame { frame, time } in &step.frames {
            let (id, extended) = match frame.id() {
                Id::Standard(id) => (u32::from(id.as_raw()), false),
                Id::Extended(id) => (id.as_raw(), true),
            };
            let data = frame.data().iter().fold(String::new(), |mut text, byte| {
                // Writing to a string does not fail.
                let _ = write!(text, "{byte:02X}");
                text
            });
            self.message(
                self.channels.can,
                *time,
                &json!({
                    "timestamp": stamp(*time),
                    "id": id,
                    "extended": extended,
                    "data": data,
                }),
            )?;
        }
        Ok(())
    }

    /// Ends the file, and returns the number of messages.
    pub fn finish(&mut self) -> Result<u64, McapError> {
        self.writer.finish()?;
        Ok(self.messages)
    }

    fn message(&mut self, channel_id: u16, time: Micros, value: &Value) -> Result<(), McapError> {
        let nanos = 1_000 * time.0;
        let header = MessageHeader { channel_id, sequence: 0, log_time: nanos, publish_time: nanos };
        self.messages += 1;
        self.writer.write_to_known_channel(&header, value.to_string().as_bytes())
    }
}

fn rate(step: &Step, reference: Option<f64>) -> Value {
    let (live, delayed) = (&step.vehicle.live, step.delayed);
    json!({
        "timestamp": stamp(step.time),
        "live": live.rate.rad_per_sec(),
        "delayed": delayed.map(|delayed| delayed.rate.rad_per_sec()),
        "complete": step.complete.rad_per_sec(),
        "correction": live.correction.rad_per_sec(),
        "sigma": live.sigma.map(|sigma| sigma.rad_per_sec()),
        "yaw": step.vehicle.delayed.yaw.rad(),
        "status": format!("{:?}", live.status).to_lowercase(),
        "standstill": format!("{:?}", step.standstill).to_lowercase(),
        "reference": reference,
    })
}

fn channels(writer: &mut Writer<impl Write + Seek>) -> Result<Channels, McapError> {
    let mut channel = |topic: &str, schema: &str, properties: Value| {
        let text = json!({ "title": schema, "type": "object", "properties": properties }).to_string();
        let schema = writer.add_schema(schema, "jsonschema", text.as_bytes())?;
        writer.add_channel(schema, topic, "json", &BTreeMap::new())
    };
    let (number, text, whole) =
        (json!({ "type": "number" }), json!({ "type": "string" }), json!({ "type": "integer" }));
    let perhaps = json!({ "type": ["number", "null"] });
    let object = |properties: Value| json!({ "type": "object", "properties": properties });
    let stamp = object(json!({ "sec": whole, "nsec": whole }));
    let vector = object(json!({ "x": number, "y": number, "z": number }));
    let turn = object(json!({ "x": number, "y": number, "z": number, "w": number }));
    Ok(Channels {
        input: channel(
            "/input",
            "gyronet.Input",
            json!({
                "timestamp": stamp,
                "angular_rate": vector,
                "specific_force": vector,
                "wheels": { "type": "array", "items": perhaps },
            }),
        )?,
        rate: channel(
            "/rate",
            "gyronet.Rate",
            json!({
                "timestamp": stamp,
                "live": number,
                "delayed": perhaps,
                "complete": number,
                "correction": number,
                "sigma": perhaps,
                "yaw": number,
                "status": text,
                "standstill": text,
                "reference": perhaps,
            }),
        )?,
        pose: channel(
            "/pose",
            "foxglove.PoseInFrame",
            json!({
                "timestamp": stamp,
                "frame_id": text,
                "pose": object(json!({ "position": vector, "orientation": turn })),
            }),
        )?,
        status: channel(
            "/status",
            "foxglove.Log",
            json!({
                "timestamp": stamp,
                "level": whole,
                "message": text,
                "name": text,
                "file": text,
                "line": whole,
            }),
        )?,
        can: channel(
            "/can",
            "gyronet.CanFrame",
            json!({
                "timestamp": stamp,
                "id": whole,
                "extended": { "type": "boolean" },
                "data": text,
            }),
        )?,
    })
}

fn stamp(Micros(us): Micros) -> Value {
    json!({ "sec": us / 1_000_000, "nsec": us % 1_000_000 * 1_000 })
}

fn vector([x, y, z]: [f64; 3]) -> Value {
    json!({ "x": x, "y": y, "z": z })
}
