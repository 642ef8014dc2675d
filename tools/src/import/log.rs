//! A log of any format: named channels of timed measurements in SI units, and counts of dropped records.

use super::samples::Samples;
use super::value::{Kind, Value};
use std::collections::BTreeMap;

/// Most samples of one channel: more than a day at 1 kHz.
pub const MAX_SAMPLES: usize = 100_000_000;
/// Most GNSS fixes of one channel: a day at 20 Hz. Computing the course needs all of them in memory.
const MAX_FIXES: usize = 2_000_000;
/// Most channels of one file. A log has tens; a bus with a large DBC file has thousands of signals.
const MAX_CHANNELS: usize = 4_096;
/// Most reasons for dropped records that are counted separately.
const MAX_REASONS: usize = 64;

/// The channels of one file.
#[derive(Debug, Default)]
pub struct Log {
    /// The samples of each channel, by name, in order of time.
    pub channels: BTreeMap<String, Samples>,
    /// The units of plain numbers, by channel, if the log has them.
    pub units: BTreeMap<String, String>,
    /// Numbers of records that could not be used, by reason.
    pub dropped: BTreeMap<String, u64>,
    /// Numbers of records that no drive needs, by type.
    pub passed_over: BTreeMap<String, u64>,
    /// Names of the plain number channels that are kept. Of other ones only the ends and the count are kept, since a
    /// bus has thousands. `None` keeps all.
    pub wanted: Option<Vec<String>>,
    /// The reason why samples could not be kept.
    pub(super) failed: Option<std::io::Error>,
}

impl Log {
    /// Adds a measurement. A measurement that is not finite, or not later than the previous one, is dropped.
    pub fn add(&mut self, channel: &str, seconds: f64, value: Value) {
        if !seconds.is_finite() || !value.is_finite() {
            return self.drop(format!("{channel}: not a finite number"));
        }
        let sample = (seconds, value);
        let Some(samples) = self.channels.get_mut(channel) else {
            if self.channels.len() >= MAX_CHANNELS {
                return self.drop("channels beyond the limit".to_owned());
            }
            // A wanted name may begin with the file's name.
            let is_wanted = |wanted: &Vec<String>| wanted.iter().any(|name| name.ends_with(channel));
            let kept = value.kind() != Kind::Number || self.wanted.as_ref().is_none_or(is_wanted);
            match Samples::new(sample, kept) {
                Ok(samples) => drop(self.channels.insert(channel.to_owned(), samples)),
                Err(error) => self.failed = Some(error),
            }
            return;
        };
        if samples.kind() != value.kind() {
            return self.drop(format!("{channel}: another type under the same name"));
        }
        let most = if value.kind() == Kind::Position { MAX_FIXES } else { MAX_SAMPLES };
        if samples.len() >= most {
            return self.drop(format!("{channel}: beyond the {most} samples that are kept"));
        }
        if seconds <= samples.last().0 {
            return self.drop(format!("{channel}: time does not rise"));
        }
        if self.failed.is_none() {
            self.failed = samples.push(sample).err();
        }
    }

    /// Counts a record that could not be used.
    pub fn drop(&mut self, reason: String) {
        count(&mut self.dropped, reason);
    }

    /// Counts a record of a type that no drive needs.
    pub fn pass_over(&mut self, kind: &str) {
        count(&mut self.passed_over, kind.to_owned());
    }

    /// Returns the name, kind, number of samples and rate, Hz, of each channel.
    pub fn catalogue(&self) -> impl Iterator<Item = (&str, Kind, usize, f64)> {
        self.channels.iter().map(|(name, samples)| {
            let rate = (samples.len() - 1) as f64 / (samples.last().0 - samples.first().0).max(1e-9);
            (name.as_str(), samples.kind(), samples.len(), rate)
        })
    }
}

fn count(counts: &mut BTreeMap<String, u64>, reason: String) {
    if counts.len() < MAX_REASONS || counts.contains_key(&reason) {
        *counts.entry(reason).or_default() += 1;
    } else {
        *counts.entry("other".to_owned()).or_default() += 1;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn of_numbers_that_are_not_wanted_none_is_kept() {
        let mut log = Log { wanted: Some(vec!["bus.blf:A.RL".to_owned()]), ..Log::default() };
        for k in 0..101 {
            let seconds = 0.01 * f64::from(k);
            log.add("A.RL", seconds, Value::Number(1.0));
            log.add("A.RR", seconds, Value::Number(1.0));
            log.add("odometry", seconds, Value::Odometry(1.0, 0.0));
        }
        assert_eq!(["A.RL", "A.RR", "odometry"].map(|name| log.channels[name].iter().count()), [101, 0, 101]);
        for (name, _, count, hz) in log.catalogue() {
            assert!(count == 101 && (hz - 100.0).abs() < 1e-6, "{name} {count} {hz}");
        }
    }

    #[test]
    fn a_clock_that_jumps_back_costs_the_samples_until_it_has_caught_up() {
        let mut log = Log::default();
        for seconds in [0.0, 0.1, 0.05, 0.1, 0.2, f64::NAN] {
            log.add("a", seconds, Value::Number(1.0));
        }
        log.add("a", 0.3, Value::Number(f64::INFINITY));
        log.add("a", 0.3, Value::Odometry(1.0, 0.0));
        let times: Vec<f64> = log.channels["a"].iter().map(|(seconds, _)| seconds).collect();
        assert_eq!(times, [0.0, 0.1, 0.2]);
        let dropped: Vec<_> = log.dropped.iter().map(|(reason, count)| (reason.as_str(), *count)).collect();
        let expected = [
            ("a: another type under the same name", 1),
            ("a: not a finite number", 2),
            ("a: time does not rise", 2),
        ];
        assert_eq!(dropped, expected);
    }
}
