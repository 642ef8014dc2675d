//! Bits that flip by themselves: in the weights, and in what waits between pipeline and network.
//!
//! Weights lie in flash under a CRC-32, which is checked when they are loaded and again, piece by
//! piece, while they are used ([`gyronet::model::background`]). Until that finds a flipped bit,
//! the limits of [`gyronet::compensate::CompensateConfig`] are what bounds its effect.

pub mod handed_over;
pub mod weights;

use serde::Serialize;
use std::fmt;

/// What flipped bits did.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct Effects {
    /// Bits flipped.
    pub bits: usize,
    /// Nothing changed.
    pub nothing: usize,
    /// The estimate was not believed: a receiver is told.
    pub told: usize,
    /// Yaw moved by no more than the stated sigma.
    pub within: usize,
    /// It moved further, and nothing told.
    pub beyond: usize,
    /// The most that it moved in a second where nothing told, rad.
    pub most: f64,
    /// Arithmetic that overflowed; the board's wraps.
    pub panics: usize,
}

impl Effects {
    fn count(&mut self, told: bool, moved: f64, sigmas: f64) {
        self.bits += 1;
        if told {
            self.told += 1;
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
        let Self { bits, nothing, told, within, beyond, most, panics } = self;
        write!(
            f,
            "{bits} bits: {nothing} changed nothing, {within} moved yaw by at most the stated sigma, {beyond} by \
             more, at most {most:.1e} rad in a second, {told} were told of, {panics} panics"
        )
    }
}
