//! Reads rows of numbers from a file without a header, one row at a time. A row is a stamp and fields.

use super::summary::{StreamSummary, seconds};
use csv::ByteRecord;
use gyronet_tools::drive::error::{DataError, DataFault, ValueError, named};
use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom};
use std::path::Path;

/// A value beyond this is refused: UTM coordinates are about 4e6 m, and no sensor reads as much.
const MAX_VALUE: f64 = 1e12;
/// A file with a longer gap is not a single drive, s.
const MAX_SILENCE: f64 = 600.0;
/// Most columns of a file that are used.
const MOST: usize = 10;

#[derive(Debug, Clone, Copy)]
pub(super) struct Format {
    /// Number of columns, including that of the stamp.
    pub columns: usize,
    /// Indices of the used columns; the stamp is column 0.
    pub used: &'static [usize],
    pub nominal_hz: f64,
}

#[derive(Debug, Clone, Copy)]
pub(super) struct Row {
    pub line: u64,
    pub stamp: i64,
    /// The used columns, and zeros.
    pub fields: [f64; MOST],
}

pub(super) struct Rows {
    path: String,
    format: Format,
    csv: csv::Reader<File>,
    record: ByteRecord,
    last: Option<i64>,
    /// Length of a file whose last line has no end.
    cut_at: Option<u64>,
    pub summary: StreamSummary,
}

impl Rows {
    pub fn open(path: &Path, format: Format) -> Result<Self, DataError> {
        let name = path.display().to_string();
        let cut_at = File::open(path).and_then(cut).map_err(named(path))?;
        let file = File::open(path).map_err(named(path))?;
        let csv = csv::ReaderBuilder::new()
            .has_headers(false)
            .flexible(true)
            .trim(csv::Trim::All)
            .buffer_capacity(1 << 16)
            .from_reader(file);
        let summary = StreamSummary::new(path, format.nominal_hz);
        let record = ByteRecord::new();
        Ok(Self { path: name, format, csv, record, last: None, cut_at, summary })
    }

    pub fn path(&self) -> &str {
        &self.path
    }

    /// Returns the next good row. Skipped rows are counted in the summary.
    pub fn next_row(&mut self) -> Result<Option<Row>, DataError> {
        loop {
            let io = |error: csv::Error| DataError::of(&self.path, std::io::Error::other(error).into());
            if !self.csv.read_byte_record(&mut self.record).map_err(io)? {
                return Ok(None);
            }
            let line = self.record.position().map_or(0, csv::Position::line);
            if self.cut_at == Some(self.csv.position().byte()) {
                self.summary.cut.count(line);
                continue;
            }
            let found = self.record.len();
            if found != self.format.columns {
                return Err(self.refused(line, columns(found, self.format.columns)));
            }
            let stamp: i64 = self.field(line, 0)?;
            if stamp < 0 {
                return Err(self.value(line, 0, ValueError::OutOfRange));
            }
            let mut fields = [0.0_f64; MOST];
            for (field, column) in fields.iter_mut().zip(self.format.used) {
                *field = self.field(line, *column)?;
            }
            if fields.iter().any(|field| !field.is_finite()) {
                self.summary.not_finite.count(line);
                continue;
            }
            if let Some(k) = fields.iter().position(|field| field.abs() > MAX_VALUE) {
                return Err(self.value(line, self.format.used[k], ValueError::OutOfRange));
            }
            if let Some(last) = self.last {
                if stamp == last {
                    self.summary.duplicates.count(line);
                    continue;
                }
                if stamp < last {
                    return Err(self.refused(line, format!("time goes backwards from {last} to {stamp}")));
                }
                let seconds = seconds(stamp - last);
                if seconds > MAX_SILENCE {
                    // The rows after it belong to another drive.
                    let most = format!("a gap of a drive is at most {MAX_SILENCE} s long");
                    return Err(
                        self.refused(line, format!("silent for {seconds:.0} s before this row; {most}"))
                    );
                }
            }
            self.last = Some(stamp);
            self.summary.row(stamp);
            return Ok(Some(Row { line, stamp, fields }));
        }
    }

    fn refused(&self, line: u64, reason: String) -> DataError {
        DataError::at(&self.path, line, DataFault::Other(reason.into()))
    }

    fn field<T: std::str::FromStr>(&self, line: u64, column: usize) -> Result<T, DataError> {
        let text = std::str::from_utf8(self.bytes(column)).unwrap_or_default();
        let error = if self.bytes(column).is_empty() { ValueError::Empty } else { ValueError::NotANumber };
        text.parse().map_err(|_| self.value(line, column, error))
    }

    fn bytes(&self, column: usize) -> &[u8] {
        self.record.get(column).unwrap_or_default()
    }

    fn value(&self, line: u64, column: usize, error: ValueError) -> DataError {
        let text = String::from_utf8_lossy(self.bytes(column));
        DataError::value(&self.path, line, column + 1, &text, error)
    }
}

pub(crate) fn columns(found: usize, expected: usize) -> String {
    format!("{found} columns, expected {expected}")
}

/// Returns the length of a file whose last byte is not the end of a line.
fn cut(mut file: File) -> io::Result<Option<u64>> {
    let length = file.metadata()?.len();
    if length == 0 {
        return Ok(None);
    }
    let mut last = [0];
    file.seek(SeekFrom::Start(length - 1))?;
    file.read_exact(&mut last)?;
    Ok((last != *b"\n").then_some(length))
}
