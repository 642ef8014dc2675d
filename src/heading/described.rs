//! A heading in a frame that the configuration describes, as a DBC file does.

use super::{Heading, HeadingError};
use crate::can::signal::BitField;
use embedded_can::{Frame, Id};

/// A value in a frame.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Quantity {
    /// Position of the raw value.
    pub field: BitField,
    /// Units per LSB: rad or m/s.
    pub factor: f32,
    /// Value at raw value zero.
    pub offset: f32,
    /// Raw value that means "not valid".
    pub invalid: Option<u32>,
}

impl Quantity {
    /// Returns the value, `None` where it is not valid.
    fn of(&self, data: &[u8]) -> Result<Option<f32>, HeadingError> {
        let short = HeadingError::Short(data.len());
        if self.field.raw(data) == self.invalid && self.invalid.is_some() {
            return Ok(None);
        }
        Ok(Some(self.field.value(data).ok_or(short)? as f32 * self.factor + self.offset))
    }
}

/// A frame with a heading. A value without a place is not in it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HeadingFrame {
    /// Identifier of the frame.
    pub id: Id,
    /// Course, rad; a negative one is taken as the turn to the left that it is.
    pub course: Option<Quantity>,
    /// Accuracy of the course, 1 sigma, rad.
    pub course_sigma: Option<Quantity>,
    /// Speed over ground, m/s.
    pub speed: Option<Quantity>,
    /// Accuracy of the speed, 1 sigma, m/s.
    pub speed_sigma: Option<Quantity>,
}

impl HeadingFrame {
    /// Reads a frame; `None` for another identifier.
    ///
    /// # Errors
    /// [`HeadingError`].
    pub fn heading(&self, frame: &impl Frame) -> Option<Result<Heading, HeadingError>> {
        (frame.id() == self.id).then(|| {
            let read =
                |quantity: Option<Quantity>| quantity.map_or(Ok(None), |quantity| quantity.of(frame.data()));
            let course = read(self.course)?;
            let whole = |course: f32| if course < 0.0 { course + core::f32::consts::TAU } else { course };
            Heading {
                course: course.map(whole),
                course_sigma: read(self.course_sigma)?,
                speed: read(self.speed)?,
                speed_sigma: read(self.speed_sigma)?,
            }
            .checked()
        })
    }
}
