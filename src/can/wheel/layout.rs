//! A layout describes the positions of wheel speeds in a frame, what the frame says of them, and its protection.

use crate::can::e2e::{Fault, Profile};
use crate::can::signal::BitField;
use crate::can::{bosch, identifier};
use crate::units::{Micros, WheelSpeed};
use embedded_can::Id;

/// A value of a field that says something: that a speed is valid, that a wheel turns backwards.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Code {
    /// Position of the field.
    pub field: BitField,
    /// The value that says it.
    pub value: u32,
}

/// The position and scale of one wheel's speed in a frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct WheelSignal {
    /// Index of the frame that carries the speed, in [`WheelSettings::frames`](super::WheelSettings::frames).
    pub frame: u8,
    /// Position of the raw value in the frame.
    pub field: BitField,
    /// Speed codes (2^-16 m/s) per LSB, times 2^16: see [`WheelSignal::per_bit_kmh`]. Of pulses, 2^-32 m each.
    pub factor_q16: i32,
    /// Speed at raw value zero.
    pub offset: WheelSpeed,
    /// The raw value counts pulses of the wheel, and wraps.
    pub pulses: bool,
    /// Raw values that mean "not valid".
    pub invalid: [Option<u32>; 3],
    /// Smallest and largest valid speed; [`MAX_SPEED`] either way where none is stated.
    pub range: Option<[WheelSpeed; 2]>,
    /// The code with which the speed is valid; always, where there is none.
    pub valid_when: Option<Code>,
    /// The code with which the wheel turns backwards, and the speed is positive all the same.
    pub reverse_when: Option<Code>,
}

/// A wheel of a vehicle is never faster than 400 km/h.
pub const MAX_SPEED: WheelSpeed = WheelSpeed((400.0 / 3.6 * 65_536.0) as i32);

impl WheelSignal {
    /// Creates a signal of a speed that is always valid.
    pub const fn new(frame: u8, field: BitField, factor_q16: i32) -> Self {
        let (pulses, invalid, range) = (false, [None; 3], None);
        let [valid_when, reverse_when] = [None; 2];
        let offset = WheelSpeed(0);
        Self { frame, field, factor_q16, offset, pulses, invalid, range, valid_when, reverse_when }
    }

    /// Converts a DBC factor in km/h per LSB, below 1000, to [`WheelSignal::factor_q16`].
    pub const fn per_bit_kmh(factor: f64) -> i32 {
        nearest(factor / 3.6 * 4_294_967_296.0)
    }

    /// Returns the speed, or with [`WheelSignal::pulses`] the speed by the pulses that `count` has seen, if any.
    pub(super) fn speed(
        &self,
        wheel: usize,
        data: &[u8],
        now: Micros,
        count: &mut Option<Pulses>,
    ) -> Result<Option<WheelSpeed>, WheelError> {
        let (short, invalid) = (WheelError::Short(data.len()), WheelError::Invalid { wheel });
        let says = |code: Option<Code>| {
            code.map(|code| code.field.raw(data).map(|raw| raw == code.value).ok_or(short)).transpose()
        };
        let raw = self.field.raw(data).ok_or(short)?;
        if says(self.valid_when)? == Some(false) || self.invalid.contains(&Some(raw)) {
            *count = None;
            return Err(invalid);
        }
        let code = if self.pulses {
            let Some(speed) = Pulses::add(count, raw, self, now) else { return Ok(None) };
            speed
        } else {
            // The product is at most 2^32 x 2^31.
            let value = self.field.extended(raw);
            ((value * i64::from(self.factor_q16) + (1 << 15)) >> 16) + i64::from(self.offset.0)
        };
        let code = if says(self.reverse_when)? == Some(true) { -code } else { code };
        let [least, most] = self.range.unwrap_or([WheelSpeed(-MAX_SPEED.0), MAX_SPEED]);
        if code < least.0.into() || code > most.0.into() {
            return Err(invalid);
        }
        Ok(i32::try_from(code).ok().map(WheelSpeed))
    }
}

/// Pulses are counted over this time at least: one pulse in a frame of 10 ms would be metres a second.
const PULSES_US: u64 = 100_000;
/// After this time the number of wraps is unknown.
const WRAPS_US: u64 = 1_000_000;

#[derive(Debug, Clone, Copy)]
pub(super) struct Pulses {
    raw: u32,
    at: Micros,
    speed: Option<i64>,
}

impl Pulses {
    fn add(count: &mut Option<Self>, raw: u32, signal: &WheelSignal, now: Micros) -> Option<i64> {
        let known = count.get_or_insert(Self { raw, at: now, speed: None });
        let elapsed = now.0.saturating_sub(known.at.0);
        if elapsed >= WRAPS_US {
            *known = Self { raw, at: now, speed: None };
        } else if elapsed >= PULSES_US {
            let turned = raw.wrapping_sub(known.raw) & (u32::MAX >> (32 - signal.field.bits()));
            // Below 2^32 x 2^31 / 2^16 x 10.
            let length = (i64::from(turned) * i64::from(signal.factor_q16)) >> 16;
            let speed = length.saturating_mul(1_000) / (elapsed / 1_000) as i64;
            *known = Self { raw, at: now, speed: Some(speed) };
        }
        known.speed
    }
}

/// A number in one or two parts of a frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Parts {
    /// The low bits.
    pub low: BitField,
    /// The high bits, where they are elsewhere.
    pub high: Option<BitField>,
}

impl From<BitField> for Parts {
    fn from(low: BitField) -> Self {
        Self { low, high: None }
    }
}

impl Parts {
    /// Returns the number of bits.
    pub fn bits(&self) -> u8 {
        self.low.bits() + self.high.map_or(0, |high| high.bits())
    }

    pub(super) fn mask(&self) -> u64 {
        self.low.mask() | self.high.map_or(0, |high| high.mask())
    }

    fn raw(&self, data: &[u8]) -> Option<u32> {
        let low = self.low.raw(data)?;
        let Some(high) = self.high else { return Some(low) };
        high.raw(data)?.checked_shl(self.low.bits().into()).map(|high| high | low)
    }
}

/// A sum of a frame's bytes as its checksum, as cars have it: `start` plus or less the sum, exclusive or `last`, as many
/// low bits as the field has. The checksum's own bits count as zero.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct ByteSum {
    /// Position of the checksum, at most 8 bits.
    pub field: Parts,
    /// Exclusive or in place of the sum.
    pub xor: bool,
    /// Half bytes are summed.
    pub nibbles: bool,
    /// The bytes of the identifier are summed, too.
    pub with_id: bool,
    /// The number of bytes is summed, too.
    pub with_length: bool,
    /// The counter's bits count as zero.
    pub without_counter: bool,
    /// The sum is subtracted.
    pub negated: bool,
    /// Value before the first byte.
    pub start: u8,
    /// Exclusive or with the result.
    pub last: u8,
}

impl ByteSum {
    /// Creates a plain sum of all other bytes.
    pub const fn new(field: Parts) -> Self {
        let [xor, nibbles, with_id, with_length, without_counter, negated] = [false; 6];
        let (start, last) = (0, 0);
        Self { field, xor, nibbles, with_id, with_length, without_counter, negated, start, last }
    }

    fn of(&self, frame: &WheelFrame, data: &[u8]) -> u8 {
        let counter = frame.counter.filter(|_| self.without_counter).map_or(0, |counter| counter.mask());
        let cleared = (self.field.mask() | counter).to_le_bytes();
        let own = data.iter().zip(cleared).map(|(byte, cleared)| byte & !cleared);
        let id = if self.with_id { identifier::raw(frame.id).to_be_bytes() } else { [0; 4] };
        let length = if self.with_length { data.len() as u8 } else { 0 };
        let sum = own.chain(id).chain([length]).fold(0_u8, |sum, byte| {
            let byte = if self.nibbles { (byte & 0xF) + (byte >> 4) } else { byte };
            if self.xor { sum ^ byte } else { sum.wrapping_add(byte) }
        });
        let sum = if self.negated { sum.wrapping_neg() } else { sum };
        self.start.wrapping_add(sum) ^ self.last
    }
}

/// The protection of a wheel frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Checksum {
    /// The frame is not protected.
    None,
    /// SAE J1850 CRC in one byte, over all other bytes in order.
    J1850 {
        /// Index of the checksum byte.
        at: usize,
    },
    /// A sum of bytes.
    Sum(ByteSum),
    /// AUTOSAR E2E; the counter of the profile is used.
    E2e(Profile),
}

/// One frame that carries wheel speeds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct WheelFrame {
    /// Identifier of the frame.
    #[serde(with = "crate::can::identifier")]
    pub id: Id,
    /// Message counter of up to 8 bits that cycles through all values, if there is one.
    pub counter: Option<Parts>,
    /// Protection of the frame.
    pub checksum: Checksum,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[allow(missing_docs, reason = "its messages say it")]
pub enum WheelError {
    #[error("wheel frame of {0} bytes is too short")]
    Short(usize),
    #[error("wheel frame has a wrong checksum")]
    Checksum,
    #[error("wheel frame: {0}")]
    E2e(Fault),
    /// The counter equals the previous one: an old frame.
    #[error("wheel frame is repeated")]
    Repeated,
    #[error("wheel {wheel}: speed is not valid")]
    Invalid { wheel: usize },
}

impl WheelFrame {
    pub(super) fn protected_mask(&self) -> u64 {
        match self.checksum {
            Checksum::None => 0,
            // At most 7: the settings are checked.
            Checksum::J1850 { at } => 0xFF << (8 * at.min(7)),
            Checksum::Sum(sum) => sum.field.mask(),
            Checksum::E2e(profile) => profile.header_mask(),
        }
    }

    pub(super) fn counters(&self) -> u16 {
        match (self.checksum, self.counter) {
            (Checksum::E2e(profile), _) => profile.counters(),
            (_, Some(field)) => 1 << field.bits(),
            (_, None) => 1,
        }
    }

    /// Checks the protection of a frame, and returns its counter if it has one.
    pub fn check(&self, data: &[u8]) -> Result<Option<u8>, WheelError> {
        let short = WheelError::Short(data.len());
        let matches = match self.checksum {
            Checksum::E2e(profile) => return profile.check(data).map(Some).map_err(WheelError::E2e),
            Checksum::None => true,
            Checksum::Sum(sum) => {
                let mask = u32::MAX >> 32_u8.saturating_sub(sum.field.bits());
                sum.field.raw(data).ok_or(short)? == u32::from(sum.of(self, data)) & mask
            }
            Checksum::J1850 { at } => {
                let mut digest = bosch::CRC.digest();
                let others = data.iter().enumerate().filter(|(k, _)| *k != at);
                others.for_each(|(_, byte)| digest.update(&[*byte]));
                *data.get(at).ok_or(short)? == digest.finalize()
            }
        };
        if !matches {
            return Err(WheelError::Checksum);
        }
        self.counter(data)
    }

    fn counter(&self, data: &[u8]) -> Result<Option<u8>, WheelError> {
        let Some(field) = self.counter else { return Ok(None) };
        // At most 8 bits: the settings are checked.
        field.raw(data).map(|raw| Some(raw as u8)).ok_or(WheelError::Short(data.len()))
    }
}

/// Rounds to the nearest code, which `as` does not.
pub(super) const fn nearest(value: f64) -> i32 {
    (value + if value < 0.0 { -0.5 } else { 0.5 }) as i32
}
