//! Fits the shares to the spans of all drives by robust least squares.
//!
//! Huber's weights (1.345 robust deviations) give little weight to a span whose reference was lost. The sigmas come
//! from leaving out one block of time after the other (jackknife), so they hold for errors that last for seconds.

use super::spans::Span;
use nalgebra::{DMatrix, DVector};

/// Number of reweighting iterations.
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
    let columns = 3 + drives.len();
    let kept: Vec<(usize, &Span)> = drives
        .iter()
        .enumerate()
        .flat_map(|(drive, spans)| spans.iter().enumerate().map(move |(k, span)| (drive, k, span)))
        .filter(|(drive, k, _)| keep(*drive, *k))
        .map(|(drive, _, span)| (drive, span))
        .collect();
    let inputs = DMatrix::from_fn(kept.len(), columns, |row, column| {
        let (drive, span) = kept[row];
        match column {
            0..3 if fitted[column] => span.turns[column],
            _ if column == 3 + drive => span.seconds,
            _ => 0.0,
        }
    });
    let errors = DVector::from_iterator(kept.len(), kept.iter().map(|(_, span)| span.error));
    let mut solution = DVector::zeros(columns);
    let mut weights = DVector::from_element(kept.len(), 1.0);
    for _ in 0..ROUNDS {
        let weighted =
            DMatrix::from_fn(kept.len(), columns, |row, column| inputs[(row, column)] * weights[row]);
        let normal = weighted.transpose() * &inputs;
        // The pseudoinverse gives zero for a column of zeros.
        let inverse = normal.svd(true, true).solve(&(weighted.transpose() * &errors), f64::EPSILON);
        let Ok(found) = inverse else { break };
        solution = found;
        let residuals = &errors - &inputs * &solution;
        let limit = HUBER * deviation(residuals.iter().copied().collect());
        weights =
            residuals.map(|residual| if residual.abs() <= limit { 1.0 } else { limit / residual.abs() });
    }
    let shares = std::array::from_fn(|k| if fitted[k] { solution[k] } else { 0.0 });
    (shares, solution.iter().skip(3).copied().collect())
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
