//! Computes a gyro's Allan deviation at rest, angular random walk and bias instability.
//!
//! Averages of neighbouring spans of length tau differ by white noise and by bias changes. White noise falls as one
//! over the root of tau; its value at 1 s is the angular random walk. Bias changes do not average out: the flat
//! bottom of the curve, over 0.664, is the bias instability (IEEE Std 952).

use super::finding::Finding;
use super::recording::{Rows, sorted};
use crate::drive::DT;
use std::ops::Range;

/// Fewest pairs of spans for a point; a point from fewer scatters by more than a third.
const LEAST_PAIRS: usize = 9;
const PER_DECADE: f64 = 8.0;
/// The flat part of the curve of 1/f noise, in units of the noise coefficient.
const FLAT: f64 = 0.664;
/// Shortest standstill for a noise figure, s.
const LEAST_S: f64 = 10.0;

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Noise {
    /// Angular random walk, rad/s/sqrt(Hz) or, the same number, rad/sqrt(s).
    pub random_walk: f64,
    /// Bias instability, rad/s, with the averaging time of the curve's minimum, s; `None` if the standstill is too
    /// short.
    pub instability: Option<(f64, f64)>,
}

/// Computes the curve of rates at 100 Hz from overlapping spans: averaging times, s, and deviations, rad/s. Fewer than
/// 10 rates give no point.
fn deviations(rates: &[f64]) -> Vec<(f64, f64)> {
    let mut angle = Vec::with_capacity(rates.len() + 1);
    let mut sum = 0.0;
    angle.push(sum);
    for rate in rates {
        sum += rate * DT;
        angle.push(sum);
    }
    let mut points = Vec::new();
    let mut last = 0;
    for k in 0.. {
        let span = 10f64.powf(f64::from(k) / PER_DECADE).round() as usize;
        if rates.len() < (LEAST_PAIRS + 1) * span {
            break;
        }
        if span == last {
            continue;
        }
        last = span;
        let tau = span as f64 * DT;
        let squares = angle.windows(2 * span + 1).map(|w| (w[2 * span] - 2.0 * w[span] + w[0]).powi(2));
        let count = squares.len() as f64;
        points.push((tau, (squares.sum::<f64>() / (2.0 * tau * tau * count)).sqrt()));
    }
    points
}

impl Noise {
    /// Returns the figures of rates at 100 Hz; `None` for less than a second.
    fn of(rates: &[f64]) -> Option<Self> {
        let points = deviations(rates);
        // Below 0.1 s a sensor's own filter hides the noise.
        let white = points.iter().filter(|(tau, _)| (0.1..=1.0).contains(tau));
        let walks = sorted(white.map(|(tau, deviation)| deviation * tau.sqrt()));
        let random_walk = *walks.get(walks.len() / 2)?;
        let bottom = points.iter().enumerate().min_by(|a, b| a.1.1.total_cmp(&b.1.1));
        // A curve that still falls at its end has not reached its minimum.
        let instability = bottom.filter(|(at, _)| at + 2 < points.len());
        let instability = instability.map(|(_, (tau, deviation))| (deviation / FLAT, *tau));
        Some(Self { random_walk, instability })
    }
}

/// Returns the noise about x, y and z; `None` if the standstill is too short.
pub fn at_rest(rows: &Rows, standstill: Option<&Range<usize>>) -> Option<[Option<Noise>; 3]> {
    let span = standstill.filter(|span| span.len() as f64 * DT >= LEAST_S)?.clone();
    let rates = |axis: usize| rows.rate[span.clone()].iter().map(|rate| rate[axis]).collect::<Vec<f64>>();
    Some([0, 1, 2].map(|axis| Noise::of(&rates(axis))))
}

pub fn finding(noise: Option<&[Option<Noise>; 3]>, standstill: Option<&Range<usize>>) -> Finding {
    let Some([_, _, Some(Noise { random_walk, instability })]) = noise else {
        let seconds = standstill.map_or(0.0, |span| span.len() as f64 * DT);
        return Finding::note(
            "gyro noise",
            format!(
                "Not computed: the longest standstill has {seconds:.0} s; at least {LEAST_S:.0} s are needed."
            ),
        );
    };
    let walk = random_walk.to_degrees() * 60.0;
    let bottom = match instability {
        Some((rate, tau)) => {
            format!("bias instability {:.2} deg/h at {tau:.0} s", rate.to_degrees() * 3_600.0)
        }
        None => {
            "the Allan deviation still falls, so the bias instability needs a longer standstill".to_owned()
        }
    };
    Finding::note(
        "gyro noise",
        format!(
            "About z: angular random walk {walk:.3} deg/sqrt(h), {bottom}; includes vibration of the standing vehicle."
        ),
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;

    #[test]
    fn white_noise_has_its_random_walk_and_no_bottom() {
        let mut random = Random::new(3, 0);
        let rates: Vec<f64> = (0..60_000).map(|_| 0.5 + 0.01 * random.normal()).collect();
        let noise = Noise::of(&rates).unwrap();
        // 0.01 rad/s at 100 Hz.
        assert!((noise.random_walk / 1e-3 - 1.0).abs() < 0.05, "{noise:?}");
        assert_eq!(noise.instability, None);
    }

    #[test]
    fn a_bias_that_walks_has_a_bottom() {
        let (mut random, mut bias) = (Random::new(3, 0), 0.0);
        let rates: Vec<f64> = (0..100_000)
            .map(|_| {
                bias += 1e-5 * random.normal();
                bias + 0.01 * random.normal()
            })
            .collect();
        let (instability, tau) = Noise::of(&rates).unwrap().instability.unwrap();
        // White noise and a walk of rate K = 1e-4 cross at tau = sqrt(3) N / K.
        assert!((3.0..60.0).contains(&tau) && (1e-4..1e-3).contains(&instability), "{tau} s {instability}");
    }

    #[test]
    fn too_little_has_no_figures() {
        assert_eq!(deviations(&[0.0; 12]).len(), 1);
        assert_eq!(Noise::of(&[]), None);
    }
}
