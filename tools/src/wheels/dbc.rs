//! Creates wheel settings from a DBC file and the names of the signals that carry the speeds.
//!
//! A DBC file has the position, factor, offset and unit of a signal. It has no standard way to describe the
//! protection of a frame, so the user must add checksum and counter to the settings.

use super::file::{Frame, Order, Place, Signal, Wheel, WheelFile};
use can_dbc::{ByteOrder, Dbc, MessageId, MultiplexIndicator, ValueDescription, ValueType};

/// Units by their names in DBC files, in lower case, and their values in km/h.
const UNITS: [(&str, f64); 7] = [
    ("km/h", 1.0),
    ("kph", 1.0),
    ("kmh", 1.0),
    ("km/hr", 1.0),
    ("m/s", 3.6),
    ("mph", 1.609_344),
    ("mi/h", 1.609_344),
];
/// Descriptions with which DBC files mark an invalid code, in lower case.
const INVALID: [&str; 5] = ["invalid", "not available", "not valid", "sna", "signal not available"];

/// The reason why a DBC file, or a name in it, cannot be used.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum DbcError {
    /// The file is not a DBC file.
    #[error("{path}: not a valid DBC file: {reason}")]
    Format {
        /// The file.
        path: String,
        /// The parser's reason.
        reason: String,
    },
    /// No signal has this name.
    #[error("{path}: no signal {name}{}", near(.similar))]
    Missing {
        /// The file.
        path: String,
        name: String,
        /// Signals in the file with a similar name.
        similar: Vec<String>,
    },
    /// Several messages have a signal of this name.
    #[error("{path}: {name} is in {}: name one as MESSAGE.SIGNAL", .messages.join(", "))]
    Ambiguous {
        /// The file.
        path: String,
        name: String,
        messages: Vec<String>,
    },
    /// The signal is not a plain number in a frame of eight bytes.
    #[error("{path}: {name}: {reason}")]
    Kind {
        /// The file.
        path: String,
        name: String,
        /// The reason why it cannot be used.
        reason: String,
    },
}

fn near(similar: &[String]) -> String {
    if similar.is_empty() { String::new() } else { format!("; there are {}", similar.join(", ")) }
}

/// Names of the signals, SIGNAL or MESSAGE.SIGNAL, by wheel: front left, front right, rear left, rear right.
pub type Signals<'a> = [Option<&'a str>; 4];

pub fn from_dbc(path: &str, text: &str, signals: Signals<'_>) -> Result<WheelFile, DbcError> {
    let dbc = Dbc::try_from(text)
        .map_err(|error| DbcError::Format { path: path.to_owned(), reason: error.to_string() })?;
    let mut frame: Vec<Frame> = Vec::new();
    let wheels = [Wheel::FrontLeft, Wheel::FrontRight, Wheel::RearLeft, Wheel::RearRight];
    for (wheel, name) in wheels.into_iter().zip(signals) {
        let Some(name) = name else { continue };
        let (id, signal) = find(path, &dbc, wheel, name)?;
        let (id, extended) = match id {
            MessageId::Standard(id) => (u32::from(id), false),
            MessageId::Extended(id) => (id, true),
        };
        match frame.iter_mut().find(|frame| (frame.id, frame.extended) == (id, extended)) {
            Some(frame) => frame.signal.push(signal),
            None => frame.push(Frame { id, extended, checksum: None, counter: None, signal: vec![signal] }),
        }
    }
    let WheelFile { timeout_ms, still_speed_kmh, still_for_ms, .. } =
        WheelFile::parse(path, "frame = []").expect("the defaults of the file");
    Ok(WheelFile { timeout_ms, still_speed_kmh, still_for_ms, frame })
}

fn find(path: &str, dbc: &Dbc, wheel: Wheel, name: &str) -> Result<(MessageId, Signal), DbcError> {
    let (message_name, signal_name) = match name.split_once('.') {
        Some((message, signal)) => (Some(message), signal),
        None => (None, name),
    };
    let all = || dbc.messages.iter().flat_map(|message| message.signals.iter().map(move |s| (message, s)));
    let found: Vec<_> = all()
        .filter(|(message, signal)| {
            signal.name == signal_name && message_name.is_none_or(|name| message.name == name)
        })
        .collect();
    let path = path.to_owned();
    let name = name.to_owned();
    let (message, signal) = match found[..] {
        [one] => one,
        [] => {
            let part = |other: &str| {
                let (other, name) = (other.to_lowercase(), signal_name.to_lowercase());
                other.contains(&name)
                    || name.contains(&other)
                    || other.contains("whl")
                    || other.contains("wheel")
            };
            let similar = all().filter(|(_, signal)| part(&signal.name));
            let similar =
                similar.take(8).map(|(message, s)| format!("{}.{}", message.name, s.name)).collect();
            return Err(DbcError::Missing { path, name, similar });
        }
        _ => {
            let messages = found.iter().map(|(message, _)| message.name.clone()).collect();
            return Err(DbcError::Ambiguous { path, name, messages });
        }
    };
    let refuse =
        |reason: &str| DbcError::Kind { path: path.clone(), name: name.clone(), reason: reason.to_owned() };
    if signal.multiplexer_indicator != MultiplexIndicator::Plain {
        return Err(refuse("is multiplexed"));
    }
    let is_float = dbc
        .signal_extended_value_type_list
        .iter()
        .any(|list| list.message_id == message.id && list.signal_name == signal.name);
    if is_float {
        return Err(refuse("is a floating-point number"));
    }
    let unit = signal.unit.trim().to_lowercase();
    let unit = UNITS.iter().find(|(known, _)| *known == unit);
    let Some((_, kmh)) = unit else {
        return Err(refuse(&format!("has the unit {:?}, not km/h, m/s or mph", signal.unit)));
    };
    let (Ok(start_bit), Ok(bits)) = (u8::try_from(signal.start_bit), u8::try_from(signal.size)) else {
        return Err(refuse("is outside eight bytes"));
    };
    let place = Place {
        start_bit,
        bits,
        order: match signal.byte_order {
            ByteOrder::LittleEndian => Order::Intel,
            ByteOrder::BigEndian => Order::Motorola,
        },
        signed: signal.value_type == ValueType::Signed,
    };
    let invalid = invalid_code(dbc, message.id, &signal.name);
    let signal =
        Signal { wheel, place, factor_kmh: signal.factor * kmh, offset_kmh: signal.offset * kmh, invalid };
    Ok((message.id, signal))
}

/// Returns the raw code that the file describes as invalid.
pub(crate) fn invalid_code(dbc: &Dbc, id: MessageId, signal: &str) -> Option<u32> {
    let descriptions = dbc.value_descriptions.iter().find_map(|description| match description {
        ValueDescription::Signal { message_id, name, value_descriptions }
            if *message_id == id && name == signal =>
        {
            Some(value_descriptions)
        }
        _ => None,
    })?;
    let is_invalid = |text: &str| INVALID.contains(&text.trim().to_lowercase().as_str());
    let code = descriptions.iter().find(|value| is_invalid(&value.description))?.id;
    u32::try_from(code).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    const DBC: &str = r#"VERSION ""
NS_ :
BS_:
BU_: ABS
BO_ 1200 WheelsFront: 8 ABS
 SG_ WhlFL : 0|14@1+ (0.05625,0) [0|921.5] "km/h" ABS
 SG_ WhlFR : 16|14@1+ (0.05625,0) [0|921.5] "km/h" ABS
 SG_ Mux M : 40|2@1+ (1,0) [0|3] "" ABS
 SG_ Deep m1 : 48|8@1+ (1,0) [0|255] "km/h" ABS
BO_ 2566844926 WheelsRear: 8 ABS
 SG_ WhlRL : 7|16@0- (0.01,-100) [0|555] "m/s" ABS
 SG_ WhlRR : 23|16@0- (0.01,-100) [0|555] "m/s" ABS
 SG_ Temp : 40|8@1+ (1,-40) [-40|215] "degC" ABS
BO_ 700 Other: 8 ABS
 SG_ WhlFL : 0|8@1+ (1,0) [0|255] "km/h" ABS
VAL_ 1200 WhlFR 16383 "SNA" 0 "stands" ;
"#;

    #[test]
    fn four_signals_become_two_frames() {
        let signals = [Some("WheelsFront.WhlFL"), Some("WhlFR"), Some("WhlRL"), Some("WhlRR")];
        let file = from_dbc("car.dbc", DBC, signals).unwrap();
        let settings = file.settings("car.dbc").unwrap();
        let ids: Vec<_> = file.frame.iter().map(|frame| (frame.id, frame.extended)).collect();
        assert_eq!(ids, [(1200, false), (0x18FE_F1FE, true)]);
        let [left, right] = &file.frame[0].signal[..] else { panic!("two") };
        assert_eq!((left.factor_kmh, left.invalid, right.invalid), (0.05625, None, Some(16_383)));
        let rear = &file.frame[1].signal[0];
        assert!((rear.factor_kmh - 0.036).abs() < 1e-12 && rear.offset_kmh == -360.0, "{rear:?}");
        assert_eq!((rear.place.order, rear.place.signed), (Order::Motorola, true));
        assert_eq!(settings.frames.iter().flatten().count(), 2);
        // The file survives a round trip.
        let text = toml::to_string(&file).unwrap();
        assert_eq!(WheelFile::parse("car.toml", &text).unwrap(), file);
    }

    #[test]
    fn names_that_do_not_fit_are_refused_with_the_reason() {
        let error = |front_left| from_dbc("car.dbc", DBC, [Some(front_left), None, None, None]).unwrap_err();
        assert!(error("WhlFL").to_string().contains("WheelsFront, Other: name one as MESSAGE.SIGNAL"));
        assert!(error("WhlXY").to_string().contains("; there are WheelsFront.WhlFL"));
        assert!(error("Deep").to_string().ends_with("is multiplexed"));
        assert!(error("Temp").to_string().contains("the unit \"degC\""));
        let no_dbc = from_dbc("car.dbc", "wheels!", [None; 4]).unwrap_err();
        assert!(no_dbc.to_string().starts_with("car.dbc: not a valid DBC file: "), "{no_dbc}");
    }
}
