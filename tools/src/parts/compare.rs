//! This module compares the corrected yaw of a drive through a part with that of the direct replay. The part's
//! rounding changes the yaw; a bound of the change follows from the part's steps alone.
//!
//! With readings rounded to steps of q, and N samples of period dt after static initialisation:
//!
//! - **rounding**: errors are uniform within +-q/2, q / sqrt(12) rms, and independent of each other (the
//!   readings' own noise is wider than q). Their sum is a random walk: q / sqrt(12) x dt x
//!   sqrt(N).
//! - **bias**: the mean of the 300 samples of static initialisation is off by q / sqrt(12) /
//!   sqrt(300), and is subtracted from every sample: times N dt. Both terms count four times, as
//!   4 sigma.
//! - **network**, and the zero-rate updates after it: their response has no formula. It is measured on
//!   stand-ins instead of the part's samples: the recording with uniform noise of the same steps on all six channels,
//!   from [`STAND_INS`] seeds. The term is twice the largest change of the sum of the corrections.
//!
//! The bound is the sum of the three terms. For the rms of the rates the terms are q/2, four sigma of the bias, and
//! twice the rms change of the stand-ins' corrections. If a part rounds nothing, the bound is zero.

use super::Quantisation;
use crate::drive::recording::Recording;
use crate::drive::replay::{Replay, ReplayError, Step};
use crate::drive::wheel_frames::WheelFrames;
use crate::random::Random;
use gyronet::bias::STATIC_SAMPLES;
use gyronet::model::WindowNetwork;
use gyronet::pipeline::PipelineConfig;
use gyronet::sample::RATE_HZ;
use gyronet::units::{AngularRate, SpecificForce};

/// Number of seeds with which the network's response is measured.
pub const STAND_INS: u64 = 2;
const SIGMAS: f64 = 4.0;
const NETWORK_MARGIN: f64 = 2.0;

/// The difference of two replays of a drive.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Difference {
    /// Largest difference of the accumulated yaw, rad.
    pub yaw_largest: f64,
    /// Difference of the accumulated yaw at the end, rad.
    pub yaw_final: f64,
    /// RMS of the rates' difference, rad/s.
    pub rate_rms: f64,
    /// Number of rows that both replays have sent.
    pub rows: usize,
    /// Number of rows that only one replay has sent.
    pub unpaired: usize,
}

impl Difference {
    /// Compares the prompt rates.
    #[must_use]
    pub fn of_rates(direct: &Replay, via: &Replay) -> Self {
        Self::of(direct, via, |step| step.vehicle.prompt.rate)
    }

    /// Compares the corrections in the prompt rates.
    fn of_corrections(direct: &Replay, via: &Replay) -> Self {
        Self::of(direct, via, |step| step.vehicle.prompt.correction)
    }

    /// Compares two replays, each from its first step after static initialisation.
    fn of(direct: &Replay, via: &Replay, what: impl Fn(&Step) -> AngularRate) -> Self {
        let (mut difference, mut sum, mut squares) = (Self::default(), 0.0, 0.0);
        let (mut a, mut b) = (direct.steps[direct.start..].iter(), via.steps[via.start..].iter());
        let (mut left, mut right) = (a.next(), b.next());
        while let (Some(one), Some(other)) = (left, right) {
            if one.row != other.row {
                difference.unpaired += 1;
                if one.row < other.row {
                    left = a.next()
                } else {
                    right = b.next()
                }
                continue;
            }
            let off =
                f64::from(what(other).0.wrapping_sub(what(one).0)) / AngularRate::PER_RAD_PER_SEC as f64;
            sum += off / f64::from(RATE_HZ);
            squares += off * off;
            difference.rows += 1;
            difference.yaw_largest = difference.yaw_largest.max(sum.abs());
            (left, right) = (a.next(), b.next());
        }
        difference.unpaired += left.iter().chain(&right).count() + a.chain(b).count();
        difference.yaw_final = sum;
        difference.rate_rms = (squares / difference.rows.max(1) as f64).sqrt();
        difference
    }
}

/// The bound of the difference, by term.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Bound {
    /// Bound of the yaw from the rounding of each sample, rad.
    pub rounding: f64,
    /// Bound of the yaw from the static bias, rad.
    pub bias: f64,
    /// Bound of the yaw from the network's response, rad.
    pub network: f64,
    /// Bound of the rates' rms difference from all three, rad/s.
    pub rate_rms: f64,
}

impl Bound {
    /// Computes the bound from a part's steps; `direct` is the drive without the part. `tick` is called [`STAND_INS`]
    /// times for each row, unless nothing is rounded.
    ///
    /// # Errors
    /// [`ReplayError`], if static initialisation of a stand-in fails.
    pub fn new(
        quantisation: Quantisation,
        recording: &Recording,
        direct: &Replay,
        network: &mut impl WindowNetwork,
        mut tick: impl FnMut(),
    ) -> Result<Self, ReplayError> {
        if quantisation == Quantisation::default() {
            return Ok(Self::default());
        }
        let (dt, samples) = (1.0 / f64::from(RATE_HZ), (direct.steps.len() - direct.start) as f64);
        let sigma = quantisation.rate / 12f64.sqrt();
        let bias = SIGMAS * sigma / f64::from(STATIC_SAMPLES).sqrt();
        let mut answer = Difference::default();
        for seed in 0..STAND_INS {
            let (config, wheels) = (PipelineConfig::DEFAULT, WheelFrames::new(recording));
            let stand_in = stand_in(recording, quantisation, seed);
            let drive = Replay::run(&stand_in, &config, wheels, network, &mut tick)?;
            let one = Difference::of_corrections(direct, &drive);
            answer.yaw_largest = answer.yaw_largest.max(one.yaw_largest);
            answer.rate_rms = answer.rate_rms.max(one.rate_rms);
        }
        Ok(Self {
            rounding: SIGMAS * sigma * dt * samples.sqrt(),
            bias: bias * samples * dt,
            network: NETWORK_MARGIN * answer.yaw_largest,
            rate_rms: quantisation.rate / 2.0 + bias + NETWORK_MARGIN * answer.rate_rms,
        })
    }

    /// Returns the bound of the difference of the accumulated yaw anywhere in the drive, rad.
    #[must_use]
    pub fn yaw(&self) -> f64 {
        self.rounding + self.bias + self.network
    }

    /// Returns whether a difference is within the bound, with every row in both replays.
    #[must_use]
    pub fn holds(&self, difference: &Difference) -> bool {
        difference.unpaired == 0
            && difference.yaw_largest <= self.yaw()
            && difference.rate_rms <= self.rate_rms
    }
}

/// Returns the recording with uniform noise of a step's width on every channel.
fn stand_in(recording: &Recording, quantisation: Quantisation, seed: u64) -> Recording {
    let mut random = Random::new(seed, 0);
    let mut noise = |codes: f64| libm::round(random.between(-0.5, 0.5) * codes) as i32;
    let rate = quantisation.rate / AngularRate(1).rad_per_sec();
    let force = quantisation.force / SpecificForce(1).metre_per_sec2();
    let mut recording = recording.clone();
    for row in &mut recording.rows {
        row.sample.angular_rate.iter_mut().for_each(|code| code.0 = code.0.saturating_add(noise(rate)));
        row.sample.specific_force.iter_mut().for_each(|code| code.0 = code.0.saturating_add(noise(force)));
    }
    recording
}
