//! This module flips single bits in a weight file, and checks that the file is refused when it is loaded, or that the
//! background check finds the bit when the file is in use.
//!
//! Weights are in flash with a CRC-32, which is checked when they are loaded and again, piece by piece, while they
//! are used ([`gyronet::model::background`]). Until that check finds a flipped bit, the limits of
//! [`gyronet::compensate::CompensateConfig`] bound its effect.

use crate::random::Random;
use gyronet::compensate::CompensateConfig;
use gyronet::model::background::BackgroundCheck;
use gyronet::model::blob::{HEADER_LEN, LINEAR_INPUTS};
use gyronet::model::window::{FEATURES, Features, WINDOW};
use gyronet::model::{Blob, Estimate, GyroNet, WindowNetwork};
use gyronet::nn::bilstm::Layer;
use gyronet::nn::dense::Dense;
use gyronet::nn::linear::Linear;
use gyronet::nn::lstm::DirectionWeights;
use gyronet::pipeline::UncertaintyConfig;
use gyronet::units::AngularRate;
use serde::Serialize;
use std::fmt;
use std::panic::{AssertUnwindSafe, catch_unwind};

/// Number of bytes that the image's idle task checks in a millisecond: a pass takes 9.7 s.
pub const PIECE: usize = 13;

/// Holds the effects of flipped bits in a weight file.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct WeightUpsets {
    /// Bits of the header, provenance included.
    pub header_bits: usize,
    /// Bits of the header that were refused when loaded.
    pub header_refused: usize,
    /// Bits of weights that were flipped, one at a time.
    pub weight_bits: usize,
    /// Bits of weights that were refused when loaded.
    pub weight_refused: usize,
    /// The effects of bits that flip after loading.
    pub effects: Effects,
    /// Time from a flip to its report by the background check, median and largest, s.
    pub found_after: [f64; 2],
    /// Flips that the background check has not found.
    pub not_found: usize,
}

/// Holds a weight file in memory whose bits are flipped.
struct Memory {
    words: Vec<u32>,
    bytes: usize,
}

impl Memory {
    fn new(file: &[u8]) -> Self {
        let mut words = vec![0; file.len().div_ceil(4)];
        bytemuck::cast_slice_mut(&mut words)[..file.len()].copy_from_slice(file);
        Self { words, bytes: file.len() }
    }

    fn flip(&mut self, bit: usize) {
        bytemuck::cast_slice_mut::<u32, u8>(&mut self.words)[bit / 8] ^= 1 << (bit % 8);
    }

    fn file(&self) -> &[u8] {
        &bytemuck::cast_slice(&self.words)[..self.bytes]
    }

    /// Returns the weights in use, damaged or not. The header's values are those of `loaded`: it is not read again.
    fn in_use<'m>(&'m self, loaded: &Blob<'m>) -> Option<Blob<'m>> {
        let mut at = first_weight(self.file()) / 4;
        let mut take = |words: usize| {
            at += words;
            self.words.get(at - words..at)
        };
        let (units, content) = (usize::from(loaded.shape.units), self.file().get(..self.bytes - 4)?);
        let mut damaged = Blob { content, ..*loaded };
        if loaded.shape.linear {
            let rows = bytemuck::cast_slice(take(WINDOW * LINEAR_INPUTS)?);
            damaged.linear = Linear::new(LINEAR_INPUTS, rows).ok();
        }
        if units > 0 {
            let mut direction = |inputs| {
                let input = take(DirectionWeights::input_words(units, inputs))?;
                DirectionWeights::new(units, inputs, input, take(DirectionWeights::recurrent_words(units))?)
            };
            let mut layer =
                |inputs| Some(Layer { forward: direction(inputs)?, backward: direction(inputs)? });
            damaged.layers = Some([layer(FEATURES)?, layer(2 * units)?]);
            let mut dense = || {
                let weights = bytemuck::cast_slice(take(units)?);
                let &[bias, multiplier] = take(2)? else { return None };
                Some(Dense { weights, bias: bias as i32, multiplier: multiplier as i32 })
            };
            (damaged.gyro_error, damaged.log_scale) = (dense()?, dense()?);
        }
        let &[scale_unit] = take(1)? else { return None };
        Some(Blob { scale_unit, ..damaged })
    }
}

/// Returns the offset of the first weight, after the header and its provenance.
fn first_weight(file: &[u8]) -> usize {
    let length =
        file.get(24..28).map_or(0, |bytes| bytes.iter().rev().fold(0, |n, byte| n << 8 | usize::from(*byte)));
    HEADER_LEN + length
}

impl WeightUpsets {
    /// Flips every bit of the header, and `bits` bits of the weights, drawn from a seed. Each damaged network
    /// estimates the given windows. `tick` is called once for each bit.
    #[must_use]
    pub fn new(
        file: &[u8],
        loaded: &Blob<'_>,
        windows: &[[Features; WINDOW]],
        (bits, seed): (usize, u64),
        mut tick: impl FnMut(),
    ) -> Self {
        let mut upsets = Self::default();
        let mut memory = Memory::new(file);
        let first = 8 * first_weight(file);
        for bit in 0..first {
            memory.flip(bit);
            upsets.header_bits += 1;
            upsets.header_refused += usize::from(Blob::new_checked(memory.file()).is_err());
            memory.flip(bit);
            tick();
        }
        let mut network = GyroNet::new(*loaded);
        let undamaged: Vec<Estimate> = windows.iter().map(|window| network.estimate(window)).collect();
        let mut draw = Random::new(seed, 0);
        let mut found = Vec::new();
        for _ in 0..bits {
            let bit = first + draw.below(8 * (file.len() - 4) - first);
            memory.flip(bit);
            upsets.weight_bits += 1;
            upsets.weight_refused += usize::from(Blob::new_checked(memory.file()).is_err());
            if let Some(blob) = memory.in_use(loaded) {
                let effect = catch_unwind(AssertUnwindSafe(|| effect(&blob, windows, &undamaged)));
                match effect {
                    Ok((reported, moved, sigmas)) => upsets.effects.count(reported, moved, sigmas),
                    Err(_) => upsets.effects.panics += 1,
                }
                match found_after(&blob, bit / 8, draw.below(file.len())) {
                    Some(milliseconds) => found.push(milliseconds as f64 * 1e-3),
                    None => upsets.not_found += 1,
                }
            }
            memory.flip(bit);
            tick();
        }
        found.sort_by(f64::total_cmp);
        let median = found.get(found.len() / 2).copied().unwrap_or_default();
        upsets.found_after = [median, found.last().copied().unwrap_or_default()];
        upsets
    }
}

/// Returns whether an estimate is rejected, and by how much a second of the worst estimate moves yaw, in rad and in
/// stated sigmas.
fn effect(blob: &Blob<'_>, windows: &[[Features; WINDOW]], undamaged: &[Estimate]) -> (bool, f64, f64) {
    let limits = CompensateConfig::DEFAULT;
    let mut network = GyroNet::new(*blob);
    let (mut reported, mut moved, mut sigmas) = (false, 0f64, 0f64);
    for (window, before) in windows.iter().zip(undamaged) {
        let estimate = network.estimate(window);
        let mean = |estimate: &Estimate| {
            estimate.corrections.iter().map(|correction| correction.rad_per_sec()).sum::<f64>()
                / WINDOW as f64
        };
        let largest = estimate.corrections.iter().map(|correction| correction.0.unsigned_abs()).max();
        reported |= mean(&estimate).abs() > limits.max_mean.rad_per_sec()
            || largest.unwrap_or_default() > limits.max_single.0.unsigned_abs();
        let by = (mean(&estimate) - mean(before)).abs();
        let sigma = f64::from(UncertaintyConfig::DEFAULT.per_scale) * before.scale.rad_per_sec();
        moved = moved.max(by);
        sigmas = sigmas.max(by / sigma.max(AngularRate(1).rad_per_sec()));
    }
    (reported, moved, sigmas)
}

/// Returns the milliseconds until the background check reports a flip that happens when the check is at byte `at`;
/// `None` if the check does not find the flip.
///
/// Only one pass needs to be computed, because every pass that reads the flipped byte has the wrong checksum.
fn found_after(damaged: &Blob<'_>, flipped: usize, at: usize) -> Option<usize> {
    let mut check = BackgroundCheck::new(damaged.content, damaged.crc);
    let length = check.len();
    let finds = check.advance(length)?.is_err();
    // A flip in a byte that this pass has already checked is found in the next pass.
    let rest = length.saturating_sub(at);
    let bytes = if flipped >= at { rest } else { rest + length };
    finds.then_some(bytes.div_ceil(PIECE))
}

impl fmt::Display for WeightUpsets {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [median, most] = self.found_after;
        writeln!(f, "header: {} of {} bits refused when loaded", self.header_refused, self.header_bits)?;
        writeln!(f, "weights: {} of {} bits refused when loaded", self.weight_refused, self.weight_bits)?;
        writeln!(f, "flipped in use: {}", self.effects)?;
        writeln!(
            f,
            "background check: reports after {median:.1} s, at most {most:.1} s; {} not found",
            self.not_found
        )
    }
}

/// Counts flipped bits by effect.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct Effects {
    /// Bits flipped.
    pub bits: usize,
    /// Bits that changed nothing.
    pub nothing: usize,
    /// Bits whose estimate was rejected, which a receiver sees.
    pub reported: usize,
    /// Bits that moved yaw by no more than the stated sigma.
    pub within: usize,
    /// Bits that moved yaw further without a report.
    pub beyond: usize,
    /// Largest yaw moved in a second without a report, rad.
    pub most: f64,
    /// Bits whose arithmetic overflowed; on the board it wraps.
    pub panics: usize,
}

impl Effects {
    fn count(&mut self, reported: bool, moved: f64, sigmas: f64) {
        self.bits += 1;
        if reported {
            self.reported += 1;
            return;
        }
        self.most = self.most.max(moved);
        match sigmas {
            0.0 => self.nothing += 1,
            ..=1.0 => self.within += 1,
            _ => self.beyond += 1,
        }
    }
}

impl fmt::Display for Effects {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { bits, nothing, reported, within, beyond, most, panics } = self;
        write!(
            f,
            "{bits} bits: {nothing} changed nothing, {within} moved yaw by at most the stated sigma, {beyond} by \
             more, at most {most:.1e} rad in a second, {reported} were reported, {panics} panics"
        )
    }
}
