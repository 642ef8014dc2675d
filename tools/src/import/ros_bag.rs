//! Reads ROS 1 bags, version 2.0: a sequence of records, with messages in compressed chunks.
//!
//! The `rosbag` crate maps the whole file and finds its chunks by the index at the end, which a truncated recording
//! does not have. This module reads the records in order and does not need the index.

use super::input::{Input, read_up_to};
use super::log::Log;
use super::ros_message::{self, Encoding};
use std::collections::BTreeMap;
use std::io::Read;

/// First bytes of a bag.
pub const MAGIC: &[u8] = b"#ROSBAG V2.0\n";
/// Largest record, and largest chunk once unpacked; the recorder's own default is 768 KiB.
const MAX_RECORD: u32 = 256 << 20;

/// Topic and type of each connection, by its number.
type Connections = BTreeMap<u32, (String, String)>;

/// Reads a bag after its magic.
pub fn read(input: &mut Input<'_>, log: &mut Log) -> std::io::Result<()> {
    let mut connections = Connections::new();
    loop {
        let header = match part(input)? {
            Part::Bytes(header) => header,
            Part::End => return Ok(()),
            Part::Cut => break,
        };
        let Part::Bytes(data) = part(input)? else { break };
        let fields = Fields(&header);
        match fields.get("op") {
            Some([0x05]) => match unpack(&fields, data) {
                Ok(chunk) => records(&chunk, &mut connections, log),
                Err(reason) => log.drop(format!("chunks: {reason}")),
            },
            Some([0x07]) => connect(&fields, &data, &mut connections),
            Some([0x02]) => message(&fields, &data, &connections, log),
            _ => {}
        }
    }
    log.drop("the file ends within a record".to_owned());
    Ok(())
}

enum Part {
    Bytes(Vec<u8>),
    End,
    Cut,
}

/// Reads a length and as many bytes.
fn part(input: &mut Input<'_>) -> std::io::Result<Part> {
    let len = read_up_to(input, 4)?;
    if len.is_empty() {
        return Ok(Part::End);
    }
    let Ok(len) = len.try_into().map(u32::from_le_bytes) else { return Ok(Part::Cut) };
    if len > MAX_RECORD {
        return Ok(Part::Cut);
    }
    let bytes = read_up_to(input, len as usize)?;
    Ok(if bytes.len() < len as usize { Part::Cut } else { Part::Bytes(bytes) })
}

fn unpack(fields: &Fields<'_>, data: Vec<u8>) -> Result<Vec<u8>, &'static str> {
    let limit = u64::from(MAX_RECORD);
    let mut unpacked = Vec::new();
    let done = match fields.get("compression") {
        Some(b"none") => return Ok(data),
        Some(b"bz2") => bzip2_rs::DecoderReader::new(&data[..]).take(limit).read_to_end(&mut unpacked),
        Some(b"lz4") => match lz4::Decoder::new(&data[..]) {
            Ok(decoder) => decoder.take(limit).read_to_end(&mut unpacked),
            Err(error) => Err(error),
        },
        _ => return Err("unknown compression"),
    };
    done.map_err(|_| "corrupt compressed data")?;
    Ok(unpacked)
}

fn records(mut chunk: &[u8], connections: &mut Connections, log: &mut Log) {
    while !chunk.is_empty() {
        let (Some(header), Some(data)) = (block(&mut chunk), block(&mut chunk)) else {
            return log.drop("the chunk ends within a record".to_owned());
        };
        let fields = Fields(header);
        match fields.get("op") {
            Some([0x07]) => connect(&fields, data, connections),
            Some([0x02]) => message(&fields, data, connections, log),
            _ => {}
        }
    }
}

fn block<'a>(bytes: &mut &'a [u8]) -> Option<&'a [u8]> {
    let (len, rest) = bytes.split_first_chunk()?;
    let (block, rest) = rest.split_at_checked(u32::from_le_bytes(*len) as usize)?;
    *bytes = rest;
    Some(block)
}

fn connect(fields: &Fields<'_>, data: &[u8], connections: &mut Connections) {
    let text = |bytes: Option<&[u8]>| bytes.map(|bytes| String::from_utf8_lossy(bytes).into_owned());
    let parts = (fields.u32("conn"), text(fields.get("topic")), text(Fields(data).get("type")));
    if let (Some(id), Some(topic), Some(kind)) = parts
        && connections.len() < 4_096
    {
        connections.insert(id, (topic, kind));
    }
}

fn message(fields: &Fields<'_>, data: &[u8], connections: &Connections, log: &mut Log) {
    let time = fields.get("time").and_then(|time| time.split_first_chunk::<4>());
    let time = time.and_then(|(seconds, nanos)| {
        let nanos = u32::from_le_bytes(nanos.try_into().ok()?);
        Some(f64::from(u32::from_le_bytes(*seconds)) + 1e-9 * f64::from(nanos))
    });
    let connection = fields.u32("conn").and_then(|id| connections.get(&id));
    match (time, connection) {
        (Some(time), Some((topic, kind))) => {
            ros_message::add(log, topic, kind, Encoding::Ros1, data, time);
        }
        _ => log.drop("messages of an unknown connection".to_owned()),
    }
}

/// The NAME=VALUE fields of a header.
struct Fields<'a>(&'a [u8]);

impl<'a> Fields<'a> {
    fn get(&self, name: &str) -> Option<&'a [u8]> {
        let mut rest = self.0;
        while let Some(field) = block(&mut rest) {
            let at = field.iter().position(|byte| *byte == b'=')?;
            if &field[..at] == name.as_bytes() {
                return Some(&field[at + 1..]);
            }
        }
        None
    }

    fn u32(&self, name: &str) -> Option<u32> {
        self.get(name)?.try_into().ok().map(u32::from_le_bytes)
    }
}
