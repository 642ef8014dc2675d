//! Fits the shares to the spans of all drives by robust least squares.
//!
//! Huber's weights (1.345 robust deviations) give little weight to a span whose reference was lost. The sigmas come
//! from leaving out one block of time after the other (jackknife), so they hold for errors that last for seconds.

use super::normal_equations::NormalEquations;
use super::spans::Span;

const ROUNDS: usize = 30;
/// Huber's constant: 95 % of the efficiency of least squares where the errors are normal.
const HUBER: f64 = 1.345;
/// Median of the magnitudes of a normal distribution, in standard deviations.
const MEDIAN: f64 = 0.6745;
/// Number of blocks of a drive for the jackknife.
const BLOCKS: usize = 10;
/// Least robust deviation, rad; anything smaller is rounding.
const FLOOR_RAD: f64 = 1e-9;

#[derive(Debug, Clone)]
pub struct Fit {
    /// Shares of the roll, pitch and yaw rate; 0 for one that is not fitted.
    pub shares: [f64; 3],
    /// Standard deviations of the shares.
    pub sigmas: [f64; 3],
    pub biases: Vec<f64>,
    /// The robust deviation of each drive's spans from the fit, rad.
    pub deviations: Vec<f64>,
}

impl Fit {
    /// Fits the shares that `fitted` names, and a constant for each drive.
    pub fn new(drives: &[&[Span]], fitted: [bool; 3]) -> Self {
        let all = |_: usize, _: usize| true;
        let (shares, biases) = solve(drives, fitted, all);
        let mut left_out = Vec::new();
        for (drive, spans) in drives.iter().enumerate() {
            let block = spans.len().div_ceil(BLOCKS).max(1);
            for first in (0..spans.len()).step_by(block) {
                let keep = |d: usize, span: usize| d != drive || !(first..first + block).contains(&span);
                left_out.push(solve(drives, fitted, keep).0);
            }
        }
        let blocks = left_out.len().max(1) as f64;
        let sigmas = std::array::from_fn(|k| {
            let mean = left_out.iter().map(|shares| shares[k]).sum::<f64>() / blocks;
            let squares = left_out.iter().map(|shares| (shares[k] - mean).powi(2)).sum::<f64>();
            ((blocks - 1.0) / blocks * squares).sqrt()
        });
        let deviations = drives
            .iter()
            .zip(&biases)
            .map(|(spans, bias)| deviation(spans.iter().map(|span| residual(span, &shares, *bias)).collect()))
            .collect();
        Self { shares, sigmas, biases, deviations }
    }
}

fn residual(span: &Span, shares: &[f64; 3], bias: f64) -> f64 {
    let explained: f64 = span.turns.iter().zip(shares).map(|(turn, share)| turn * share).sum();
    span.error - explained - bias * span.seconds
}

/// Returns the robust standard deviation of residuals about zero.
fn deviation(mut residuals: Vec<f64>) -> f64 {
    residuals.iter_mut().for_each(|residual| *residual = residual.abs());
    residuals.sort_by(f64::total_cmp);
    residuals.get(residuals.len() / 2).map_or(0.0, |median| median / MEDIAN).max(FLOOR_RAD)
}

/// Solves for the shares and each drive's constant over the spans that `keep` accepts.
fn solve(drives: &[&[Span]], fitted: [bool; 3], keep: impl Fn(usize, usize) -> bool) -> ([f64; 3], Vec<f64>) {
    let kept_of = |(drive, spans): (usize, &&'_ [Span])| {
        let spans = spans.iter().enumerate().filter(|(k, _)| keep(drive, *k));
        spans.map(|(_, span)| Weighted { span: *span, weight: 1.0 }).collect()
    };
    let mut kept: Vec<Vec<Weighted>> = drives.iter().enumerate().map(kept_of).collect();
    let (mut shares, mut biases) = ([0.0; 3], Vec::new());
    for _ in 0..ROUNDS {
        (shares, biases) = weighted(&kept, fitted);
        let left = |bias: f64, kept: &Weighted| residual(&kept.span, &shares, bias);
        let of_drive = |(spans, bias): (&Vec<Weighted>, &f64)| -> Vec<f64> {
            spans.iter().map(|kept| left(*bias, kept)).collect()
        };
        let limit = HUBER * deviation(kept.iter().zip(&biases).flat_map(of_drive).collect());
        for (spans, bias) in kept.iter_mut().zip(&biases) {
            for kept in spans {
                kept.weight = (limit / left(*bias, kept).abs()).min(1.0);
            }
        }
    }
    (shares, biases)
}

struct Weighted {
    span: Span,
    weight: f64,
}

/// Solves the weighted least squares: what each drive's constant explains is taken off first, which leaves three
/// equations.
fn weighted(drives: &[Vec<Weighted>], fitted: [bool; 3]) -> ([f64; 3], Vec<f64>) {
    let mut equations = NormalEquations::default();
    let mut constants = Vec::new();
    for spans in drives {
        let sum = |value: &dyn Fn(&Span) -> f64| -> f64 {
            spans.iter().map(|kept| kept.weight * kept.span.seconds * value(&kept.span)).sum()
        };
        let seconds = sum(&|span| span.seconds);
        let constant = |value: &dyn Fn(&Span) -> f64| if seconds > 0.0 { sum(value) / seconds } else { 0.0 };
        let turns: [f64; 3] = std::array::from_fn(|k| constant(&|span| span.turns[k]));
        let error = constant(&|span| span.error);
        for Weighted { span, weight } in spans {
            let left = |k: usize| if fitted[k] { span.turns[k] - turns[k] * span.seconds } else { 0.0 };
            equations.add(std::array::from_fn(left), span.error - error * span.seconds, *weight);
        }
        constants.push((turns, error));
    }
    let shares = equations.solve().map(Option::unwrap_or_default);
    let explained =
        |turns: &[f64; 3]| turns.iter().zip(shares).map(|(turn, share)| turn * share).sum::<f64>();
    (shares, constants.iter().map(|(turns, error)| error - explained(turns)).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;

    /// Creates spans of one second with known shares, noise, and a few lost references.
    fn spans(shares: [f64; 3], bias: f64, seed: u64, turning: f64) -> Vec<Span> {
        let mut random = Random::new(seed, 0);
        let span = |k: usize, random: &mut Random| {
            let turns = [0.004, 0.005, turning].map(|size| size * random.normal());
            let explained: f64 = turns.iter().zip(shares).map(|(turn, share)| turn * share).sum();
            let lost = if k.is_multiple_of(40) { 0.05 } else { 0.0 };
            Span { error: explained + bias + 1e-4 * random.normal() + lost, turns, seconds: 1.0 }
        };
        (0..130).map(|k| span(k, &mut random)).collect()
    }

    #[test]
    fn known_shares_are_found_within_their_sigma() {
        let shares = [-0.006, 0.029, 0.001];
        let drives = [spans(shares, 2e-4, 1, 0.05), spans(shares, -1e-4, 2, 0.05)];
        let fit = Fit::new(&drives.each_ref().map(Vec::as_slice), [true; 3]);
        for (k, share) in shares.into_iter().enumerate() {
            let error = (fit.shares[k] - share).abs();
            assert!(error < 4.0 * fit.sigmas[k] && fit.sigmas[k] < 0.003, "{k}: {error} {}", fit.sigmas[k]);
        }
        assert!((fit.biases[0] - 2e-4).abs() < 5e-5 && (fit.biases[1] + 1e-4).abs() < 5e-5);
    }

    #[test]
    fn a_drive_without_turns_has_no_gain() {
        let drives = [spans([0.0, 0.0, 0.01], 0.0, 3, 1e-4)];
        let drives = drives.each_ref().map(Vec::as_slice);
        assert!(Fit::new(&drives, [true; 3]).sigmas[2] > super::super::MAX_GAIN_SIGMA);
        assert_eq!(Fit::new(&drives, [true, true, false]).shares[2], 0.0);
    }
}
