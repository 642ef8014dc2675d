//! A value in a frame that the configuration describes, as a DBC file does.

use super::HeadingError;
use crate::can::signal::BitField;
use embedded_can::{Frame, Id};

const FACTORS: core::ops::RangeInclusive<f32> = 1e-10..=90.0;
const LARGEST_OFFSET: f32 = 400.0;

/// A value in a frame.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct HeadingSignal {
    /// Identifier of the frame.
    #[serde(with = "crate::can::identifier")]
    pub id: Id,
    /// Position of the raw value.
    pub field: BitField,
    /// Units per LSB: rad clockwise from north, m/s, or degrees of latitude.
    pub factor: f32,
    /// Value at raw value zero.
    pub offset: f32,
    /// Raw value that means "not valid".
    pub invalid: Option<u32>,
}

impl HeadingSignal {
    pub(super) fn is_plausible(&self) -> bool {
        FACTORS.contains(&libm::fabsf(self.factor)) && libm::fabsf(self.offset) <= LARGEST_OFFSET
    }

    /// Reads the value, `Some(None)` where it is not valid; `None` for another frame.
    pub(super) fn read(&self, frame: &impl Frame) -> Option<Result<Option<f32>, HeadingError>> {
        (frame.id() == self.id).then(|| {
            let short = HeadingError::Short(frame.data().len());
            let (raw, value) =
                self.field.raw(frame.data()).zip(self.field.value(frame.data())).ok_or(short)?;
            Ok((self.invalid != Some(raw)).then_some(value as f32 * self.factor + self.offset))
        })
    }
}
