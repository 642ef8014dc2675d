//! The classical baseline: a linear-phase low pass after static initialisation.
//!
//! The filter is a sinc with a Hamming window. Its delay of half its length is compensated, as that of the delayed
//! rate is. So it shows what smoothing alone gains with the same inputs and no more delay. Length and corner
//! frequency were the best of a grid on the training drives.

use gyronet::sample::RATE_HZ;
use std::collections::VecDeque;
use std::f64::consts::PI;

/// A symmetric low pass with an odd number of taps.
#[derive(Debug, Clone, PartialEq)]
pub struct LowPass {
    /// The taps, with a sum of 1.
    taps: Vec<f64>,
}

/// Taps on either side of the middle one.
const HALF: usize = 5;
const CORNER_HZ: f64 = 5.0;

impl LowPass {
    pub fn chosen() -> Self {
        let tap = |k: usize| {
            let from_middle = k as f64 - HALF as f64;
            // The window ends one sample beyond the first and the last tap.
            let window = 0.54 + 0.46 * (PI * from_middle / (HALF + 1) as f64).cos();
            let phase = 2.0 * PI * CORNER_HZ / f64::from(RATE_HZ) * from_middle;
            window * if phase == 0.0 { 1.0 } else { phase.sin() / phase }
        };
        let taps: Vec<f64> = (0..=2 * HALF).map(tap).collect();
        let sum: f64 = taps.iter().sum();
        Self { taps: taps.iter().map(|tap| tap / sum).collect() }
    }

    /// Returns the delay, samples.
    pub fn delay(&self) -> usize {
        self.taps.len() / 2
    }

    /// Returns the filtered values, each at the time of its input ([`Line`]).
    pub fn filter(&self, input: &[f64]) -> Vec<f64> {
        let mut line = Line::new(self.clone());
        let mut filtered: Vec<f64> = input.iter().filter_map(|value| line.next(*value)).collect();
        filtered.extend(std::iter::from_fn(|| line.end()));
        filtered
    }
}

/// A low pass at work. Its delay is compensated: a value comes out [`LowPass::delay`] inputs after its own input. The
/// first and the last value are repeated beyond the ends.
#[derive(Debug, Clone)]
pub struct Line {
    filter: LowPass,
    /// The newest inputs, as many as there are taps.
    inputs: VecDeque<f64>,
    /// Inputs whose values have not come out.
    due: usize,
}

impl Line {
    pub fn new(filter: LowPass) -> Self {
        let inputs = VecDeque::with_capacity(filter.taps.len() + 1);
        Self { filter, inputs, due: 0 }
    }

    pub fn next(&mut self, input: f64) -> Option<f64> {
        self.due += 1;
        if self.inputs.is_empty() {
            self.inputs.extend(std::iter::repeat_n(input, self.filter.delay()));
        }
        self.add(input)
    }

    /// The values that remain after the last input, one at a time.
    pub fn end(&mut self) -> Option<f64> {
        while self.due > 0 {
            let last = *self.inputs.back()?;
            let value = self.add(last);
            if value.is_some() {
                return value;
            }
        }
        None
    }

    fn add(&mut self, input: f64) -> Option<f64> {
        let taps = &self.filter.taps;
        self.inputs.push_back(input);
        if self.inputs.len() > taps.len() {
            self.inputs.pop_front();
        }
        if self.inputs.len() < taps.len() {
            return None;
        }
        self.due -= 1;
        Some(taps.iter().zip(&self.inputs).map(|(tap, value)| tap * value).sum())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn phase_is_linear_and_the_delay_at_most_70_ms() {
        let filter = LowPass::chosen();
        for (front, back) in filter.taps.iter().zip(filter.taps.iter().rev()) {
            assert!((front - back).abs() < 1e-15);
        }
        assert!((filter.taps.iter().sum::<f64>() - 1.0).abs() < 1e-12);
        assert!(filter.delay() * 1_000 / RATE_HZ as usize <= 70, "{} samples", filter.delay());
        assert_eq!(filter.taps.len(), 2 * filter.delay() + 1);
    }

    /// A sine of 1 Hz is attenuated but not delayed.
    #[test]
    fn a_sine_lines_up_with_its_input() {
        let sine = |shift: f64| -> Vec<f64> {
            (0..1_000).map(|k| (2.0 * PI * (f64::from(k) + shift) / f64::from(RATE_HZ)).sin()).collect()
        };
        let out = LowPass::chosen().filter(&sine(0.0));
        let correlation = |shift: f64| {
            let other = sine(shift);
            (100..900).map(|k| out[k] * other[k]).sum::<f64>()
        };
        let best = (-80..=80)
            .map(|k| f64::from(k) / 10.0)
            .max_by(|a, b| correlation(*a).total_cmp(&correlation(*b)));
        assert_eq!(best, Some(0.0));
        let gain = out[125] / sine(0.0)[125];
        assert!((0.9..1.0).contains(&gain), "{gain}");
    }

    #[test]
    fn ends_are_held() {
        assert!(LowPass::chosen().filter(&[2.0; 3]).iter().all(|out| (out - 2.0).abs() < 1e-12));
        assert!(LowPass::chosen().filter(&[]).is_empty());
    }
}
