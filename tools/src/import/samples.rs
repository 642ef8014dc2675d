//! Storage of a channel's samples: the newest in memory, the others in a temporary file, so that a log of many
//! gigabytes needs no more memory than a small one.

use super::value::{Fix, Kind, Sample, Value};
use std::cell::OnceCell;
use std::fs::File;
use std::io::{self, BufReader, ErrorKind, Read, Write};
use tempfile::NamedTempFile;

/// Most numbers of a channel that are kept in memory: 256 KiB.
const IN_MEMORY: usize = 1 << 15;
/// Most numbers of a sample.
const WIDEST: usize = 7;

/// The samples of a channel, all of one kind, in the order of the log.
#[derive(Debug)]
pub struct Samples {
    /// The first and the last sample.
    ends: [Sample; 2],
    count: usize,
    /// Whether all samples are kept, or only the ends and the count.
    kept: bool,
    /// The newest samples, as numbers.
    memory: Vec<f64>,
    /// The older samples.
    file: Option<NamedTempFile>,
    /// The reason why the temporary file could not be read back.
    failed: OnceCell<io::Error>,
}

impl Samples {
    /// Creates the storage with a first sample. Unless `kept`, only both ends and the count are stored.
    pub(super) fn new(first: Sample, kept: bool) -> io::Result<Self> {
        let mut samples = Self {
            ends: [first; 2],
            count: 0,
            kept,
            memory: Vec::new(),
            file: None,
            failed: OnceCell::new(),
        };
        samples.push(first)?;
        Ok(samples)
    }

    /// Adds a sample of the same kind as the first one.
    pub(super) fn push(&mut self, sample: Sample) -> io::Result<()> {
        self.ends[1] = sample;
        self.count += 1;
        if !self.kept {
            return Ok(());
        }
        let (numbers, width) = numbers(sample);
        self.memory.extend_from_slice(&numbers[..width]);
        if self.memory.len() < IN_MEMORY {
            return Ok(());
        }
        let file = match &mut self.file {
            Some(file) => file,
            None => self.file.insert(NamedTempFile::new()?),
        };
        file.write_all(&self.memory.iter().flat_map(|number| number.to_le_bytes()).collect::<Vec<u8>>())?;
        self.memory.clear();
        Ok(())
    }

    pub fn kind(&self) -> Kind {
        self.ends[0].1.kind()
    }

    pub fn first(&self) -> Sample {
        self.ends[0]
    }

    pub fn last(&self) -> Sample {
        self.ends[1]
    }

    /// Returns the number of samples.
    #[expect(clippy::len_without_is_empty, reason = "a channel begins with a sample")]
    pub fn len(&self) -> usize {
        self.count
    }

    /// Returns the samples that are kept.
    pub fn iter(&self) -> Iter<'_> {
        let file =
            self.file.as_ref().map(|file| file.reopen().map(|file| BufReader::with_capacity(1 << 16, file)));
        let file = file.transpose().unwrap_or_else(|error| {
            // The first error is kept.
            let _ = self.failed.set(error);
            None
        });
        Iter { samples: self, file, memory: self.memory.chunks_exact(self.width()) }
    }

    fn width(&self) -> usize {
        numbers(self.ends[0]).1
    }

    /// Returns the reason why [`Samples::iter`] ended early, if it did.
    pub fn failure(&self) -> Option<io::Error> {
        self.failed.get().map(|error| io::Error::new(error.kind(), format!("temporary file: {error}")))
    }
}

impl<'a> IntoIterator for &'a Samples {
    type Item = Sample;
    type IntoIter = Iter<'a>;

    fn into_iter(self) -> Iter<'a> {
        self.iter()
    }
}

/// An iterator over samples, first those in the file.
#[derive(Debug)]
pub struct Iter<'a> {
    samples: &'a Samples,
    file: Option<BufReader<File>>,
    memory: std::slice::ChunksExact<'a, f64>,
}

impl Iterator for Iter<'_> {
    type Item = Sample;

    fn next(&mut self) -> Option<Sample> {
        if self.samples.failed.get().is_some() {
            return None;
        }
        let kind = self.samples.kind();
        let mut row = [0.0; WIDEST];
        if let Some(file) = &mut self.file {
            let mut bytes = [0; 8 * WIDEST];
            let width = self.samples.width();
            match file.read_exact(&mut bytes[..8 * width]) {
                Ok(()) => {
                    for (number, bytes) in row.iter_mut().zip(bytes.as_chunks().0) {
                        *number = f64::from_le_bytes(*bytes);
                    }
                    return Some(sample(kind, row));
                }
                Err(error) if error.kind() == ErrorKind::UnexpectedEof => self.file = None,
                Err(error) => {
                    let _ = self.samples.failed.set(error);
                    return None;
                }
            }
        }
        let numbers = self.memory.next()?;
        row[..numbers.len()].copy_from_slice(numbers);
        Some(sample(kind, row))
    }
}

/// Returns a sample as numbers, and their count. An unknown number is NaN.
fn numbers((seconds, value): Sample) -> ([f64; WIDEST], usize) {
    match value {
        Value::Imu([fx, fy, fz], [wx, wy, wz]) => ([seconds, fx, fy, fz, wx, wy, wz], 7),
        Value::Odometry(speed, rate) => ([seconds, speed, rate, 0.0, 0.0, 0.0, 0.0], 3),
        Value::Position(Fix { degrees: [latitude, longitude], sigma_m, velocity }) => {
            let [speed, course, sigma] = velocity.unwrap_or([f64::NAN; 3]);
            ([seconds, latitude, longitude, sigma_m.unwrap_or(f64::NAN), speed, course, sigma], 7)
        }
        Value::Number(number) => ([seconds, number, 0.0, 0.0, 0.0, 0.0, 0.0], 2),
    }
}

fn sample(kind: Kind, [seconds, a, b, c, d, e, f]: [f64; WIDEST]) -> Sample {
    let value = match kind {
        Kind::Imu => Value::Imu([a, b, c], [d, e, f]),
        Kind::Odometry => Value::Odometry(a, b),
        Kind::Position => {
            let velocity = (!d.is_nan()).then_some([d, e, f]);
            Value::Position(Fix { degrees: [a, b], sigma_m: (!c.is_nan()).then_some(c), velocity })
        }
        Kind::Number => Value::Number(a),
    };
    (seconds, value)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn samples_come_back_from_memory_and_file_as_they_were() {
        let fix = |k: f64| {
            let velocity = (k % 2.0 == 0.0).then_some([k, 0.1, 0.2]);
            Value::Position(Fix { degrees: [k / 1e6, -k / 1e6], sigma_m: Some(k), velocity })
        };
        let values: [&dyn Fn(f64) -> Value; 4] =
            [&|k| Value::Imu([k, 2.0, 3.0], [4.0, 5.0, -k]), &|k| Value::Odometry(k, -k), &fix, &|k| {
                Value::Number(k / 3.0)
            }];
        for value in values {
            let sample = |k: u32| (f64::from(k), value(f64::from(k)));
            let mut samples = Samples::new(sample(0), true).unwrap();
            for k in 1..40_000 {
                samples.push(sample(k)).unwrap();
            }
            assert!(samples.file.is_some() && !samples.memory.is_empty());
            // Two iterators at a time do not affect each other.
            for ((one, two), k) in samples.iter().zip(&samples).zip(0..) {
                assert_eq!((one, two), (sample(k), sample(k)));
            }
            assert_eq!((samples.iter().count(), samples.len()), (40_000, 40_000));
            assert_eq!((samples.first(), samples.last()), (sample(0), sample(39_999)));
        }
    }

    #[test]
    fn of_samples_that_are_not_kept_ends_and_count_are_known() {
        let mut samples = Samples::new((0.0, Value::Number(1.0)), false).unwrap();
        samples.push((2.0, Value::Number(3.0))).unwrap();
        assert_eq!((samples.len(), samples.last().0, samples.iter().count()), (2, 2.0, 0));
    }

    #[test]
    fn a_temporary_file_that_is_gone_is_an_error() {
        let mut samples = Samples::new((0.0, Value::Number(0.0)), true).unwrap();
        for k in 1..=IN_MEMORY {
            samples.push((k as f64, Value::Number(0.0))).unwrap();
        }
        std::fs::remove_file(samples.file.as_ref().unwrap().path()).unwrap();
        assert_eq!(samples.iter().count(), 0);
        assert!(samples.failure().is_some_and(|error| error.to_string().starts_with("temporary file: ")));
    }
}
