//! Interpolates streams. A stream returns its value at any time, in ascending order, by linear
//! interpolation between the rows before and after.
//!
//! Increments (angle of a gyro, distance of a wheel) are streams of their sums, so that nothing is lost or counted
//! twice, whatever the stamps are.

use super::rows::{Row, Rows};
use super::summary::{StreamSummary, seconds};
use gyronet_tools::drive::error::{DataError, DataFault};

/// Converts a row's fields, at a time in s, to the interpolated values; the function may keep state between rows.
type Convert<const M: usize> = Box<dyn FnMut(&Row, f64, &mut StreamSummary) -> [f64; M]>;

#[derive(Debug, Clone, Copy)]
pub(super) struct Value<const M: usize> {
    pub values: [f64; M],
    /// Time between the rows around it, s.
    pub gap: f64,
}

/// A stream of M values of a file, read at ascending times.
pub(super) struct Track<const M: usize> {
    rows: Rows,
    convert: Convert<M>,
    /// The stamp of time zero.
    pub epoch: i64,
    /// The time of the first row, s since the epoch.
    pub first: f64,
    before: (f64, [f64; M]),
    after: (f64, [f64; M]),
}

impl<const M: usize> Track<M> {
    /// Reads the first row; without an epoch, its stamp becomes the epoch.
    pub fn new(
        mut rows: Rows,
        epoch: Option<i64>,
        convert: impl FnMut(&Row, f64, &mut StreamSummary) -> [f64; M] + 'static,
    ) -> Result<Self, DataError> {
        let first = rows.next_row()?;
        let Some(row) = first else { return Err(DataError::of(rows.path(), DataFault::Empty)) };
        let epoch = epoch.unwrap_or(row.stamp);
        let time = seconds(row.stamp - epoch);
        let mut convert: Convert<M> = Box::new(convert);
        let now = (time, convert(&row, time, &mut rows.summary));
        Ok(Self { rows, convert, epoch, first: time, before: now, after: now })
    }

    fn advance(&mut self) -> Result<bool, DataError> {
        let Some(row) = self.rows.next_row()? else { return Ok(false) };
        self.before = self.after;
        let time = seconds(row.stamp - self.epoch);
        self.after = (time, (self.convert)(&row, time, &mut self.rows.summary));
        Ok(true)
    }

    /// Returns the value at a time, s since the epoch; `None` beyond the end of the file.
    pub fn at(&mut self, time: f64) -> Result<Option<Value<M>>, DataError> {
        while self.after.0 < time {
            if !self.advance()? {
                return Ok(None);
            }
        }
        let ((from, first), (to, second)) = (self.before, self.after);
        let span = to - from;
        let part = if span > 0.0 { (time - from) / span } else { 1.0 };
        let values = std::array::from_fn(|k| first[k] + (second[k] - first[k]) * part);
        Ok(Some(Value { values, gap: span }))
    }

    /// Returns the time of the newest row that was read.
    pub fn reached(&self) -> f64 {
        self.after.0
    }

    pub fn finish(mut self) -> Result<StreamSummary, DataError> {
        while self.advance()? {}
        Ok(self.rows.summary)
    }
}

/// Unwraps an angle beyond pi, assuming that no step turns by more than pi.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Unwrap {
    last: Option<f64>,
}

impl Unwrap {
    pub fn angle(&mut self, angle: f64) -> f64 {
        let last = self.last.unwrap_or(angle);
        let unwrapped = last + gyronet_tools::evaluate::angle::wrap(angle - last);
        self.last = Some(unwrapped);
        unwrapped
    }
}
