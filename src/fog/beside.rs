//! The comparison of a fibre-optic gyro with the inertial one beside it, by steps and over the last second.
//!
//! | difference | effect |
//! |---|---|
//! | the rate of a step, by more than [`LIMIT`] (late increments add up in one step) | the step is not used; after two seconds of such steps they are used and degraded |
//! | the mean rate of the last second, by more than [`GATE`] of the inertial gyro's expected errors | the difference is part of sigma; if it exceeds the largest sigma of the bus, the rate is degraded |
//! | the gain in turns, by more than the inertial gyro's own gain error | the difference, with what that error may hide ([`ASKEW`]), is a share of the rate in sigma, and of the roll and pitch rates, because a misaligned axis reads too little |

use crate::sample::{PERIOD_US, RATE_HZ};
use crate::sqrt::sqrt;
use crate::units::Micros;

/// Difference of a step that no vehicle has, rad/s and a share of the inertial rate, and how long it is rejected.
const LIMIT: (f32, f32) = (3.0, 0.5);
const DOUBTED: u32 = 2 * RATE_HZ;
/// Expected errors of the inertial gyro beyond which the difference of a second is the fibre-optic one's.
const GATE: f32 = 3.0;
/// Largest expected error on the bus, rad/s: 0.655 deg/s.
const LARGEST_SIGMA: f32 = 0.0114;
/// Shares of the rate, 1 sigma, beside the unit's own: of a street's slope without an inertial sensor; and beside one
/// before both are compared in turns, of a mount that was turned by 11 degrees since.
const STREET_SHARE: f32 = 0.00046;
const UNKNOWN_SHARE: f32 = 0.02;
/// Gain of an inertial gyro, 1 sigma: the difference that says nothing about the other one.
const INERTIAL_GAIN: f32 = 0.003;
/// Share of the roll and pitch rates, rad: a mount of 0.3 deg.
const MOUNT: f32 = 0.005;
/// Share of the rate that a mount by eye takes off, 1 sigma, which an inertial gyro of such a gain hides: of 3.4 deg.
const ASKEW: f32 = 0.0018;
const BLOCK: u32 = 10;
const BLOCKS: usize = (RATE_HZ / BLOCK) as usize;

/// The rates and errors of the inertial sensor, with which the fibre-optic gyro is compared.
#[derive(Debug, Clone, Copy)]
pub struct Beside {
    pub rate: Option<(Micros, f32)>,
    pub sigma: f32,
    /// The share of a turn that a gyro misses on the present slope.
    pub tilted: f32,
    /// Mean roll and pitch rate of the last second, both together, rad/s.
    pub leaning: f32,
    /// How much the gains of both gyros differ; `None` before they have turned.
    pub scale: Option<f32>,
}

impl Beside {
    pub const NOTHING: Self = Self { rate: None, sigma: 0.0, tilted: 0.0, leaning: 0.0, scale: None };

    /// Returns the share of the rate by which the gain may be off, 1 sigma.
    fn gain(&self) -> f32 {
        match (self.scale, self.rate) {
            (Some(scale), _) => {
                sqrt((scale * scale - INERTIAL_GAIN * INERTIAL_GAIN).max(0.0) + ASKEW * ASKEW)
            }
            (None, Some(_)) => UNKNOWN_SHARE,
            (None, None) => 0.0,
        }
    }
}

#[derive(Debug, Clone)]
pub(super) struct Comparison {
    beside: Beside,
    rejected: u32,
    /// Sums of the differences, rad/s, and their numbers: the newest block first.
    blocks: [(f32, u32); BLOCKS],
    steps: u32,
}

impl Comparison {
    pub const START: Self =
        Self { beside: Beside::NOTHING, rejected: 0, blocks: [(0.0, 0); BLOCKS], steps: 0 };

    pub fn take(&mut self, beside: Beside) {
        self.beside = beside;
    }

    /// Adds a step's rate, less the reading at rest, rad/s. Returns whether it differs as no vehicle turns.
    pub fn differs(&mut self, own: f32, time: Micros) -> bool {
        self.steps += 1;
        if self.steps == BLOCK {
            self.blocks.rotate_right(1);
            (self.blocks[0], self.steps) = ((0.0, 0), 0);
        }
        let at_once = |at: &Micros| at.0.abs_diff(time.0) <= 2 * PERIOD_US;
        let Some((_, rate)) = self.beside.rate.filter(|(at, _)| at_once(at)) else {
            self.rejected = 0;
            return false;
        };
        let off = own - rate;
        let [(sum, number), ..] = &mut self.blocks;
        (*sum, *number) = (*sum + off, *number + 1);
        let (always, share) = LIMIT;
        let differs = libm::fabsf(off) > always + share * libm::fabsf(rate);
        self.rejected = if differs { self.rejected.saturating_add(1) } else { 0 };
        differs
    }

    pub fn rejects(&self) -> bool {
        self.rejected <= DOUBTED
    }

    /// Returns whether the last second differs by more than an expected error can say.
    pub fn contradicts(&self) -> bool {
        self.off() > LARGEST_SIGMA
    }

    /// Returns by how much a second's mean rate may be off, 1 sigma; `clock` is the share by which the clock may be.
    pub fn sigma(&self, rate: f32, clock: f32) -> f32 {
        let Beside { tilted, leaning, .. } = self.beside;
        let gain = self.beside.gain();
        // An axis that is askew by an angle reads the cosine of a turn, and the sine of a roll.
        let askew = if self.beside.scale.is_some() { sqrt(2.0 * (gain - ASKEW)) } else { 0.0 };
        let street = if self.beside.rate.is_some() { tilted } else { STREET_SHARE };
        let share = sqrt(gain * gain + street * street) + clock;
        let (grows, leans, off) = (share * rate, (MOUNT + askew) * leaning, self.off());
        sqrt(grows * grows + leans * leans + off * off)
    }

    /// Returns the difference of the last second, rad/s; 0 within what the inertial gyro explains.
    fn off(&self) -> f32 {
        let (sum, number) = self.blocks.iter().fold((0.0, 0), |all, one| (all.0 + one.0, all.1 + one.1));
        let off = libm::fabsf(sum) / number.max(1) as f32;
        if number > BLOCK && off > GATE * self.beside.sigma { off } else { 0.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIGMA: f32 = 1e-3;

    /// A second beside an inertial gyro that shows this rate, and what is said of the last step.
    fn second(comparison: &mut Comparison, inertial: f32, own: f32) -> bool {
        let mut differs = false;
        for step in 0..u64::from(RATE_HZ) {
            let time = Micros(step * PERIOD_US);
            let before = comparison.beside;
            comparison.take(Beside { rate: Some((time, inertial)), sigma: SIGMA, ..before });
            differs = comparison.differs(own, time);
        }
        differs
    }

    #[test]
    fn a_step_that_no_vehicle_turns_is_rejected_for_two_seconds() {
        let mut comparison = Comparison::START;
        assert!(!second(&mut comparison, 0.5, 0.55));
        assert!(second(&mut comparison, 0.0, 3.1) && comparison.rejects());
        assert!(second(&mut comparison, 0.0, 3.1) && comparison.rejects());
        assert!(second(&mut comparison, 0.0, 3.1) && !comparison.rejects(), "it is used, and degraded");
    }

    #[test]
    fn what_the_inertial_gyro_does_not_explain_is_part_of_sigma() {
        let mut comparison = Comparison::START;
        second(&mut comparison, 0.5, 0.502);
        let agrees = comparison.sigma(0.0, 0.0);
        assert!(agrees < 1e-6, "two of its expected errors: {agrees}");
        second(&mut comparison, 0.5, 0.53);
        let off = comparison.sigma(0.0, 0.0);
        assert!((off - 0.03).abs() < 1e-4, "{off}");
    }

    #[test]
    fn a_gain_that_differs_is_a_share_of_the_rate_and_may_be_an_axis_that_is_askew() {
        let with = |scale: f32, leaning: f32| {
            let beside = Beside { scale: Some(scale), leaning, ..Beside::NOTHING };
            Comparison { beside, ..Comparison::START }.sigma(if leaning > 0.0 { 0.0 } else { 0.5 }, 0.0)
        };
        let beside = Beside { rate: Some((Micros(0), 0.5)), ..Beside::NOTHING };
        let alone = Comparison { beside, ..Comparison::START }.sigma(0.5, 0.0);
        assert!((alone / 0.01 - 1.0).abs() < 0.01, "not compared yet, perhaps turned in its mount: {alone}");
        let usual = with(INERTIAL_GAIN, 0.0);
        let hidden = 0.5 * (STREET_SHARE * STREET_SHARE + ASKEW * ASKEW).sqrt();
        assert!((usual / hidden - 1.0).abs() < 0.01, "the inertial one's own: {usual}");
        assert!((with(0.008, 0.0) / (0.5 * 0.0076) - 1.0).abs() < 0.02);
        let [upright, askew] = [INERTIAL_GAIN, 0.0055].map(|scale| with(scale, 0.1));
        assert!((upright - 0.1 * MOUNT).abs() < 1e-6 && (8e-3..12e-3).contains(&askew), "{upright} {askew}");
    }
}
