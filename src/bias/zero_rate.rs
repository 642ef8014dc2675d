//! Zero-rate updates estimate, while the vehicle stands, the error of the yaw rate that the network has not removed.
//!
//! A Kalman filter estimates two states from one-second means of the gyro, less its static bias and complete
//! correction:
//!
//! - the **bias** b also holds while driving: it is a random walk, and changes with temperature;
//! - the **offset** s holds for one standstill only: an idling engine shakes the sensor differently from a road. It
//!   does not average out during a stop: without it, a minute at a traffic light would make the filter too certain. It
//!   is the wider the less probable the standstill is, so a doubtful one teaches little.
//!
//! The mean of a second is b + s + noise, the noise by the spread of its ten means of [`BATCH`] samples: single
//! samples would not show that vibration averages out faster than white noise, nor that a low-pass makes samples
//! alike. A second counts only if the vehicle also stands in the next one: wheels show late that a car pulls away.
//!
//! A second is refused whose mean is off by more than four sigma: either the vehicle turns (a ferry, locked wheels) or
//! the bias is wrong (a knock). Until that is decided the difference is part of sigma (`doubt`). Static initialisation
//! only **claims** a bias: on a deck that turns, the turn is in it (`claim`).

mod claim;
mod config;
mod doubt;
mod parked;
mod turned;

pub use config::ZeroRateConfig;

use super::Spread;
use crate::heading::filter::{BIAS, Filter, GAIN, STOP};
use crate::sample::RATE_HZ;
use crate::sqrt::sqrt;
use crate::standstill::{Standing, StandstillSource};
use crate::units::AngularRate;
use claim::Claim;
use doubt::Doubt;
use parked::Parked;
use turned::Turned;

/// Samples in each of the means whose spread is taken.
const BATCH: u32 = 10;

/// Innovation of a second, over its sigma, above which the second is refused.
const GATE: f32 = 4.0;
/// Seconds over which the noise is averaged.
const NOISE_SECONDS: f32 = 8.0;
/// Seconds in which a bend begins or ends that is taken for a standstill.
const BEND_SECONDS: f32 = 10.0;
/// Variance of a refused second's mean, over that of those before, up to which it is steady.
const STEADY: f32 = 9.0;
/// Turn of a vehicle that somebody boards in a part of a second, rad.
const BOARDING: f32 = 1e-3;
/// Samples for which a standstill that the gyro has contradicted is not believed: a slide may turn now and then.
const DISTRUSTED: u32 = 10 * RATE_HZ;
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ZeroRateOutcome {
    /// The second before this one was used.
    Used,
    /// The second waits for the next one, because there was none before it.
    Waits,
    /// The gyro contradicts the source: nothing was used.
    Refused,
}

/// The mean of a second, its own variance, by which it is weighed, and the usual one, by which it is refused.
#[derive(Debug, Clone, Copy)]
struct Measurement {
    mean: f32,
    variance: f32,
    usual: f32,
}

#[derive(Debug, Clone)]
pub struct ZeroRate {
    config: ZeroRateConfig,
    filter: Filter,
    standing: Standing,
    /// The means of a second so far, and the sum and number of the samples of the next one.
    block: Spread,
    batch: (i64, u32),
    waiting: Option<Measurement>,
    noise: Option<f32>,
    refused: bool,
    /// The rate by which a refused standstill contradicts the bias so far, rad/s.
    against: f32,
    /// Samples for which this standstill is not believed after it was refused.
    distrusted_for: u32,
    doubt: Doubt,
    /// `None` once the bias is confirmed.
    claim: Option<Claim>,
    turned: Turned,
    turning: f32,
    parked: Parked,
    /// The vehicle has stood without wheels, and not driven off since: it cannot turn.
    is_parked: bool,
    since_walk: u32,
    /// Sigma of the change of the bias with temperature since the last update or [`Self::warmed`], rad/s.
    thermal: f32,
}

impl ZeroRate {
    /// Creates a filter after a static initialisation that showed this reading beyond the bias that is subtracted
    /// already, rad/s, where the sigma of that bias is known; `drift` is the spread of its seconds.
    pub fn claimed(config: ZeroRateConfig, reading: f32, sigma: Option<f32>, drift: f32) -> Self {
        let initial = config.after_rest(drift);
        let claim = Claim::new(reading, sigma.unwrap_or(config.mistaken), initial);
        let filter = Filter::new(initial * initial, config.standstill * config.standstill);
        Self { claim: Some(claim), ..Self::with(config, filter) }
    }

    /// Creates a filter after a static initialisation whose bias is beyond doubt.
    pub fn new(config: ZeroRateConfig) -> Self {
        let square = |sigma: f32| sigma * sigma;
        Self::with(config, Filter::new(square(config.initial), square(config.standstill)))
    }

    pub(crate) fn with(config: ZeroRateConfig, filter: Filter) -> Self {
        Self {
            config,
            filter,
            standing: Standing::UNKNOWN,
            block: Spread::EMPTY,
            batch: (0, 0),
            waiting: None,
            noise: None,
            refused: false,
            against: 0.0,
            distrusted_for: 0,
            doubt: Doubt::NONE,
            claim: None,
            turned: Turned::NONE,
            turning: 0.0,
            parked: Parked::NONE,
            is_parked: false,
            since_walk: 0,
            thermal: 0.0,
        }
    }

    pub(crate) fn filter(&mut self) -> &mut Filter {
        &mut self.filter
    }

    pub(crate) fn gain(&self) -> (f32, Option<f32>) {
        let variance = self.filter.variance::<GAIN>();
        (self.filter.get::<GAIN>(), (variance > 0.0).then(|| sqrt(variance)))
    }

    /// Adds the remaining rate of a complete sample (gyro less static bias less correction; `None` where it is not
    /// good). `thermal` is the sigma of the change of the bias with temperature since the last
    /// [`ZeroRateOutcome::Used`] or `warmed`, rad/s. Returns the outcome of a second at standstill with its last sample.
    pub fn observe(
        &mut self,
        left: Option<AngularRate>,
        standing: Standing,
        thermal: f32,
    ) -> Option<ZeroRateOutcome> {
        self.thermal = thermal;
        if let Some(claim) = &mut self.claim {
            claim.pass_on();
        }
        self.distrusted_for = if self.refused { DISTRUSTED } else { self.distrusted_for.saturating_sub(1) };
        self.since_walk += 1;
        if self.since_walk == RATE_HZ {
            self.since_walk = 0;
            self.walk();
        }
        let is_other =
            |before: Standing| before.source != standing.source || before.is_likely() != standing.is_likely();
        if is_other(self.standing) {
            self.stop_begins(standing);
        }
        if standing.source == StandstillSource::None {
            return None;
        }
        let Some(AngularRate(left)) = left else {
            // A gap makes the second incomplete, and cancels the pending one.
            self.restart();
            return None;
        };
        let (sum, count) = (self.batch.0 + i64::from(left), self.batch.1 + 1);
        self.batch = (sum, count);
        if count < BATCH {
            return None;
        }
        self.batch = (0, 0);
        let mean = (sum / i64::from(BATCH)) as i32;
        self.block.add(mean, mean as f32 / AngularRate::PER_RAD_PER_SEC);
        if self.block.count < RATE_HZ / BATCH {
            return None;
        }
        let block = core::mem::take(&mut self.block);
        Some(self.second(&block))
    }

    /// Checks the newest sample's rate, less static bias, and returns true once when it contradicts the wheels: they
    /// may be locked on ice. So the limit on the mean of a second holds for the turn in its parts, too: that sample's
    /// delayed rate, zero at standstill, has not been sent yet. Without wheels such a turn is part of sigma.
    pub fn contradicts_wheels(&mut self, rate: AngularRate) -> bool {
        let is_likely = self.standing.is_likely();
        self.is_parked |= is_likely && !self.standing.is_by_wheels();
        if !is_likely && !self.is_parked {
            self.turned = Turned::NONE;
            return false;
        }
        let off = rate.0.saturating_sub(self.bias().0);
        self.turned.add(off);
        let now = off as f32 / AngularRate::PER_RAD_PER_SEC;
        self.turning = self.turns();
        if self.is_parked {
            self.parked.add(now);
        }
        let turned = self.turned.angle();
        if !self.standing.is_by_wheels() || libm::fabsf(turned) <= self.turn_gate() {
            return false;
        }
        self.turned = Turned::NONE;
        self.against = self.against.max(libm::fabsf(turned)).max(libm::fabsf(now));
        if core::mem::replace(&mut self.refused, true) {
            return false;
        }
        // The next whole second shows whether the turn goes on.
        self.restart();
        true
    }

    /// Returns the rate of the newest two quarters of a second beyond their noise, since a standstill without wheels, rad/s.
    fn turns(&self) -> f32 {
        let Some(noise) = self.noise.filter(|_| self.is_parked && !self.standing.is_by_wheels()) else {
            return 0.0;
        };
        let least = self.config.noise * self.config.noise;
        self.turned.newest_rate(GATE * sqrt(noise.max(least)))
    }

    /// Returns whether the wheels stand while the gyro shows a turn.
    pub fn contradicted(&self) -> bool {
        self.standing.is_by_wheels() && self.is_refused()
    }

    /// Returns whether the gyro contradicts that the vehicle stands, or has just done so.
    pub fn is_refused(&self) -> bool {
        self.refused || self.distrusted_for > 0
    }

    /// Returns the largest turn of a part of a second at rest, rad, with the shake of somebody who boards.
    fn turn_gate(&self) -> f32 {
        GATE * sqrt(self.innovation_variance(BOARDING * BOARDING))
    }

    /// Returns the variance of the difference between the mean of a second, which has this variance, and the filter.
    fn innovation_variance(&self, measured: f32) -> f32 {
        let (both, offset) = (self.filter.bias_and_stop(), self.filter.variance::<STOP>());
        (self.bias_variance() + 2.0 * both + offset + measured).max(measured)
    }

    /// Takes the mean of three more seconds that static initialisation accepts, and the spread of its seconds, rad/s.
    pub fn rest(&mut self, mean: f32, drift: f32) {
        if let Some(claim) = &mut self.claim {
            claim.rest(mean, self.config.after_rest(drift));
        }
    }

    /// The vehicle moves: what it stood on did not turn, so its newest reading is the bias, unless it turned before.
    pub fn moves(&mut self) {
        self.turning = 0.0;
        if core::mem::take(&mut self.is_parked) {
            self.leave();
        }
        let Some((mean, initial)) = self.claim.as_mut().and_then(Claim::moves) else { return };
        self.claim = None;
        let ZeroRateConfig { standstill, noise, max_bias, .. } = self.config;
        // Each of the two means has an offset and a noise of its own.
        let variance = self.filter.variance::<BIAS>()
            + initial * initial
            + 2.0 * (standstill * standstill + noise * noise);
        if libm::fabsf(mean - self.filter.get::<BIAS>()) > GATE * sqrt(variance) {
            self.filter.restart::<BIAS>(within(mean, max_bias), initial * initial);
            self.filter.restart::<STOP>(0.0, 0.0);
            self.doubt = Doubt::NONE;
        }
    }

    /// Returns whether a second source has confirmed the bias: the vehicle has driven off, or a later standstill agrees.
    pub fn is_confirmed(&self) -> bool {
        self.claim.is_none()
    }

    pub fn restart(&mut self) {
        self.block = Spread::EMPTY;
        self.batch = (0, 0);
        self.waiting = None;
    }

    /// Returns the bias to subtract; while the wheels stand, it contains the offset of this standstill.
    pub fn bias(&self) -> AngularRate {
        let own = self.filter.get::<BIAS>();
        let bias = if self.stands() { own + self.filter.get::<STOP>() } else { own };
        let bias = within(bias, 2.0 * self.config.max_bias);
        AngularRate(libm::roundf(bias * AngularRate::PER_RAD_PER_SEC) as i32)
    }

    /// Returns the bias when driving, without the offset of a standstill, and its uncertainty, 1 sigma, rad/s.
    pub fn when_driving(&self) -> [f32; 2] {
        [self.filter.get::<BIAS>(), self.sigma()]
    }

    /// Returns the uncertainty of the bias when driving, 1 sigma, rad/s; with it the contradiction that is not decided.
    pub fn sigma(&self) -> f32 {
        let off = self.doubt.off(self.filter.get::<BIAS>());
        let off = if self.refused && self.standing.is_likely() { off.max(self.against) } else { off };
        let off = off.max(self.turning);
        let hidden = self.claim.as_ref().map_or(0.0, Claim::variance);
        sqrt(self.bias_variance() + off * off + hidden).min(self.config.max_bias)
    }

    pub fn is_doubted(&self) -> bool {
        self.doubt.is_some()
    }

    /// Returns the variance of the bias when driving, with that of its change with temperature, (rad/s)^2.
    fn bias_variance(&self) -> f32 {
        let largest = self.config.max_bias;
        (self.filter.variance::<BIAS>() + self.thermal * self.thermal).min(largest * largest)
    }

    pub fn stands(&self) -> bool {
        self.standing.is_by_wheels() && !self.is_refused()
    }

    fn stop_begins(&mut self, standing: Standing) {
        self.standing = standing;
        (self.refused, self.against, self.distrusted_for) = (false, 0.0, 0);
        self.restart();
        // It is the same stop, with the same offset, until the vehicle moves.
        if self.is_parked && !standing.is_by_wheels() {
            return;
        }
        self.end_doubt();
        let offset = self.config.standstill * self.config.standstill + self.mistaken();
        self.filter.restart::<STOP>(0.0, offset);
    }

    fn leave(&mut self) {
        let turned = core::mem::replace(&mut self.parked, Parked::NONE).before_pulling_away();
        let ZeroRateConfig { noise, standstill, .. } = self.config;
        let noise = self.noise.unwrap_or_default().max(noise * noise) + BOARDING * BOARDING;
        let limit = GATE * sqrt(self.bias_variance() + standstill * standstill + noise);
        if let Some(turned) = turned.filter(|turned| libm::fabsf(*turned) > limit) {
            self.doubt.add(self.filter.get::<BIAS>() + turned, true);
        }
        self.end_doubt();
    }

    /// Compares a stop that contradicted the bias with earlier ones, and replaces the bias once enough agree.
    fn end_doubt(&mut self) {
        let ZeroRateConfig { standstill, noise, max_bias, .. } = self.config;
        // Each stop has an offset of its own.
        let variance = standstill * standstill + noise * noise;
        // Ground on which the vehicle stops says more than what it started on.
        let is_claim = self.claim.as_ref().is_some_and(|claim| claim.has_moved);
        if let Some(mean) = self.doubt.end_stop(GATE * sqrt(2.0 * variance), is_claim) {
            self.claim = None;
            self.filter.restart::<BIAS>(within(mean, max_bias), variance);
            self.filter.restart::<STOP>(self.filter.get::<STOP>(), 0.0);
        }
    }

    fn walk(&mut self) {
        let ZeroRateConfig { walk, max_bias, .. } = self.config;
        let variance = self.filter.variance::<BIAS>() + walk * walk;
        self.filter.put_variance::<BIAS>(variance.min(max_bias * max_bias));
        if self.standing.source != StandstillSource::None && !self.standing.is_likely() {
            let bends = self.filter.variance::<STOP>() + self.mistaken() / BEND_SECONDS;
            self.filter.put_variance::<STOP>(bends.min(max_bias * max_bias));
        }
    }

    /// Returns the variance of the yaw rate of what is taken for a standstill, (rad/s)^2.
    fn mistaken(&self) -> f32 {
        (1.0 - self.standing.probability) * self.config.mistaken * self.config.mistaken
    }

    fn second(&mut self, block: &Spread) -> ZeroRateOutcome {
        let own = block.variance() / (block.count - 1) as f32;
        let before = self.noise.unwrap_or(own);
        let usual = before + (own - before) / NOISE_SECONDS;
        self.noise = Some(usual);
        let least = self.config.noise * self.config.noise;
        let mean = block.mean_code() as f32 / AngularRate::PER_RAD_PER_SEC;
        let measured = Measurement { mean, variance: own.max(least), usual: usual.max(own).max(least) };
        self.refused = self.is_off(&measured);
        self.against = if self.refused {
            libm::fabsf(mean - self.filter.get::<BIAS>() - self.filter.get::<STOP>())
        } else {
            0.0
        };
        // No vehicle that pulls away turns as steadily as one at rest.
        let is_steady = self.refused && own <= STEADY * before.max(least);
        let before = self.waiting.replace(measured);
        match before {
            Some(before) if !self.is_off(&before) => self.update(before),
            Some(before) => self.contradict(before, false),
            None => {}
        }
        if is_steady {
            self.contradict(measured, true);
            self.waiting = None;
        }
        match before {
            _ if self.refused => ZeroRateOutcome::Refused,
            Some(_) => ZeroRateOutcome::Used,
            None => ZeroRateOutcome::Waits,
        }
    }

    fn is_off(&self, measured: &Measurement) -> bool {
        let step = measured.mean - self.filter.get::<BIAS>() - self.filter.get::<STOP>();
        libm::fabsf(step) > GATE * sqrt(self.innovation_variance(measured.usual))
    }

    fn contradict(&mut self, measured: Measurement, is_steady: bool) {
        if self.standing.is_likely() {
            self.doubt.add(measured.mean, is_steady);
        }
    }

    /// Takes a second that agrees with the bias: it withdraws a doubt, unless the stops that contradict are nearer.
    fn agree(&mut self, mean: f32) {
        let own = self.filter.get::<BIAS>() + self.filter.get::<STOP>();
        if self.doubt.is_nearer(mean, libm::fabsf(mean - own)) {
            return;
        }
        self.doubt = Doubt::NONE;
        self.claim = self.claim.take().filter(|claim| !claim.has_moved);
    }

    fn update(&mut self, measured: Measurement) {
        self.take_thermal();
        if self.standing.is_likely() {
            self.agree(measured.mean);
        }
        self.filter.standstill(measured.mean, measured.variance);
        self.bound();
    }

    /// Adds the variance by which temperature has changed a bias that courses teach, from its sigma, once that is the larger
    /// one; returns it. Added sample by sample it would be too little, because such changes have one sign.
    pub(crate) fn warmed(&mut self, thermal: f32) -> Option<f32> {
        let variance = thermal * thermal;
        (variance > self.filter.variance::<BIAS>()).then(|| {
            self.thermal = thermal;
            self.take_thermal();
            variance
        })
    }

    fn take_thermal(&mut self) {
        self.filter.put_variance::<BIAS>(self.bias_variance());
        self.thermal = 0.0;
    }

    fn bound(&mut self) {
        let largest = self.config.max_bias;
        self.filter.put::<BIAS>(within(self.filter.get::<BIAS>(), largest));
        self.filter.put::<STOP>(within(self.filter.get::<STOP>(), largest));
    }
}

/// Bounds a value to +-`largest`. (`clamp` would panic on bounds that a configuration has made NaN.)
fn within(value: f32, largest: f32) -> f32 {
    value.max(-largest).min(largest)
}
