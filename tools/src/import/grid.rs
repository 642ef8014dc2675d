//! Resamples samples of any rate to the 100 Hz grid.
//!
//! From 150 Hz on, a row is the mean of the samples within 5 ms of it, which preserves the integral and averages the
//! noise. Below 150 Hz, a row is interpolated between its neighbours, if they are at most 2.5 periods apart. A row in
//! a gap is left out, because an invented row could not be told from a measured one.

use crate::drive::DT;

/// Rate from which on samples are averaged, Hz.
const AVERAGED_HZ: f64 = 150.0;
/// Periods beyond which two samples have a gap between them.
const GAP_PERIODS: f64 = 2.5;

/// Most periods, from the beginning of a log, of which the median is taken.
const RATED: usize = 100_000;

/// An iterator over the samples of a vector, in order of time.
pub type Stream<'a, const N: usize> = Box<dyn Iterator<Item = (f64, [f64; N])> + 'a>;

/// Returns the sample rate by the median period, Hz.
pub fn rate<const N: usize>(stream: Stream<'_, N>) -> Option<f64> {
    let mut last = None;
    let period = |(seconds, _)| last.replace(seconds).map(|last| seconds - last);
    let mut periods: Vec<f64> = stream.map(period).take(1 + RATED).flatten().collect();
    if periods.is_empty() {
        return None;
    }
    let middle = periods.len() / 2;
    let (_, median, _) = periods.select_nth_unstable_by(middle, f64::total_cmp);
    Some(1.0 / *median)
}

/// Returns how samples of this rate are resampled, for messages.
pub fn method(hz: f64) -> &'static str {
    if hz >= AVERAGED_HZ {
        "mean of the samples within 5 ms of each row"
    } else if (hz - 100.0).abs() < 0.5 {
        "interpolated to the row's time, no filter"
    } else {
        "linear interpolation, no filter"
    }
}

/// An iterator over samples that are resampled to `start + k * 10 ms`; `None` in gaps.
pub struct Grid<'a, const N: usize> {
    stream: std::iter::Peekable<Stream<'a, N>>,
    before: Option<(f64, [f64; N])>,
    hz: f64,
    start: f64,
    row: usize,
}

impl<'a, const N: usize> Grid<'a, N> {
    /// Creates a grid that begins at `start`. Each call of `stream` returns all samples again; `offset` is added to
    /// their times.
    pub fn new(stream: impl Fn() -> Stream<'a, N>, offset: f64, start: f64) -> Self {
        let hz = rate(stream()).unwrap_or(100.0);
        let shifted: Stream<'a, N> =
            Box::new(stream().map(move |(seconds, value)| (seconds + offset, value)));
        Self { stream: shifted.peekable(), before: None, hz, start, row: 0 }
    }

    fn mean(&mut self, time: f64) -> Option<[f64; N]> {
        while self.stream.next_if(|sample| sample.0 < time - 0.5 * DT).is_some() {}
        let (mut count, mut sum) = (0, [0.0; N]);
        while let Some((_, value)) = self.stream.next_if(|sample| sample.0 < time + 0.5 * DT) {
            count += 1;
            sum = std::array::from_fn(|axis| sum[axis] + value[axis]);
        }
        (count > 0).then(|| sum.map(|sum| sum / f64::from(count)))
    }
}

impl<const N: usize> Iterator for Grid<'_, N> {
    type Item = Option<[f64; N]>;

    /// Returns the value of the next row. The iterator never ends.
    fn next(&mut self) -> Option<Self::Item> {
        let time = self.start + DT * self.row as f64;
        self.row += 1;
        if self.hz >= AVERAGED_HZ {
            return Some(self.mean(time));
        }
        if self.before.is_none() {
            self.before = self.stream.next();
        }
        while let Some(sample) = self.stream.next_if(|sample| sample.0 <= time) {
            self.before = Some(sample);
        }
        let longest = GAP_PERIODS / self.hz;
        Some(self.before.and_then(|before| between(&before, self.stream.peek(), time, longest)))
    }
}

/// Interpolates between the sample before a time and the sample after it.
fn between<const N: usize>(
    before: &(f64, [f64; N]),
    behind: Option<&(f64, [f64; N])>,
    time: f64,
    longest: f64,
) -> Option<[f64; N]> {
    // A sample at the time of the row needs no interpolation.
    if (time - before.0).abs() < 1e-6 {
        return Some(before.1);
    }
    let behind = behind?;
    let period = behind.0 - before.0;
    let share = (time - before.0) / period;
    let known = period <= longest && (0.0..=1.0).contains(&share);
    known.then(|| std::array::from_fn(|axis| before.1[axis] + share * (behind.1[axis] - before.1[axis])))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn resample(series: &[(f64, [f64; 1])], start: f64, rows: usize) -> Vec<Option<[f64; 1]>> {
        Grid::new(|| Box::new(series.iter().copied()), 0.0, start).take(rows).collect()
    }

    fn sine(hz: f64, seconds: f64) -> Vec<(f64, [f64; 1])> {
        let samples = (hz * seconds) as usize;
        (0..samples).map(|k| (k as f64 / hz, [(2.0 * k as f64 / hz).sin()])).collect()
    }

    #[test]
    fn any_rate_keeps_the_signal_and_its_integral() {
        for hz in [25.0, 50.0, 100.0, 120.0, 400.0, 1_000.0] {
            let series = sine(hz, 12.0);
            let rows = resample(&series, 1.0, 1_000);
            let (mut worst, mut integral) = (0.0f64, 0.0);
            for (k, row) in rows.iter().enumerate() {
                let truth = (2.0 * (1.0 + 0.01 * k as f64)).sin();
                let [value] = row.expect("no gap");
                worst = worst.max((value - truth).abs());
                integral += 0.01 * (value - truth);
            }
            assert!(worst < 3e-3 && integral.abs() < 2e-3, "{hz} Hz: {worst} {integral}");
        }
    }

    #[test]
    fn rows_in_a_gap_are_left_out() {
        for hz in [50.0, 400.0] {
            let mut series = sine(hz, 4.0);
            series.retain(|(time, _)| !(1.5..1.8).contains(time));
            let rows = resample(&series, 0.0, 390);
            let missing = rows.iter().filter(|row| row.is_none()).count();
            assert!((28..=32).contains(&missing), "{hz} Hz: {missing}");
            assert!(rows[..149].iter().chain(&rows[182..]).all(Option::is_some), "{hz} Hz");
        }
    }
}
