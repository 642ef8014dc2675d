//! This module reads and writes the file of wheel settings (TOML), in the conventions of a DBC file: speeds in km/h,
//! start bits as DBC files count them.

use embedded_can::{ExtendedId, Id, StandardId};
use gyronet::can::e2e::{DataIdMode, P01, P02, P05, P11, P11Mode, Profile};
use gyronet::can::signal::{BitField, ByteOrder, OutsideFrame};
use gyronet::can::wheel::{
    Checksum, MAX_FRAMES, WheelConfigError, WheelFrame, WheelReceiver, WheelSettings, WheelSignal,
};
use gyronet::sample::WHEELS;
use gyronet::units::{Duration, WheelSpeed};
use serde::{Deserialize, Serialize};

/// 1 km/h is this many speed codes.
const CODES_PER_KMH: f64 = 65_536.0 / 3.6;
/// A factor of 1 km/h is this [`WheelSignal::factor_q16`].
const FACTORS_PER_KMH: f64 = CODES_PER_KMH * 65_536.0;

/// The reason why a file of wheel settings cannot be used.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum WheelFileError {
    /// The file is not TOML, or a key or value is unknown.
    #[error("{path}: {source}")]
    Toml {
        /// The file.
        path: String,
        /// The place and the reason.
        source: Box<toml::de::Error>,
    },
    /// There are more frames than wheels.
    #[error("{path}: {found} frames, at most {MAX_FRAMES}")]
    Frames {
        /// The file.
        path: String,
        /// The number of frames.
        found: usize,
    },
    /// A frame's identifier has more bits than such identifiers have.
    #[error("{path}: frame {id:#x}: no identifier of {} bits", if *.extended { 29 } else { 11 })]
    Identifier {
        /// The file.
        path: String,
        /// The identifier.
        id: u32,
        /// Says whether the file says that it has 29 bits.
        extended: bool,
    },
    /// A wheel has two signals.
    #[error("{path}: {wheel:?} has two signals")]
    Twice {
        /// The file.
        path: String,
        /// The wheel.
        wheel: Wheel,
    },
    /// A value does not lie in a frame of eight bytes.
    #[error("{path}: frame {id:#x}: {source}")]
    Place {
        /// The file.
        path: String,
        /// The frame.
        id: u32,
        /// The reason.
        source: OutsideFrame,
    },
    /// The board's codes cannot hold a number.
    #[error("{path}: {key} = {value}: must be {range}")]
    Range {
        /// The file.
        path: String,
        /// The key.
        key: &'static str,
        /// The value.
        value: f64,
        /// The values that it can have.
        range: &'static str,
    },
    /// The library's check has failed.
    #[error("{path}: {source}")]
    Settings {
        /// The file.
        path: String,
        /// The reason.
        source: WheelConfigError,
    },
}

/// Holds the settings of a vehicle's wheel frames.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WheelFile {
    /// Time after which a speed is too old, ms.
    #[serde(default = "timeout_ms")]
    pub timeout_ms: u32,
    /// Speed up to which a wheel counts as standing, km/h.
    #[serde(default = "still_speed_kmh")]
    pub still_speed_kmh: f64,
    /// Time for which all wheels must stand, ms.
    #[serde(default = "still_for_ms")]
    pub still_for_ms: u32,
    /// The frames.
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

/// Describes a frame with wheel speeds.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Frame {
    /// Identifier.
    pub id: u32,
    /// Says whether the identifier has 29 bits.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub extended: bool,
    /// Its protection, if it has one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub checksum: Option<Protection>,
    /// Its message counter; absent if it has none or AUTOSAR's.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub counter: Option<Place>,
    /// The speeds in it.
    pub signal: Vec<Signal>,
}

/// Names the protection of a frame.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "kebab-case", deny_unknown_fields)]
pub enum Protection {
    /// SAE J1850 in one byte, over all others.
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

/// Gives the place of a value in a frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Place {
    /// Start bit, as a DBC file gives it.
    pub start_bit: u8,
    /// Number of bits, 1 to 32.
    pub bits: u8,
    /// Order of the bytes.
    pub order: Order,
    /// The value has a sign.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub signed: bool,
}

/// Order of a value's bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Order {
    /// The lowest byte first (DBC `@1`).
    Intel,
    /// The highest byte first (DBC `@0`).
    Motorola,
}

/// Names the wheel of a signal.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Wheel {
    /// Front left.
    FrontLeft,
    /// Front right.
    FrontRight,
    /// Rear left.
    RearLeft,
    /// Rear right.
    RearRight,
}

/// The speed of a wheel in a frame.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Signal {
    /// The wheel.
    pub wheel: Wheel,
    /// The place of its bits.
    #[serde(flatten)]
    pub place: Place,
    /// km/h of one bit.
    pub factor_kmh: f64,
    /// km/h at raw zero.
    #[serde(default)]
    pub offset_kmh: f64,
    /// The raw code that says "not valid".
    #[serde(skip_serializing_if = "Option::is_none")]
    pub invalid: Option<u32>,
}

impl WheelFile {
    /// Reads a file's text.
    ///
    /// # Errors
    /// [`WheelFileError::Toml`], which names the line.
    pub fn parse(path: &str, text: &str) -> Result<Self, WheelFileError> {
        toml::from_str(text)
            .map_err(|source| WheelFileError::Toml { path: path.to_owned(), source: Box::new(source) })
    }

    /// Returns the file of settings, as a board has them.
    #[must_use]
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

    /// Returns the settings of the board, checked as the board checks them.
    ///
    /// # Errors
    /// [`WheelFileError`].
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

/// The library's factor; below 100 km/h for one bit, and such that the code is not zero.
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

    /// This file has the content of [`WheelSettings::TOYOTA`].
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
        // One rounds and the other truncates: 0.00006 km/h.
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
    fn files_that_cannot_be_are_refused_with_the_reason() {
        assert!(error("frame = 1").starts_with("car.toml: TOML parse error at line 1"));
        assert!(error(&TOYOTA.replace("start_bit = 23", "start_bit = 15")).ends_with("two values overlap"));
        assert!(
            error(&TOYOTA.replace("start_bit = 55", "start_bit = 63")).contains("do not lie inside a frame")
        );
        assert!(error(&TOYOTA.replace("0xAA", "0x800")).ends_with("frame 0x800: no identifier of 11 bits"));
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
        // The last signal lies in byte 7.
        assert!(error(&checksum("xor")).ends_with("two values overlap"));
    }
}
