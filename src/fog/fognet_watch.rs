//! The watch drops FoGNet where standstills show that it makes the rate worse.
//!
//! A standing vehicle does not turn, so its corrected rate is all error. Each second the squares of both rates, with
//! FoGNet and without, are compared over the same two seconds ([`super::rest`]); the sum of their differences decays
//! over about two minutes of standstill. FoGNet is dropped, until the next start, when it is clearly worse. It is not
//! required to be better, because the bias that it starts from was found at standstill, and the errors that it
//! corrects appear in turns.

use super::rest::Second;
use crate::sample::{RATE_HZ, Standstill};
use crate::units::Angle;

/// FoGNet is not dropped before this many comparisons.
const SOON: u8 = 10;
/// Time constant of the sum's decay, in comparisons.
const MEMORY: f32 = 128.0;
/// A sum of squares beyond this is clearly more than noise, (rad/s)^2: that of 0.25 deg/h, the bias of a DSP-1760,
/// over [`MEMORY`]. With such a correction a DSP-1760's noise contributes half of it, 1 sigma; with one of 0.1 deg/h,
/// a fifth.
const CLEAR: f32 = 1.9e-10;

/// Compares the rates with and without FoGNet.
#[derive(Debug, Clone)]
pub struct FogNetWatch {
    second: [Second; 2],
    before: Option<[Second; 2]>,
    /// Sum of the squares without FoGNet less those with it, rad^2/s^2.
    gain: f32,
    comparisons: u8,
}

impl FogNetWatch {
    /// The state before the first step.
    pub const START: Self = Self { second: [Second::EMPTY; 2], before: None, gain: 0.0, comparisons: 0 };

    /// Adds a step's turns without and with FoGNet, where both are known. Returns whether FoGNet is to be dropped.
    pub fn observe(&mut self, turns: Option<[Angle; 2]>, standstill: Standstill) -> bool {
        let (Some(turns), Standstill::Still) = (turns, standstill) else {
            self.second = [Second::EMPTY; 2];
            self.before = None;
            return false;
        };
        for (second, turn) in self.second.iter_mut().zip(turns) {
            second.add(turn);
        }
        let [first, _] = &self.second;
        if u32::from(first.steps()) < RATE_HZ {
            return false;
        }
        let second = core::mem::replace(&mut self.second, [Second::EMPTY; 2]);
        let Some([base, network]) = self.before.replace(second) else { return false };
        let [next_base, next_network] = &second;
        let (base, network) = (base.triangle(next_base), network.triangle(next_network));
        self.gain += base * base - network * network - self.gain / MEMORY;
        self.comparisons = self.comparisons.saturating_add(1);
        self.comparisons >= SOON && self.gain < -CLEAR
    }
}
