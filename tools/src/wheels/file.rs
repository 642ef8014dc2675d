//! Reads and writes wheel settings (TOML), with speeds in km/h and start bits as in DBC files.

use embedded_can::{ExtendedId, Id, StandardId};
use gyronet::can::e2e::{DataIdMode, P01, P02, P05, P11, P11Mode, Profile};
use gyronet::can::signal::{BitField, ByteOrder, OutsideFrame};
use gyronet::can::wheel::{
    Checksum, MAX_FRAMES, WheelConfigError, WheelFrame, WheelReceiver, WheelSettings, WheelSignal,
};
use gyronet::sample::WHEELS;
use gyronet::units::{Duration, WheelSpeed};
use serde::{Deserialize, Serialize};

/// Speed codes per km/h.
const CODES_PER_KMH: f64 = 65_536.0 / 3.6;
/// [`WheelSignal::factor_q16`] of a factor of 1 km/h.
const FACTORS_PER_KMH: f64 = CODES_PER_KMH * 65_536.0;

/// The reason why a wheel settings file cannot be used.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum WheelFileError {
    /// The file is not TOML, or a key or value is unknown.
    #[error("{path}: {source}")]
    Toml {
        path: String,
        /// The place and the reason.
        source: Box<toml::de::Error>,
    },
    /// The file has too many frames.
    #[error("{path}: {found} frames, at most {MAX_FRAMES} are allowed")]
    Frames { path: String, found: usize },
    /// The identifier of a frame is too large.
    #[error("{path}: frame {id:#x}: not an identifier of {} bits", if *.extended { 29 } else { 11 })]
    Identifier {
        path: String,
        id: u32,
        /// True if the file declares an identifier of 29 bits.
        extended: bool,
    },
    /// A wheel has two signals.
    #[error("{path}: {wheel:?} has two signals")]
    Twice { path: String, wheel: Wheel },
    /// A value is outside a frame of eight bytes.
    #[error("{path}: frame {id:#x}: {source}")]
    Place { path: String, id: u32, source: OutsideFrame },
    /// A number is out of the range of the board's codes.
    #[error("{path}: {key} = {value}: must be {range}")]
    Range {
        path: String,
        key: &'static str,
        value: f64,
        /// The allowed values.
        range: &'static str,
    },
    /// The library rejects the settings.
    #[error("{path}: {source}")]
    Settings { path: String, source: WheelConfigError },
}

/// The settings of a vehicle's wheel frames.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WheelFile {
    /// Age after which a speed is stale, ms.
    #[serde(default = "timeout_ms")]
    pub timeout_ms: u32,
    /// Largest speed of a standing wheel, km/h.
    #[serde(default = "still_speed_kmh")]
    pub still_speed_kmh: f64,
    /// Time for which all wheels must stand before the vehicle counts as standing, ms.
    #[serde(default = "still_for_ms")]
    pub still_for_ms: u32,
    /// The frames; `frame = []` for a vehicle without wheel speeds on its bus.
    pub frame: Vec<Frame>,
}

const fn timeout_ms() -> u32 {
    100
}

const fn still_speed_kmh() -> f64 {
    0.1
}

const fn still_for_ms() -> u32 {
    500
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Frame {
    /// CAN identifier.
    pub id: u32,
    /// True if the identifier has 29 bits.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub extended: bool,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub checksum: Option<Protection>,
    /// The position of the message counter; absent if there is none, or if it is part of an AUTOSAR profile.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub counter: Option<Place>,
    pub signal: Vec<Signal>,
}

/// The protection of a frame.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "kebab-case", deny_unknown_fields)]
pub enum Protection {
    /// SAE J1850 CRC over all other bytes.
    J1850 {
        /// Byte of the checksum, from 0.
        byte: usize,
    },
    /// Exclusive or of all other bytes.
    Xor {
        /// Byte of the checksum, from 0.
        byte: usize,
    },
    /// Sum of all other bytes, modulo 256.
    Sum {
        /// Byte of the checksum, from 0.
        byte: usize,
    },
    /// AUTOSAR E2E profile 1.
    #[serde(rename = "e2e-p01")]
    P01 {
        /// Identifier of the data.
        data_id: u16,
        /// The bytes of the identifier that enter the checksum.
        mode: DataIdMode,
    },
    /// AUTOSAR E2E profile 2.
    #[serde(rename = "e2e-p02")]
    P02 {
        /// Identifier for each counter.
        data_ids: [u8; 16],
    },
    /// AUTOSAR E2E profile 5.
    #[serde(rename = "e2e-p05")]
    P05 {
        /// Identifier of the data.
        data_id: u16,
    },
    /// AUTOSAR E2E profile 11.
    #[serde(rename = "e2e-p11")]
    P11 {
        /// Identifier of the data.
        data_id: u16,
        /// The bytes of the identifier that enter the checksum.
        mode: P11Mode,
    },
}

/// The position of a value in a frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Place {
    pub start_bit: u8,
    /// Number of bits, 1 to 32.
    pub bits: u8,
    /// Order of the bytes.
    pub order: Order,
    /// True if the value is signed.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub signed: bool,
}

/// The byte order of a value.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Order {
    /// Little endian (DBC `@1`).
    Intel,
    /// Big endian (DBC `@0`).
    Motorola,
}

/// The wheel of a signal.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Wheel {
    FrontLeft,
    FrontRight,
    RearLeft,
    RearRight,
}

/// The speed of a wheel in a frame.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Signal {
    pub wheel: Wheel,
    /// The position of the speed in the frame.
    #[serde(flatten)]
    pub place: Place,
    /// Speed per raw count, km/h.
    pub factor_kmh: f64,
    /// Speed at raw value 0, km/h.
    #[serde(default)]
    pub offset_kmh: f64,
    /// The raw value that means "not valid".
    #[serde(skip_serializing_if = "Option::is_none")]
    pub invalid: Option<u32>,
}

impl WheelFile {
    pub fn parse(path: &str, text: &str) -> Result<Self, WheelFileError> {
        toml::from_str(text)
            .map_err(|source| WheelFileError::Toml { path: path.to_owned(), source: Box::new(source) })
    }

    /// Creates the file contents from a board's settings.
    pub fn of(settings: &WheelSettings) -> Self {
        let frames = (0..).zip(&settings.frames);
        let frames = frames.filter_map(|(k, frame)| Some(Frame::of(settings, k, frame.as_ref()?)));
        let millis = |Duration(micros)| u32::try_from(micros / 1_000).unwrap_or(u32::MAX);
        Self {
            timeout_ms: millis(settings.timeout),
            still_speed_kmh: kmh(settings.still_speed),
            still_for_ms: millis(settings.still_for),
            frame: frames.collect(),
        }
    }

    /// Converts to the board's settings, with the checks of the board.
    pub fn settings(&self, path: &str) -> Result<WheelSettings, WheelFileError> {
        let found = self.frame.len();
        if found > MAX_FRAMES {
            return Err(WheelFileError::Frames { path: path.to_owned(), found });
        }
        let (mut frames, mut signals) = ([None; MAX_FRAMES], [None; WHEELS]);
        for ((number, place), frame) in (0..).zip(&mut frames).zip(&self.frame) {
            *place = Some(frame.settings(path)?);
            for signal in &frame.signal {
                let place = &mut signals[signal.wheel as usize];
                if place.is_some() {
                    return Err(WheelFileError::Twice { path: path.to_owned(), wheel: signal.wheel });
                }
                *place = Some(signal.settings(path, frame.id, number)?);
            }
        }
        let settings = WheelSettings {
            frames,
            signals,
            timeout: Duration::from_millis(self.timeout_ms),
            still_speed: speed(path, "still_speed_kmh", self.still_speed_kmh)?,
            still_for: Duration::from_millis(self.still_for_ms),
        };
        match WheelReceiver::new(settings) {
            Ok(_) => Ok(settings),
            Err(source) => Err(WheelFileError::Settings { path: path.to_owned(), source }),
        }
    }
}

impl Frame {
    fn of(settings: &WheelSettings, number: u8, frame: &WheelFrame) -> Self {
        let wheels = [Wheel::FrontLeft, Wheel::FrontRight, Wheel::RearLeft, Wheel::RearRight];
        let signals = wheels.into_iter().zip(settings.signals);
        let own = signals.filter_map(|(wheel, signal)| Some((wheel, signal?)));
        let own = own.filter(|(_, signal)| signal.frame == number);
        let (id, extended) = match frame.id {
            Id::Standard(id) => (id.as_raw().into(), false),
            Id::Extended(id) => (id.as_raw(), true),
        };
        Self {
            id,
            extended,
            checksum: Protection::of(frame.checksum),
            counter: frame.counter.as_ref().map(Place::of),
            signal: own.map(|(wheel, signal)| Signal::of(wheel, &signal)).collect(),
        }
    }

    fn settings(&self, path: &str) -> Result<WheelFrame, WheelFileError> {
        let Self { id, extended, .. } = *self;
        let identifier = if extended {
            ExtendedId::new(id).map(Id::Extended)
        } else {
            u16::try_from(id).ok().and_then(StandardId::new).map(Id::Standard)
        };
        let place = |source| WheelFileError::Place { path: path.to_owned(), id, source };
        Ok(WheelFrame {
            id: identifier.ok_or_else(|| WheelFileError::Identifier {
                path: path.to_owned(),
                id,
                extended,
            })?,
            counter: self.counter.map(|counter| counter.field()).transpose().map_err(place)?,
            checksum: self.checksum.as_ref().map_or(Checksum::None, Protection::checksum),
        })
    }
}

impl Signal {
    fn settings(&self, path: &str, id: u32, frame: u8) -> Result<WheelSignal, WheelFileError> {
        let place = |source| WheelFileError::Place { path: path.to_owned(), id, source };
        Ok(WheelSignal {
            frame,
            field: self.place.field().map_err(place)?,
            factor_q16: factor(path, self.factor_kmh)?,
            offset: speed(path, "offset_kmh", self.offset_kmh)?,
            invalid: self.invalid,
        })
    }

    fn of(wheel: Wheel, signal: &WheelSignal) -> Self {
        Self {
            wheel,
            place: Place::of(&signal.field),
            factor_kmh: f64::from(signal.factor_q16) / FACTORS_PER_KMH,
            offset_kmh: kmh(signal.offset),
            invalid: signal.invalid,
        }
    }
}

impl Place {
    fn of(field: &BitField) -> Self {
        let order = match field.order() {
            ByteOrder::Intel => Order::Intel,
            ByteOrder::Motorola => Order::Motorola,
        };
        Self { start_bit: field.start(), bits: field.bits(), order, signed: field.is_signed() }
    }

    fn field(&self) -> Result<BitField, OutsideFrame> {
        let order = match self.order {
            Order::Intel => ByteOrder::Intel,
            Order::Motorola => ByteOrder::Motorola,
        };
        BitField::new(self.start_bit, self.bits, order, self.signed)
    }
}

impl Protection {
    fn of(checksum: Checksum) -> Option<Self> {
        Some(match checksum {
            Checksum::None => return None,
            Checksum::J1850 { at } => Self::J1850 { byte: at },
            Checksum::Xor { at } => Self::Xor { byte: at },
            Checksum::Sum { at } => Self::Sum { byte: at },
            Checksum::E2e(Profile::P01(P01 { data_id, mode })) => Self::P01 { data_id, mode },
            Checksum::E2e(Profile::P02(P02 { data_ids })) => Self::P02 { data_ids },
            Checksum::E2e(Profile::P05(P05 { data_id })) => Self::P05 { data_id },
            Checksum::E2e(Profile::P11(P11 { data_id, mode })) => Self::P11 { data_id, mode },
        })
    }

    fn checksum(&self) -> Checksum {
        match *self {
            Self::J1850 { byte } => Checksum::J1850 { at: byte },
            Self::Xor { byte } => Checksum::Xor { at: byte },
            Self::Sum { byte } => Checksum::Sum { at: byte },
            Self::P01 { data_id, mode } => Checksum::E2e(Profile::P01(P01 { data_id, mode })),
            Self::P02 { data_ids } => Checksum::E2e(Profile::P02(P02 { data_ids })),
            Self::P05 { data_id } => Checksum::E2e(Profile::P05(P05 { data_id })),
            Self::P11 { data_id, mode } => Checksum::E2e(Profile::P11(P11 { data_id, mode })),
        }
    }
}

/// Converts a factor to the library's code. It must be below 100 km/h, and its code must not be zero.
fn factor(path: &str, kmh: f64) -> Result<i32, WheelFileError> {
    let code = (kmh * FACTORS_PER_KMH).round() as i32;
    if kmh.abs() < 100.0 && code != 0 {
        return Ok(code);
    }
    let range = "below 100 and not 0";
    Err(WheelFileError::Range { path: path.to_owned(), key: "factor_kmh", value: kmh, range })
}

fn kmh(speed: WheelSpeed) -> f64 {
    f64::from(speed.0) / CODES_PER_KMH
}

fn speed(path: &str, key: &'static str, kmh: f64) -> Result<WheelSpeed, WheelFileError> {
    if kmh.abs() < 1e4 {
        return Ok(WheelSpeed((kmh * CODES_PER_KMH).round() as i32));
    }
    Err(WheelFileError::Range { path: path.to_owned(), key, value: kmh, range: "within 10000" })
}

#[cfg(test)]
mod tests {
    use super::*;

    const TOYOTA: &str = r#"
[[frame]]
id = 0xAA
signal = [
    { wheel = "front-right", start_bit = 7, bits = 16, order = "motorola", factor_kmh = 0.01, offset_kmh = -67.67, invalid = 0xFFFF },
    { wheel = "front-left", start_bit = 23, bits = 16, order = "motorola", factor_kmh = 0.01, offset_kmh = -67.67, invalid = 0xFFFF },
    { wheel = "rear-right", start_bit = 39, bits = 16, order = "motorola", factor_kmh = 0.01, offset_kmh = -67.67, invalid = 0xFFFF },
    { wheel = "rear-left", start_bit = 55, bits = 16, order = "motorola", factor_kmh = 0.01, offset_kmh = -67.67, invalid = 0xFFFF },
]
"#;

    fn error(text: &str) -> String {
        let settings = WheelFile::parse("car.toml", text).and_then(|file| file.settings("car.toml"));
        settings.unwrap_err().to_string()
    }

    #[test]
    fn the_built_in_settings_as_a_file() {
        let settings = WheelFile::parse("car.toml", TOYOTA).unwrap().settings("car.toml").unwrap();
        let offset = |settings: &WheelSettings| settings.signals[0].unwrap().offset.0;
        // The file's offset is rounded and the constant truncated: they differ by 0.00006 km/h.
        assert_eq!(offset(&settings), offset(&WheelSettings::TOYOTA) - 1);
        assert_eq!(settings.still_speed, WheelSpeed(1_820));
        assert_eq!((settings.timeout, settings.still_for), (Duration(100_000), Duration(500_000)));
    }

    #[test]
    fn settings_survive_the_way_over_the_file() {
        let file = WheelFile::of(&WheelSettings::TOYOTA);
        let text = toml::to_string(&file).unwrap();
        let again = WheelFile::parse("car.toml", &text).unwrap().settings("car.toml").unwrap();
        assert_eq!(again, WheelSettings::TOYOTA);
    }

    #[test]
    fn a_file_may_switch_wheels_off_but_not_by_omission() {
        let settings = WheelFile::parse("none.toml", "frame = []").unwrap().settings("none.toml").unwrap();
        assert_eq!((settings.frames, settings.signals), ([None; MAX_FRAMES], [None; WHEELS]));
        let text = toml::to_string(&WheelFile::of(&settings)).unwrap();
        assert_eq!(WheelFile::parse("none.toml", &text).unwrap().settings("none.toml").unwrap(), settings);
        assert!(error("timeout_ms = 100").contains("missing field `frame`"));
    }

    #[test]
    fn files_that_cannot_be_are_refused_with_the_reason() {
        assert!(error("frame = 1").starts_with("car.toml: TOML parse error at line 1"));
        assert!(error(&TOYOTA.replace("start_bit = 23", "start_bit = 15")).ends_with("two values overlap"));
        assert!(
            error(&TOYOTA.replace("start_bit = 55", "start_bit = 63")).contains("do not lie inside a frame")
        );
        assert!(
            error(&TOYOTA.replace("0xAA", "0x800")).ends_with("frame 0x800: not an identifier of 11 bits")
        );
        assert!(
            error(&TOYOTA.replace("\"rear-left\"", "\"rear-right\"")).ends_with("RearRight has two signals")
        );
        assert!(
            error(&TOYOTA.replace("0.01", "0.0")).contains("factor_kmh = 0: must be below 100 and not 0")
        );
        assert!(error(&TOYOTA.replace("[[frame]]", "still_for_ms = 0\n[[frame]]")).contains("wheel times"));
        let checksum = |kind: &str| {
            TOYOTA.replace("id = 0xAA", &format!("id = 0xAA\nchecksum = {{ kind = \"{kind}\", byte = 7 }}"))
        };
        assert!(error(&checksum("crc99")).contains("unknown variant `crc99`"));
        // Byte 7 is part of the last signal.
        assert!(error(&checksum("xor")).ends_with("two values overlap"));
    }
}
