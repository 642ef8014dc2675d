//! Decodes the signals of CAN frames with a DBC file.

use super::error::ImportError;
use super::log::Log;
use super::value::Value;
use crate::wheels::dbc::invalid_code;
use can_dbc::{ByteOrder, Dbc, MessageId, MultiplexIndicator, SignalExtendedValueType, ValueType};
use std::collections::BTreeMap;
use std::path::Path;

#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Frame<'a> {
    pub(super) seconds: f64,
    /// The name of the bus; empty for the first bus.
    pub(super) bus: &'a str,
    pub(super) id: u32,
    pub(super) extended: bool,
    pub(super) data: &'a [u8],
}

/// The messages of a DBC file.
#[derive(Debug)]
pub struct Bus {
    messages: BTreeMap<(u32, bool), Vec<Signal>>,
}

#[derive(Debug)]
struct Signal {
    name: String,
    unit: String,
    number: Number,
    invalid: Option<u32>,
    /// The multiplexer and the value of it for which the frame holds the signal.
    when: Option<(Number, u64)>,
}

#[derive(Debug, Clone, Copy)]
struct Number {
    start: usize,
    bits: usize,
    order: ByteOrder,
    kind: Kind,
    factor: f64,
    offset: f64,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Kind {
    Unsigned,
    Signed,
    F32,
    F64,
}

impl Bus {
    /// Reads a DBC file.
    pub fn read(path: &Path) -> Result<Self, ImportError> {
        let name = path.display().to_string();
        let bytes = std::fs::read(path).map_err(|source| ImportError::Io { path: name.clone(), source })?;
        Self::parse(&name, &String::from_utf8_lossy(&bytes))
    }

    /// Parses the text of a DBC file.
    pub fn parse(path: &str, text: &str) -> Result<Self, ImportError> {
        let error = |reason: String| ImportError::Dbc { path: path.to_owned(), reason };
        let dbc = Dbc::try_from(text).map_err(|cause| error(cause.to_string()))?;
        let mut messages = BTreeMap::new();
        for message in &dbc.messages {
            let id = match message.id {
                MessageId::Standard(id) => (u32::from(id), false),
                MessageId::Extended(id) => (id, true),
            };
            let number = |signal: &can_dbc::Signal| number(&dbc, message.id, signal);
            let is_switch =
                |signal: &&can_dbc::Signal| signal.multiplexer_indicator == MultiplexIndicator::Multiplexor;
            let switch = message.signals.iter().find(is_switch).and_then(number);
            let signals = message.signals.iter().filter_map(|signal| {
                let when = match signal.multiplexer_indicator {
                    MultiplexIndicator::MultiplexedSignal(value) => Some((switch?, value)),
                    MultiplexIndicator::MultiplexorAndMultiplexedSignal(_) => return None,
                    _ => None,
                };
                Some(Signal {
                    name: format!("{}.{}", message.name, signal.name),
                    unit: signal.unit.clone(),
                    number: number(signal)?,
                    invalid: invalid_code(&dbc, message.id, &signal.name),
                    when,
                })
            });
            messages.insert(id, signals.collect());
        }
        Ok(Self { messages })
    }

    /// Adds the signals of a frame. The names of signals on other buses than the first end in `@` and the bus.
    fn decode(&self, frame: &Frame<'_>, log: &mut Log) {
        let Some(signals) = self.messages.get(&(frame.id, frame.extended)) else {
            return log.pass_over("CAN message that is not in the DBC file");
        };
        for Signal { name, unit, number, invalid, when } in signals {
            if let Some((switch, value)) = when
                && switch.raw(frame.data) != Some(*value)
            {
                continue;
            }
            let Some(raw) = number.raw(frame.data) else {
                log.drop(format!("{name}: outside the frame"));
                continue;
            };
            if invalid.is_some_and(|code| u64::from(code) == raw) {
                log.drop(format!("{name}: marked as not valid"));
                continue;
            }
            let channel = if frame.bus.is_empty() { name.clone() } else { format!("{name}@{}", frame.bus) };
            log.add(&channel, frame.seconds, Value::Number(number.physical(raw)));
            if !log.units.contains_key(&channel) && log.channels.contains_key(&channel) {
                log.units.insert(channel, unit.clone());
            }
        }
    }
}

/// Adds the signals of a frame, or counts the frame if there is no DBC file.
pub(super) fn add(bus: Option<&Bus>, frame: &Frame<'_>, log: &mut Log) {
    match bus {
        Some(bus) => bus.decode(frame, log),
        None => log.pass_over("CAN frame (pass --dbc FILE to decode signals)"),
    }
}

fn number(dbc: &Dbc, id: MessageId, signal: &can_dbc::Signal) -> Option<Number> {
    let float = dbc
        .signal_extended_value_type_list
        .iter()
        .find(|entry| entry.message_id == id && entry.signal_name == signal.name)
        .map(|entry| &entry.signal_extended_value_type);
    let kind = match float {
        Some(SignalExtendedValueType::IEEEfloat32Bit) => Kind::F32,
        Some(SignalExtendedValueType::IEEEdouble64bit) => Kind::F64,
        _ if signal.value_type == ValueType::Signed => Kind::Signed,
        _ => Kind::Unsigned,
    };
    let (start, bits) = (usize::try_from(signal.start_bit).ok()?, usize::try_from(signal.size).ok()?);
    // A CAN FD frame has up to 64 bytes.
    let fits = (1..=64).contains(&bits) && start < 512;
    let (order, factor, offset) = (signal.byte_order, signal.factor, signal.offset);
    fits.then_some(Number { start, bits, order, kind, factor, offset })
}

impl Number {
    /// Returns the raw value. The bits are read from the most significant on; a Motorola signal continues in the next
    /// byte's bit 7.
    fn raw(&self, data: &[u8]) -> Option<u64> {
        let mut raw = 0;
        let mut at = match self.order {
            ByteOrder::LittleEndian => self.start + self.bits - 1,
            ByteOrder::BigEndian => self.start,
        };
        for k in 0..self.bits {
            let bit = data.get(at / 8)? >> (at % 8) & 1;
            raw = raw << 1 | u64::from(bit);
            if k + 1 < self.bits {
                at = match self.order {
                    ByteOrder::LittleEndian => at - 1,
                    ByteOrder::BigEndian if at % 8 == 0 => at + 15,
                    ByteOrder::BigEndian => at - 1,
                };
            }
        }
        Some(raw)
    }

    fn physical(&self, raw: u64) -> f64 {
        let unused = 64 - self.bits;
        let value = match self.kind {
            Kind::Unsigned => raw as f64,
            Kind::Signed => ((raw << unused).cast_signed() >> unused) as f64,
            Kind::F32 => f64::from(f32::from_bits(raw as u32)),
            Kind::F64 => f64::from_bits(raw),
        };
        value * self.factor + self.offset
    }
}
