//! Interpolates streams. A stream returns its value at any time, in ascending order, by linear
//! interpolation between the rows before and after.
//!
//! Increments (angle of a gyro, distance of a wheel) are streams of their sums, so that nothing is lost or counted
//! twice, whatever the stamps are.

use super::rows::{Row, Rows};
use super::summary::StreamSummary;
use gyronet_tools::drive::error::{DataError, DataFault};

/// Converts a row's fields, at a time in s, to the interpolated values; the function may keep state between rows.
pub(super) type Convert<const N: usize, const M: usize> =
    Box<dyn FnMut(&Row<N>, f64, &mut StreamSummary) -> [f64; M]>;

/// A stream of M values of a file, read at ascending times.
pub(super) trait Stream<const M: usize> {
    /// Returns the time of the first row, s since the epoch.
    fn first(&self) -> f64;
    /// Returns the value at a time, s since the epoch; `None` beyond the end of the file.
    fn at(&mut self, time: f64) -> Result<Option<Value<M>>, DataError>;
    /// Returns the time of the newest row that was read.
    fn reached(&self) -> f64;
    fn finish(self: Box<Self>) -> Result<StreamSummary, DataError>;
}

#[derive(Debug, Clone, Copy)]
pub(super) struct Value<const M: usize> {
    pub values: [f64; M],
    /// Time between the rows around it, s.
    pub gap: f64,
}

/// Interpolates M values from N fields of a file.
pub(super) struct Track<const N: usize, const M: usize> {
    rows: Rows<N>,
    convert: Convert<N, M>,
    epoch: i64,
    first: f64,
    before: (f64, [f64; M]),
    after: (f64, [f64; M]),
}

impl<const N: usize, const M: usize> Track<N, M> {
    /// Reads the first row; without an epoch, its stamp becomes the epoch.
    pub fn new(mut rows: Rows<N>, epoch: Option<i64>, mut convert: Convert<N, M>) -> Result<Self, DataError> {
        let first = rows.next_row()?;
        let Some(row) = first else { return Err(DataError::of(rows.path(), DataFault::Empty)) };
        let epoch = epoch.unwrap_or(row.stamp);
        let time = rows.seconds(row.stamp - epoch);
        let now = (time, convert(&row, time, &mut rows.summary));
        Ok(Self { rows, convert, epoch, first: time, before: now, after: now })
    }

    /// Returns the stamp of time zero.
    pub fn epoch(&self) -> i64 {
        self.epoch
    }

    fn advance(&mut self) -> Result<bool, DataError> {
        let Some(row) = self.rows.next_row()? else { return Ok(false) };
        self.before = self.after;
        let time = self.rows.seconds(row.stamp - self.epoch);
        self.after = (time, (self.convert)(&row, time, &mut self.rows.summary));
        Ok(true)
    }
}

impl<const N: usize, const M: usize> Stream<M> for Track<N, M> {
    fn first(&self) -> f64 {
        self.first
    }

    fn at(&mut self, time: f64) -> Result<Option<Value<M>>, DataError> {
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

    fn reached(&self) -> f64 {
        self.after.0
    }

    fn finish(mut self: Box<Self>) -> Result<StreamSummary, DataError> {
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
