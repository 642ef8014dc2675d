//! Rows of numbers without a header: a stamp and fields, one row in memory at a time.

use super::SequenceError;
use super::summary::StreamSummary;
use crate::recording::ValueError;
use csv::ByteRecord;
use std::cell::Cell;
use std::fs::File;
use std::path::Path;
use std::rc::Rc;

/// Bytes read so far of all files of a sequence, for whoever watches.
pub(super) type Progress = Rc<Cell<u64>>;

/// What a file looks like.
#[derive(Debug, Clone, Copy)]
pub(super) struct Format<const N: usize> {
    /// Columns, the stamp's included.
    pub columns: usize,
    /// The columns that are used; the stamp's is 0.
    pub used: [usize; N],
    /// Stamps per second.
    pub stamps_per_second: f64,
    /// Samples per second that the part is said to give.
    pub nominal_hz: f64,
}

/// One row: when, and the fields that are used.
#[derive(Debug, Clone, Copy)]
pub(super) struct Row<const N: usize> {
    pub line: u64,
    pub stamp: i64,
    pub fields: [f64; N],
}

/// A file being read.
pub(super) struct Rows<const N: usize> {
    path: String,
    format: Format<N>,
    csv: csv::Reader<File>,
    record: ByteRecord,
    last: Option<i64>,
    progress: Progress,
    seen: u64,
    pub summary: StreamSummary,
}

impl<const N: usize> Rows<N> {
    pub fn open(path: &Path, format: Format<N>, progress: Progress) -> Result<Self, SequenceError> {
        let name = path.display().to_string();
        let file = File::open(path).map_err(|source| SequenceError::open(&name, source))?;
        let csv = csv::ReaderBuilder::new()
            .has_headers(false)
            .flexible(true)
            .trim(csv::Trim::All)
            .buffer_capacity(1 << 16)
            .from_reader(file);
        let summary = StreamSummary::new(path, format.stamps_per_second, format.nominal_hz);
        let record = ByteRecord::new();
        Ok(Self { path: name, format, csv, record, last: None, progress, seen: 0, summary })
    }

    pub fn path(&self) -> &str {
        &self.path
    }

    /// Stamps as seconds.
    pub fn seconds(&self, stamps: i64) -> f64 {
        stamps as f64 / self.format.stamps_per_second
    }

    /// The next good row. Rows that are passed over are counted in the summary.
    pub fn next_row(&mut self) -> Result<Option<Row<N>>, SequenceError> {
        loop {
            let io = |error: csv::Error| SequenceError::Io {
                path: self.path.clone(),
                source: std::io::Error::other(error),
            };
            if !self.csv.read_byte_record(&mut self.record).map_err(io)? {
                return Ok(None);
            }
            let position = self.record.position();
            let (line, byte) = position.map_or((0, 0), |p| (p.line(), p.byte()));
            self.progress.set(self.progress.get() + (byte - self.seen));
            self.seen = byte;
            let found = self.record.len();
            if found != self.format.columns {
                let (path, expected) = (self.path.clone(), self.format.columns);
                return Err(SequenceError::Columns { path, line, found, expected });
            }
            let stamp: i64 = self.field(line, 0)?;
            let mut fields = [0.0_f64; N];
            for (field, column) in fields.iter_mut().zip(self.format.used) {
                *field = self.field(line, column)?;
            }
            if fields.iter().any(|field| !field.is_finite()) {
                self.summary.not_finite.count(line);
                continue;
            }
            if let Some(last) = self.last {
                if stamp == last {
                    self.summary.duplicates.count(line);
                    continue;
                }
                if stamp < last {
                    return Err(SequenceError::Backwards { path: self.path.clone(), line, last, at: stamp });
                }
            }
            self.last = Some(stamp);
            self.summary.row(stamp);
            return Ok(Some(Row { line, stamp, fields }));
        }
    }

    fn field<T: std::str::FromStr>(&self, line: u64, column: usize) -> Result<T, SequenceError> {
        let bytes = self.record.get(column).unwrap_or_default();
        let text = std::str::from_utf8(bytes).unwrap_or_default();
        text.parse().map_err(|_| SequenceError::Value {
            path: self.path.clone(),
            line,
            column: column + 1,
            text: String::from_utf8_lossy(bytes).into_owned(),
            error: if bytes.is_empty() { ValueError::Empty } else { ValueError::NotANumber },
        })
    }
}
