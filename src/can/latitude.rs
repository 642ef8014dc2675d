//! The receiver reads the latitude from a CAN frame that a GNSS receiver in the vehicle sends.
//!
//! A latitude is used once [`CONFIRM`] frames in a row agree. Afterwards, a latitude that the vehicle cannot have
//! reached is refused and counted, and the latitude in use is contested until a frame agrees with it again.
//! [`CONFIRM`] refused frames in a row that agree with each other replace the latitude in use. If the frames stop,
//! the latitude stays in use: an hour of driving changes the Earth's rate by 0.2 deg/h at most.

use super::signal::{BitField, ByteOrder};
use crate::units::Micros;
use embedded_can::{ExtendedId, Frame, Id, StandardId};

/// Number of frames that must agree before a latitude is used.
pub const CONFIRM: u8 = 10;
/// Largest difference of two latitudes that agree, degrees: 2 km.
const NEAR_DEG: f32 = 0.02;
/// Fastest plausible change, degrees per microsecond: 400 km/h.
const DEG_PER_US: f32 = 1e-9;
/// Largest plausible change since the last accepted frame, however long ago, degrees.
const LONGEST_DEG: f32 = 1.0;

/// The frame and the bit field that carry the latitude.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct LatitudeSettings {
    /// Identifier of the frame.
    pub id: u32,
    /// True if the identifier has 29 bits.
    pub extended: bool,
    /// Start bit, as in a DBC file.
    pub start: u8,
    /// Number of bits, up to 32.
    pub bits: u8,
    /// Order of the bytes.
    pub order: ByteOrder,
    /// True if the value is signed.
    pub signed: bool,
    /// Degrees per LSB, north positive.
    pub degrees_per_bit: f32,
    /// Degrees at raw value zero.
    pub offset_deg: f32,
    /// Raw value that means "not valid".
    pub invalid: Option<u32>,
}

/// The reason why latitude settings are refused.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum LatitudeConfigError {
    /// The identifier has too many bits.
    #[error("latitude frame {0:x} is not a valid identifier")]
    Identifier(u32),
    /// One of our own messages has the identifier.
    #[error("latitude frame {0:x} is one of our own messages")]
    Own(u32),
    /// The bit field does not lie inside a frame.
    #[error("latitude: {bits} bits from bit {start} do not lie inside a frame")]
    Outside {
        /// Configured start bit.
        start: u8,
        /// Configured number of bits.
        bits: u8,
    },
    /// The scale or the offset cannot be that of a latitude.
    #[error("latitude: {0} degrees per bit, or the offset, is not plausible")]
    Scale(f32),
}

impl LatitudeSettings {
    /// Returns the identifier.
    ///
    /// # Errors
    /// [`LatitudeConfigError::Identifier`].
    pub fn id(&self) -> Result<Id, LatitudeConfigError> {
        let id = match (self.extended, u16::try_from(self.id)) {
            (true, _) => ExtendedId::new(self.id).map(Id::Extended),
            (false, Ok(id)) => StandardId::new(id).map(Id::Standard),
            (false, Err(_)) => None,
        };
        id.ok_or(LatitudeConfigError::Identifier(self.id))
    }
}

/// The reason why a frame gives no latitude.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum LatitudeError {
    /// The frame has too few bytes.
    #[error("latitude frame of {0} bytes is too short")]
    Short(usize),
    /// The sender marks the latitude as not valid.
    #[error("latitude is marked as not valid")]
    Invalid,
    /// The latitude is beyond +-90 degrees.
    #[error("latitude {0} is beyond a pole")]
    Range(f32),
    /// The latitude is further from the one in use than the vehicle can have driven.
    #[error("latitude jumps from {from} to {to}")]
    Jump {
        /// The latitude in use.
        from: f32,
        /// The latitude that was received.
        to: f32,
    },
}

/// A latitude that has been accepted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ReceivedLatitude {
    /// Degrees, north positive.
    pub degrees: f32,
    /// True if it agrees with the latitude in use; otherwise it is the first one, or replaces a wrong one.
    pub moved: bool,
}

/// Receives CAN frames and decodes the latitude from them.
#[derive(Debug, Clone, Copy)]
pub struct LatitudeReceiver {
    settings: LatitudeSettings,
    id: Id,
    field: BitField,
    known: Option<(f32, Micros)>,
    /// A latitude that is not used yet, and the number of frames that agree with it.
    candidate: Option<(f32, u8)>,
}

impl LatitudeReceiver {
    /// Checks the settings. `known` is a latitude from another source, with which frames must agree.
    ///
    /// # Errors
    /// [`LatitudeConfigError`].
    pub fn new(settings: LatitudeSettings, known: Option<f32>) -> Result<Self, LatitudeConfigError> {
        let LatitudeSettings { start, bits, order, signed, degrees_per_bit, offset_deg, .. } = settings;
        let id = settings.id()?;
        let field = BitField::new(start, bits, order, signed);
        let field = field.map_err(|_| LatitudeConfigError::Outside { start, bits })?;
        let scale = (1e-10..=90.0).contains(&degrees_per_bit.abs()) && (-360.0..=360.0).contains(&offset_deg);
        if !scale {
            return Err(LatitudeConfigError::Scale(degrees_per_bit));
        }
        let known = known.map(|degrees| (degrees, Micros(0)));
        Ok(Self { settings, id, field, known, candidate: None })
    }

    /// Returns the identifier of the frame.
    #[must_use]
    pub fn id(&self) -> Id {
        self.id
    }

    /// Returns whether frames contradict the latitude in use.
    #[must_use]
    pub fn is_contested(&self) -> bool {
        self.known.is_some() && self.candidate.is_some()
    }

    /// Processes a frame received at `now`; `None` if it carries no latitude, or one that is not confirmed yet.
    ///
    /// # Errors
    /// [`LatitudeError`]; the latitude in use does not change.
    pub fn decode(
        &mut self,
        frame: &impl Frame,
        now: Micros,
    ) -> Option<Result<ReceivedLatitude, LatitudeError>> {
        if frame.id() != self.id {
            return None;
        }
        match self.degrees(frame.data()) {
            Ok(degrees) => self.judge(degrees, now).transpose(),
            Err(error) => Some(Err(error)),
        }
    }

    fn degrees(&self, data: &[u8]) -> Result<f32, LatitudeError> {
        let LatitudeSettings { degrees_per_bit, offset_deg, invalid, .. } = self.settings;
        let value = self.field.value(data).ok_or(LatitudeError::Short(data.len()))?;
        if invalid.is_some() && self.field.raw(data) == invalid {
            return Err(LatitudeError::Invalid);
        }
        let degrees = value as f32 * degrees_per_bit + offset_deg;
        if (-90.0..=90.0).contains(&degrees) { Ok(degrees) } else { Err(LatitudeError::Range(degrees)) }
    }

    fn judge(&mut self, degrees: f32, now: Micros) -> Result<Option<ReceivedLatitude>, LatitudeError> {
        if let Some((from, at)) = self.known {
            let reachable = (now.since(at).0 as f32 * DEG_PER_US).min(LONGEST_DEG);
            if (degrees - from).abs() <= NEAR_DEG + reachable {
                self.known = Some((degrees, now));
                self.candidate = None;
                return Ok(Some(ReceivedLatitude { degrees, moved: true }));
            }
        }
        let agreeing = match self.candidate {
            Some((before, frames)) if (degrees - before).abs() <= NEAR_DEG => frames + 1,
            _ => 1,
        };
        if agreeing >= CONFIRM {
            self.known = Some((degrees, now));
            self.candidate = None;
            return Ok(Some(ReceivedLatitude { degrees, moved: false }));
        }
        self.candidate = Some((degrees, agreeing));
        match self.known {
            Some((from, _)) => Err(LatitudeError::Jump { from, to: degrees }),
            None => Ok(None),
        }
    }
}
