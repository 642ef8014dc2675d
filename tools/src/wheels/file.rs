//! Reads and writes wheel settings (TOML), with speeds in km/h and start bits as in DBC files.

mod frame;
mod protection;

use crate::drive::error::{DataError, read_text};
use frame::{kmh, speed};
use gyronet::can::e2e::DataIdMode;
use gyronet::can::signal::OutsideFrame;
use gyronet::can::wheel::{MAX_FRAMES, WheelConfigError, WheelReceiver, WheelSettings};
use gyronet::sample::WHEELS;
use gyronet::units::Duration;
use serde::{Deserialize, Serialize};
use std::path::Path;

#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum WheelFileError {
    #[error(transparent)]
    Toml(#[from] toml::de::Error),
    #[error("{0} frames, at most {MAX_FRAMES} are allowed")]
    Frames(usize),
    /// `extended` is true if the file declares an identifier of 29 bits.
    #[error("frame {id:#x}: not an identifier of {} bits", if *.extended { 29 } else { 11 })]
    Identifier { id: u32, extended: bool },
    #[error("{0:?} has two signals")]
    Twice(Wheel),
    #[error("{0:?} needs either factor_kmh or metres_per_pulse")]
    Scale(Wheel),
    #[error("frame {id:#x}: {source}")]
    Place { id: u32, source: OutsideFrame },
    #[error("{key} = {value}: must be {range}")]
    Range { key: &'static str, value: f64, range: String },
    #[error(transparent)]
    Settings(#[from] WheelConfigError),
}

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
    pub id: u32,
    /// True if the identifier has 29 bits.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub extended: bool,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub checksum: Option<Protection>,
    /// The position of the message counter; absent if there is none, or if it is part of an AUTOSAR profile.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub counter: Option<Counter>,
    pub signal: Vec<Signal>,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "kebab-case", deny_unknown_fields)]
pub enum Protection {
    /// SAE J1850 CRC over all other bytes.
    J1850 {
        /// Byte of the checksum, from 0.
        byte: usize,
    },
    Xor(Sum),
    Sum(Sum),
    /// AUTOSAR E2E profile 1, and 11, which sends the same bytes.
    #[serde(rename = "e2e-p01", alias = "e2e-p11")]
    P01 {
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
        data_id: u16,
    },
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Sum {
    /// Byte of the checksum, from 0.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub byte: Option<u8>,
    /// Its bits, where it is no whole byte, and the high ones, where they are elsewhere.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub low: Option<Place>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub high: Option<Place>,
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub nibbles: bool,
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub with_id: bool,
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub with_length: bool,
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub without_counter: bool,
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub negated: bool,
    pub start: u8,
    pub last_xor: u8,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Counter {
    #[serde(flatten)]
    pub low: Place,
    /// Its high bits, where they are elsewhere.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub high: Option<Place>,
}

/// A field, by default one bit, and the value of it that says something, by default 1.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Says {
    pub start_bit: u8,
    #[serde(default = "one")]
    pub bits: u8,
    #[serde(default)]
    pub order: Order,
    #[serde(default = "one")]
    pub value: u32,
}

fn one<N: From<u8>>() -> N {
    1.into()
}

#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum Raw {
    One(u32),
    List(Vec<u32>),
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Place {
    pub start_bit: u8,
    /// Number of bits, 1 to 32.
    pub bits: u8,
    pub order: Order,
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub signed: bool,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Order {
    /// Little endian (DBC `@1`).
    #[default]
    Intel,
    /// Big endian (DBC `@0`).
    Motorola,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Wheel {
    FrontLeft,
    FrontRight,
    RearLeft,
    RearRight,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Signal {
    pub wheel: Wheel,
    #[serde(flatten)]
    pub place: Place,
    /// Speed per raw count, km/h.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub factor_kmh: Option<f64>,
    /// In its place, for a signal that counts the wheel's pulses.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub metres_per_pulse: Option<f64>,
    /// Speed at raw value 0, km/h.
    #[serde(default)]
    pub offset_kmh: f64,
    /// Raw values that mean "not valid", at most three.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub invalid: Option<Raw>,
    /// Smallest and largest valid speed, km/h.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub range_kmh: Option<[f64; 2]>,
    /// The field that says that the speed is valid.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub valid_when: Option<Says>,
    /// The field that says that the wheel turns backwards.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub reverse_when: Option<Says>,
}

impl WheelFile {
    /// Reads a file with its settings; an error names the file.
    pub fn read(path: &Path) -> Result<(Self, WheelSettings), DataError> {
        let text = read_text(path)?;
        let read = Self::parse(&text).and_then(|file| file.settings().map(|settings| (file, settings)));
        read.map_err(|error| DataError::because(path.display(), error))
    }

    pub fn parse(text: &str) -> Result<Self, WheelFileError> {
        Ok(toml::from_str(text)?)
    }

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
    pub fn settings(&self) -> Result<WheelSettings, WheelFileError> {
        let found = self.frame.len();
        if found > MAX_FRAMES {
            return Err(WheelFileError::Frames(found));
        }
        let (mut frames, mut signals) = ([None; MAX_FRAMES], [None; WHEELS]);
        for ((number, place), frame) in (0..).zip(&mut frames).zip(&self.frame) {
            *place = Some(frame.settings()?);
            for signal in &frame.signal {
                let place = &mut signals[signal.wheel as usize];
                if place.is_some() {
                    return Err(WheelFileError::Twice(signal.wheel));
                }
                *place = Some(signal.settings(frame.id, number)?);
            }
        }
        let settings = WheelSettings {
            frames,
            signals,
            timeout: Duration::from_millis(self.timeout_ms),
            still_speed: speed("still_speed_kmh", self.still_speed_kmh)?,
            still_for: Duration::from_millis(self.still_for_ms),
        };
        WheelReceiver::new(settings)?;
        Ok(settings)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TOYOTA: &str = r#"
[[frame]]
id = 0xAA
signal = [
    { wheel = "front-right", start_bit = 7, bits = 16, order = "motorola", factor_kmh = 0.01, offset_kmh = -67.67, invalid = [0xFFFF, 0xFFFE] },
    { wheel = "front-left", start_bit = 23, bits = 16, order = "motorola", factor_kmh = 0.01, offset_kmh = -67.67, invalid = [0xFFFF, 0xFFFE] },
    { wheel = "rear-right", start_bit = 39, bits = 16, order = "motorola", factor_kmh = 0.01, offset_kmh = -67.67, invalid = [0xFFFF, 0xFFFE] },
    { wheel = "rear-left", start_bit = 55, bits = 16, order = "motorola", factor_kmh = 0.01, offset_kmh = -67.67, invalid = [0xFFFF, 0xFFFE] },
]
"#;

    fn error(text: &str) -> String {
        WheelFile::parse(text).and_then(|file| file.settings()).unwrap_err().to_string()
    }

    #[test]
    fn the_built_in_settings_as_a_file() {
        let settings = WheelFile::parse(TOYOTA).unwrap().settings().unwrap();
        let built_in = WheelSettings::TOYOTA.signals[0].unwrap();
        let signal = settings.signals[0].unwrap();
        assert_eq!((signal.offset, signal.factor_q16), (built_in.offset, built_in.factor_q16));
        assert_eq!(signal.invalid, [Some(0xFFFF), Some(0xFFFE), None]);
        assert_eq!(settings.still_speed.0, 1_820);
        assert_eq!((settings.timeout, settings.still_for), (Duration(100_000), Duration(500_000)));
    }

    #[test]
    fn settings_survive_the_way_over_the_file() {
        let all = r#"
[[frame]]
id = 0x386
checksum = { kind = "sum", low = { start_bit = 46, bits = 2, order = "intel" }, high = { start_bit = 62, bits = 2, order = "intel" }, nibbles = true, with_id = true, with_length = true, without_counter = true, negated = true, start = 8, last_xor = 9 }
counter = { start_bit = 14, bits = 2, order = "intel", high = { start_bit = 30, bits = 2, order = "intel" } }
signal = [
    { wheel = "front-left", start_bit = 0, bits = 14, order = "intel", factor_kmh = 0.03125, range_kmh = [0, 300], valid_when = { start_bit = 16, bits = 2, value = 0 } },
    { wheel = "front-right", start_bit = 32, bits = 14, order = "intel", metres_per_pulse = 0.02, reverse_when = { start_bit = 18 } },
]
"#;
        let settings = |text: &str| WheelFile::parse(text).unwrap().settings().unwrap();
        for first in [WheelSettings::TOYOTA, settings(all)] {
            let text = toml::to_string(&WheelFile::of(&first)).unwrap();
            assert_eq!(settings(&text), first);
            assert!(!text.contains("00000") && !text.contains("99999"), "as a person writes numbers: {text}");
        }
        let [Some(left), Some(right), ..] = settings(all).signals else { panic!() };
        assert_eq!((right.pulses, right.factor_q16), (true, (0.02_f64 * 4_294_967_296.0).round() as i32));
        let reverse = right.reverse_when.unwrap();
        assert_eq!((reverse.field.start(), reverse.field.bits(), reverse.value), (18, 1, 1));
        assert_eq!(left.valid_when.unwrap().value, 0);
    }

    #[test]
    fn a_file_may_switch_wheels_off_but_not_by_omission() {
        let settings = WheelFile::parse("frame = []").unwrap().settings().unwrap();
        assert_eq!((settings.frames, settings.signals), ([None; MAX_FRAMES], [None; WHEELS]));
        let text = toml::to_string(&WheelFile::of(&settings)).unwrap();
        assert_eq!(WheelFile::parse(&text).unwrap().settings().unwrap(), settings);
        assert!(error("timeout_ms = 100").contains("missing field `frame`"));
    }

    #[test]
    fn files_that_cannot_be_are_refused_with_the_reason() {
        let unscaled = TOYOTA.replacen("factor_kmh = 0.01, ", "", 1);
        assert!(error(&unscaled).ends_with("FrontRight needs either factor_kmh or metres_per_pulse"));
        let codes = TOYOTA.replacen("0xFFFE", "1, 2, 3", 1);
        assert!(error(&codes).ends_with("invalid = 4: must be at most three codes"));
        assert!(error("frame = 1").starts_with("TOML parse error at line 1"));
        for (from, to, said) in [
            ("start_bit = 23", "start_bit = 15", "two values overlap"),
            ("start_bit = 55", "start_bit = 63", "do not lie inside a frame"),
            ("0xAA", "0x800", "frame 0x800: not an identifier of 11 bits"),
            ("\"rear-left\"", "\"rear-right\"", "RearRight has two signals"),
            ("0.01", "0.0", "factor_kmh = 0: must be below 100 and not 0"),
            (
                "factor_kmh = 0.01",
                "metres_per_pulse = 0.5",
                "metres_per_pulse = 0.5: must be below 0.5 and not 0",
            ),
            ("[[frame]]", "still_for_ms = 0\n[[frame]]", "wheel times"),
            ("0xAA", "0xAA\nchecksum = { kind = \"crc99\", byte = 7 }", "unknown variant `crc99`"),
            // Byte 7 is part of the last signal.
            ("0xAA", "0xAA\nchecksum = { kind = \"xor\", byte = 7 }", "two values overlap"),
        ] {
            let error = error(&TOYOTA.replace(from, to));
            assert!(error.contains(said), "{error}");
        }
    }
}
