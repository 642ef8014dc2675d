//! Reads Vector's binary log (BLF): a sequence of objects, most in zlib-compressed containers.
//!
//! The crate `ablf` is not used. It decodes only one of the four objects that hold a frame, and prints to standard
//! output when an object does not begin where it expects.

use super::can::{Bus, Frame, add};
use super::input::{Input, read_up_to};
use super::log::Log;

/// First bytes of a BLF file.
pub const MAGIC: &[u8] = b"LOGG";
const OBJECT: &[u8] = b"LOBJ";
/// Length of an object's base header, bytes.
const BASE: usize = 16;
/// Largest container, compressed or not, bytes; Vector's own hold 128 KiB.
const MAX_CONTAINER: usize = 64 << 20;
/// Object types.
const CONTAINER: u32 = 10;
const CAN_MESSAGE: u32 = 1;
const CAN_MESSAGE_2: u32 = 86;
const CAN_FD: u32 = 100;
const CAN_FD_64: u32 = 101;

/// Reads a file, including its magic.
pub fn read(input: &mut Input<'_>, bus: Option<&Bus>, log: &mut Log) -> std::io::Result<()> {
    let head = read_up_to(input, 8)?;
    let len = u32_at(&head, 4).unwrap_or_default() as usize;
    // Of the header only the start time is used; the statistics of a truncated file are wrong.
    let head = read_up_to(input, len.clamp(8, 1 << 16) - 8)?;
    let start = start_seconds(&head).unwrap_or_default();
    let mut unpacked = Vec::new();
    loop {
        let base = read_up_to(input, BASE)?;
        if base.is_empty() {
            break;
        }
        let len = u32_at(&base, 8).unwrap_or_default() as usize;
        if !base.starts_with(OBJECT) || !(BASE..=MAX_CONTAINER).contains(&len) {
            log.drop("corrupt from here on: no object where one should begin".to_owned());
            break;
        }
        let body = read_up_to(input, len - BASE)?;
        if body.len() < len - BASE {
            log.drop("the file ends within an object".to_owned());
            break;
        }
        read_up_to(input, len % 4)?;
        if u32_at(&base, 12) == Some(CONTAINER) {
            match unpack(&body) {
                Ok(more) => unpacked.extend(more),
                Err(reason) => log.drop(format!("container: {reason}")),
            }
            let used = objects(&unpacked, start, bus, log);
            unpacked.drain(..used);
            if unpacked.len() > MAX_CONTAINER {
                log.drop("an object larger than any container".to_owned());
                unpacked.clear();
            }
        } else {
            let whole = [&base[..], &body[..]].concat();
            objects(&whole, start, bus, log);
        }
    }
    if unpacked.len() >= BASE {
        log.drop("the last container ends within an object".to_owned());
    }
    Ok(())
}

fn unpack(body: &[u8]) -> Result<Vec<u8>, &'static str> {
    let (Some(method), Some(packed)) = (u16_at(body, 0), body.get(16..)) else { return Err("too short") };
    match method {
        0 => Ok(packed.to_vec()),
        2 => miniz_oxide::inflate::decompress_to_vec_zlib_with_limit(packed, MAX_CONTAINER)
            .map_err(|_| "corrupt compressed data"),
        _ => Err("unknown compression"),
    }
}

/// Reads all complete objects and returns the number of bytes used. Up to three padding bytes may be between objects.
fn objects(bytes: &[u8], start: f64, bus: Option<&Bus>, log: &mut Log) -> usize {
    let mut at = 0;
    while let Some(rest) = bytes.get(at..).filter(|rest| rest.len() >= BASE) {
        if !rest.starts_with(OBJECT) {
            let skip = rest.windows(4).position(|word| word == OBJECT);
            if skip.is_none_or(|skip| skip > 3) {
                log.drop("objects that do not begin where the previous one ends".to_owned());
            }
            at += skip.unwrap_or(rest.len() - 3);
            continue;
        }
        let len = u32_at(rest, 8).unwrap_or_default() as usize;
        if len < BASE {
            log.drop("objects without a length".to_owned());
            at += 4;
            continue;
        }
        let Some(object) = rest.get(..len) else { break };
        at += len;
        if frame(object, start, bus, log).is_none() {
            log.drop("truncated frames".to_owned());
        }
    }
    at.min(bytes.len())
}

/// Adds the frame of an object; `None` if the object is too short.
fn frame(object: &[u8], start: f64, bus: Option<&Bus>, log: &mut Log) -> Option<()> {
    let kind = u32_at(object, 12)?;
    if ![CAN_MESSAGE, CAN_MESSAGE_2, CAN_FD, CAN_FD_64].contains(&kind) {
        log.pass_over("BLF object without a frame");
        return Some(());
    }
    // The unit of the time stamp is 10 us, or 1 ns with flag 2.
    let unit = if u32_at(object, 16)? == 1 { 1e-5 } else { 1e-9 };
    let ticks = u64::from_le_bytes(*object.get(24..)?.first_chunk()?);
    let body = object.get(usize::from(u16_at(object, 4)?)..)?;
    let (channel, remote, id, len, data) = match kind {
        CAN_FD => {
            (u16_at(body, 0)?, *body.get(2)? & 0x80 != 0, u32_at(body, 4)?, *body.get(14)?, body.get(20..)?)
        }
        CAN_FD_64 => {
            let remote = u32_at(body, 12)? & 0x10 != 0;
            (u16::from(*body.first()?), remote, u32_at(body, 4)?, *body.get(2)?, body.get(40..)?)
        }
        _ => {
            let len = (*body.get(3)?).min(8);
            (u16_at(body, 0)?, *body.get(2)? & 0x80 != 0, u32_at(body, 4)?, len, body.get(8..)?)
        }
    };
    if remote {
        log.pass_over("remote frame");
        return Some(());
    }
    let (bus_name, data) = (channel.to_string(), data.get(..usize::from(len))?);
    let (id, extended) = (id & 0x1FFF_FFFF, id >> 31 == 1);
    let seconds = start + unit * ticks as f64;
    add(bus, &Frame { seconds, bus: if channel <= 1 { "" } else { &bus_name }, id, extended, data }, log);
    Some(())
}

/// Returns the start of the measurement, s since 1970, in the local time of the file.
fn start_seconds(head: &[u8]) -> Option<f64> {
    let [year, month, _, day, hour, minute, second, milli] =
        std::array::from_fn(|k| u16_at(head, 32 + 2 * k).map(u32::from));
    let (year, month, day) = (i64::from(year?), i64::from(month?), i64::from(day?));
    if year < 1970 || !(1..=12).contains(&month) {
        return None;
    }
    Some(
        days_since_1970(year, month, day) * 86_400.0
            + f64::from(hour? * 3_600 + minute? * 60 + second?)
            + 1e-3 * f64::from(milli?),
    )
}

/// Returns the days from 1970-01-01 to a date of the Gregorian calendar; the year is shifted to begin in March.
fn days_since_1970(year: i64, month: i64, day: i64) -> f64 {
    let year = if month <= 2 { year - 1 } else { year };
    let month = (month + 9) % 12;
    let days = 365 * year + year / 4 - year / 100 + year / 400 + (153 * month + 2) / 5 + day - 1;
    (days - 719_468) as f64
}

fn u16_at(bytes: &[u8], at: usize) -> Option<u16> {
    bytes.get(at..)?.first_chunk().map(|bytes| u16::from_le_bytes(*bytes))
}

fn u32_at(bytes: &[u8], at: usize) -> Option<u32> {
    bytes.get(at..)?.first_chunk().map(|bytes| u32::from_le_bytes(*bytes))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn days_are_those_of_the_calendar() {
        assert_eq!(days_since_1970(1970, 1, 1), 0.0);
        assert_eq!(days_since_1970(2000, 2, 29), 11_016.0);
        assert_eq!(days_since_1970(2017, 9, 30), 17_439.0);
    }
}
