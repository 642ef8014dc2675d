//! Zero-rate updates estimate, while the vehicle stands, the error of the yaw rate that the network has not removed.
//!
//! A Kalman filter estimates two states from one-second means of the gyro, less its static bias and its
//! complete correction:
//!
//! - the **bias** b also holds while driving: it is a random walk, and changes with temperature;
//! - the **offset** s holds for one standstill only: an idling engine shakes the sensor differently from
//!   a road, which shifts the mean of gyro and network. The shift differs from stop to stop and does not
//!   average out during a stop: without this state, a minute at a traffic light would make the filter
//!   too certain of a bias that does not hold on the road. It is the wider the less probable the standstill is:
//!   what is taken for one may be a smooth bend, so a doubtful standstill teaches little.
//!
//! The mean of a second is modelled as z = b + s + noise, with the noise taken from the spread of the ten means of
//! [`BATCH`] samples in it: the spread of single samples would not show that an engine's vibration averages out
//! faster than white noise, nor that a low-pass correction makes samples alike. A second counts only if the vehicle
//! also stands in the next one, because wheel sensors show late that a car pulls away.
//!
//! A second is refused whose mean is off by more than four sigma of the filter: then either the vehicle turns (a ferry,
//! a turntable, wheels that are locked or creep below their threshold) or the bias is wrong (initialised during such a
//! turn). From its first part on and until that is decided the difference is part of sigma. A stop that agrees with the
//! bias withdraws the doubt; [`AGREEING_STOPS`] that contradict it and agree with each other replace the bias.
//!
//! Static initialisation only **claims** a bias: on a deck that turns, the turn is in it. A vehicle drives off from ground
//! that stands. So the reading decides that static initialisation would accept last, within [`CONFIRMING`] samples before
//! the vehicle begins to move; or the next stop. Until then all that the deck may turn by is part of sigma.

use super::Spread;
use crate::heading::filter::{BIAS, Filter, GAIN, STOP};
use crate::sample::RATE_HZ;
use crate::sqrt::sqrt;
use crate::standstill::{Standing, StandstillSource};
use crate::units::AngularRate;

/// Describes the noise of part and vehicle. All values are 1 sigma.
#[derive(Debug, Clone, Copy)]
pub struct ZeroRateConfig {
    /// Bias left by static initialisation, rad/s.
    pub initial: f32,
    /// Random walk of the bias, rad/s per square root of a second.
    pub walk: f32,
    /// Offset of a standstill, rad/s.
    pub standstill: f32,
    /// Least noise of a one-second mean, rad/s: a smaller spread is raised to it.
    pub noise: f32,
    /// Yaw rate of a vehicle that is taken for a standing one, rad/s: a bend of 6 km at 110 km/h. The smoothest driven
    /// seconds of the training drives turn by up to twice as much, RMS by half as much.
    pub mistaken: f32,
    /// Largest bias, and largest uncertainty of it, rad/s.
    pub max_bias: f32,
}

impl ZeroRateConfig {
    /// The noise of a MEMS part on a car. The walk is the one published for an Xsens MTi-100 (OpenVINS,
    /// `config/kaist`); the noise is less than half of that part's 1.7e-4 rad/s/sqrt(Hz) over a second, so that a
    /// better part benefits. The offset is measured: between standing and driving the mean error of the corrected
    /// rate changes by 1.3e-4 rad/s RMS over the five training drives and the validation drive, 0.9e-4 on the latter
    /// alone. Static initialisation may be off by 5 deg/s, so the bias may change by as much.
    pub const DEFAULT: Self =
        Self { initial: 1e-4, walk: 1e-5, standstill: 1.4e-4, noise: 5e-5, mistaken: 5e-3, max_bias: 0.1 };
}

impl ZeroRateConfig {
    /// Returns the sigma of the bias by three seconds whose means spread so much: more than noise is a change that goes on.
    fn initial_of(&self, drift: f32) -> f32 {
        self.initial.max(drift - 5.0 * self.initial)
    }
}

/// Samples in each of the means whose spread is taken.
const BATCH: u32 = 10;

/// Low-order bits that are dropped when the turn at standstill is summed.
const TURNED_SHIFT: u32 = AngularRate::FRACTION_BITS - 20;

/// Innovation of a second, over its sigma, above which the second is refused.
const GATE: f32 = 4.0;
/// Seconds over which the noise is averaged.
const NOISE_SECONDS: f32 = 8.0;
/// Turn of a vehicle that somebody boards in a part of a second, rad.
const BOARDING: f32 = 1e-3;
/// Refused seconds that make a stop contradict the bias.
const REFUSED_SECONDS: u8 = 2;
/// Stops that contradict the bias and agree with each other before they replace it.
const AGREEING_STOPS: u8 = 3;
/// Samples for which a standstill that the gyro has contradicted is not believed: a slide may turn now and then.
const DISTRUSTED: u32 = 10 * RATE_HZ;
/// Samples after three seconds at rest within which the vehicle begins to move from there.
const CONFIRMING: u32 = 10 * RATE_HZ;

/// Says how a whole second at standstill was used.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum ZeroRateOutcome {
    /// The second before this one was used.
    Used,
    /// The second waits for the next one, because there was none before it.
    Waits,
    /// The gyro contradicts the source: nothing was used.
    Refused,
}

/// Holds the mean of a second and the variance of that mean: its own, by which it is weighed, and that of the seconds
/// around it, by which it is refused, since its own is small or large by chance.
#[derive(Debug, Clone, Copy)]
struct Measurement {
    mean: f32,
    variance: f32,
    usual: f32,
}

/// Seconds that contradict the bias: their mean in this stop, and that of earlier stops that agree with each other.
#[derive(Debug, Clone, Copy, Default)]
struct Doubt {
    mean: f32,
    seconds: u8,
    earlier: f32,
    stops: u8,
}

/// A bias that nothing but one standstill has shown.
#[derive(Debug, Clone, Copy)]
struct Claim {
    /// What the deck may turn by: the reading at rest, and the sigma of what earlier drives or the part's kind let
    /// expect of it, rad/s.
    reading: f32,
    expected: f32,
    /// The newest three seconds that static initialisation would accept: their mean and the spread of its seconds, rad/s, and
    /// the samples for which they are evidence.
    newest: (f32, f32),
    counts_for: u32,
    /// The vehicle has moved since.
    has_moved: bool,
}

/// Estimates the bias that remains after static initialisation and network.
#[derive(Debug, Clone)]
pub struct ZeroRate {
    config: ZeroRateConfig,
    filter: Filter,
    standing: Standing,
    /// The means of a second so far, and the sum and number of the samples of the next one.
    block: Spread,
    batch: (i64, u32),
    waiting: Option<Measurement>,
    /// Mean variance of the seconds so far.
    noise: Option<f32>,
    refused: bool,
    /// The rate by which a refused standstill contradicts the bias so far, rad/s.
    against: f32,
    /// Samples for which this standstill is not believed after it was refused.
    distrusted_for: u32,
    doubt: Doubt,
    /// `None` once the bias is confirmed.
    claim: Option<Claim>,
    /// Turn at standstill by the newest samples, 2^-20 rad/s x samples: in the current quarter of a second and in the
    /// four before it. Then the samples left in the current quarter.
    turned: [i32; 5],
    turning_for: u8,
    since_walk: u32,
    /// Sigma of the change of the bias with temperature since the last update, rad/s.
    thermal: f32,
}

impl ZeroRate {
    /// Creates a filter after a static initialisation that showed this reading beyond the bias that is subtracted
    /// already, rad/s, where the sigma of that bias is known; `drift` is the spread of its seconds.
    #[must_use]
    pub fn claimed(config: ZeroRateConfig, reading: f32, sigma: Option<f32>, drift: f32) -> Self {
        let expected = sigma.unwrap_or(config.mistaken);
        let claim =
            Claim { reading, expected, newest: (0.0, drift), counts_for: CONFIRMING, has_moved: false };
        let initial = config.initial_of(drift);
        Self { claim: Some(claim), ..Self::new(ZeroRateConfig { initial, ..config }) }
    }

    /// Creates a filter after a static initialisation whose bias is beyond doubt.
    #[must_use]
    pub fn new(config: ZeroRateConfig) -> Self {
        let square = |sigma: f32| sigma * sigma;
        Self::with(config, Filter::new(square(config.initial), square(config.standstill)))
    }

    /// Creates it with a filter that has learnt already.
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
            doubt: Doubt::default(),
            claim: None,
            turned: [0; 5],
            turning_for: 0,
            since_walk: 0,
            thermal: 0.0,
        }
    }

    /// Returns the filter, for what is learnt in motion.
    pub(crate) fn filter(&mut self) -> &mut Filter {
        &mut self.filter
    }

    /// Returns the learnt gain, and its sigma once it is estimated.
    pub(crate) fn gain(&self) -> (f32, Option<f32>) {
        let variance = self.filter.variance::<GAIN>();
        (self.filter.get::<GAIN>(), (variance > 0.0).then(|| sqrt(variance)))
    }

    /// Adds the remaining rate of a complete sample (gyro less static bias less the network's estimate; `None` where
    /// that is not good). `standing` is the judgement of the standstill, and `thermal` the sigma of the change of the
    /// bias with temperature since the last outcome [`ZeroRateOutcome::Used`], rad/s. Returns the outcome of a second
    /// at standstill when one is complete.
    pub fn observe(
        &mut self,
        left: Option<AngularRate>,
        standing: Standing,
        thermal: f32,
    ) -> Option<ZeroRateOutcome> {
        self.thermal = thermal;
        if let Some(claim) = &mut self.claim {
            claim.counts_for = claim.counts_for.saturating_sub(1);
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
        if self.block.count() < RATE_HZ / BATCH {
            return None;
        }
        let block = core::mem::take(&mut self.block);
        Some(self.second(&block))
    }

    /// Checks the newest sample's rate, less static bias, before it is complete. Returns true once when the rate
    /// contradicts the wheels.
    ///
    /// A vehicle may slide with its wheels locked. The limit on the mean of a second at standstill therefore also
    /// applies to the turn in parts of a second: when a sample exceeds it, that sample's delayed rate, which is zero
    /// at standstill, has not been sent yet.
    pub fn contradicts_wheels(&mut self, rate: AngularRate) -> bool {
        if !self.standing.is_by_wheels() {
            self.turned = [0; 5];
            return false;
        }
        if self.turning_for == 0 {
            // Any second that ends now lies within the five quarters.
            self.turned.rotate_right(1);
            (self.turned[0], self.turning_for) = (0, RATE_HZ as u8 / 4);
        }
        // A sum of 125 of them fits.
        self.turned[0] += rate.0.saturating_sub(self.bias().0) >> TURNED_SHIFT;
        self.turning_for -= 1;
        let per_rad = (AngularRate::PER_RAD_PER_SEC / (1 << TURNED_SHIFT) as f32) * RATE_HZ as f32;
        let turned = self.turned.iter().sum::<i32>() as f32 / per_rad;
        if libm::fabsf(turned) <= self.turn_gate() {
            return false;
        }
        self.turned = [0; 5];
        let now = rate.0.saturating_sub(self.bias().0) as f32 / AngularRate::PER_RAD_PER_SEC;
        self.against = self.against.max(libm::fabsf(turned)).max(libm::fabsf(now));
        if core::mem::replace(&mut self.refused, true) {
            return false;
        }
        // The next whole second shows whether the turn goes on.
        self.restart();
        true
    }

    /// Returns whether the wheels stand while the gyro shows a turn.
    #[must_use]
    pub fn contradicted(&self) -> bool {
        self.standing.is_by_wheels() && self.is_refused()
    }

    /// Returns whether the gyro contradicts that the vehicle stands, or has just done so.
    #[must_use]
    pub fn is_refused(&self) -> bool {
        self.refused || self.distrusted_for > 0
    }

    /// Returns the largest turn of a part of a second at standstill, rad: as for a second, with the shake of a vehicle
    /// that somebody boards.
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
        if let Some(claim) = self.claim.as_mut().filter(|claim| !claim.has_moved) {
            (claim.newest, claim.counts_for) = ((mean, drift), CONFIRMING);
        }
    }

    /// Notes that the vehicle moves: what it has just stood on did not turn, so its newest reading there is the bias.
    pub fn moves(&mut self) {
        let Some(claim) = &mut self.claim else { return };
        claim.has_moved = true;
        if claim.counts_for == 0 {
            return;
        }
        let (mean, drift) = claim.newest;
        self.claim = None;
        let ZeroRateConfig { standstill, noise, max_bias, .. } = self.config;
        let initial = self.config.initial_of(drift);
        // Each of the two means has an offset and a noise of its own.
        let variance = self.filter.variance::<BIAS>()
            + initial * initial
            + 2.0 * (standstill * standstill + noise * noise);
        if libm::fabsf(mean - self.filter.get::<BIAS>()) > GATE * sqrt(variance) {
            self.filter.restart::<BIAS>(within(mean, max_bias), initial * initial);
            self.filter.restart::<STOP>(0.0, 0.0);
            self.doubt = Doubt::default();
        }
    }

    /// Returns whether a second source has confirmed the bias: the vehicle has driven off, or a later standstill agrees.
    #[must_use]
    pub fn is_confirmed(&self) -> bool {
        self.claim.is_none()
    }

    /// Drops the current second, which a gap has cut short.
    pub fn restart(&mut self) {
        self.block = Spread::EMPTY;
        self.batch = (0, 0);
        self.waiting = None;
    }

    /// Returns the bias to subtract; while the wheels stand, it contains the offset of this standstill.
    #[must_use]
    pub fn bias(&self) -> AngularRate {
        let own = self.filter.get::<BIAS>();
        let bias = if self.stands() { own + self.filter.get::<STOP>() } else { own };
        let bias = within(bias, 2.0 * self.config.max_bias);
        AngularRate(libm::roundf(bias * AngularRate::PER_RAD_PER_SEC) as i32)
    }

    /// Returns the uncertainty of the bias when driving, 1 sigma, rad/s; with it the contradiction that is not decided.
    #[must_use]
    pub fn sigma(&self) -> f32 {
        let Doubt { mean, seconds, earlier, stops } = self.doubt;
        let bias = self.filter.get::<BIAS>();
        let off = |mean: f32, is_doubt: bool| if is_doubt { libm::fabsf(mean - bias) } else { 0.0 };
        let off = off(mean, seconds >= REFUSED_SECONDS).max(off(earlier, stops > 0));
        let off = if self.refused && self.standing.is_likely() { off.max(self.against) } else { off };
        let hidden =
            self.claim.map_or(0.0, |claim| claim.reading * claim.reading + claim.expected * claim.expected);
        sqrt(self.bias_variance() + off * off + hidden).min(self.config.max_bias)
    }

    /// Returns whether standstills contradict the bias.
    #[must_use]
    pub fn is_doubted(&self) -> bool {
        self.doubt.seconds >= REFUSED_SECONDS || self.doubt.stops > 0
    }

    /// Returns the variance of the bias when driving: that of the filter, and that of the change with temperature since
    /// the last update, (rad/s)^2.
    fn bias_variance(&self) -> f32 {
        let largest = self.config.max_bias;
        (self.filter.variance::<BIAS>() + self.thermal * self.thermal).min(largest * largest)
    }

    /// Returns whether the wheels stand and the gyro does not contradict them.
    #[must_use]
    pub fn stands(&self) -> bool {
        self.standing.is_by_wheels() && !self.is_refused()
    }

    fn stop_begins(&mut self, standing: Standing) {
        self.end_doubt();
        self.standing = standing;
        (self.refused, self.against, self.distrusted_for) = (false, 0.0, 0);
        self.restart();
        let ZeroRateConfig { standstill, mistaken, .. } = self.config;
        let offset = standstill * standstill + (1.0 - standing.probability) * mistaken * mistaken;
        self.filter.restart::<STOP>(0.0, offset);
    }

    /// Compares a stop that contradicted the bias with earlier ones, and replaces the bias once enough agree.
    fn end_doubt(&mut self) {
        let Doubt { mean, seconds, earlier, stops } = self.doubt;
        self.doubt.seconds = 0;
        if seconds < REFUSED_SECONDS {
            return;
        }
        let ZeroRateConfig { standstill, noise, .. } = self.config;
        // Each has an offset of its own.
        let variance = standstill * standstill + noise * noise;
        let agrees = stops > 0 && libm::fabsf(mean - earlier) <= GATE * sqrt(2.0 * variance);
        let (stops, before) = if agrees { (stops + 1, earlier) } else { (1, mean) };
        let mean = before + (mean - before) / f32::from(stops);
        self.doubt = Doubt { earlier: mean, stops, ..Doubt::default() };
        // Ground on which the vehicle stops says more than what it started on.
        let enough = if self.claim.is_some_and(|claim| claim.has_moved) { 1 } else { AGREEING_STOPS };
        if stops >= enough {
            self.claim = None;
            self.filter.restart::<BIAS>(within(mean, self.config.max_bias), variance);
            self.filter.restart::<STOP>(self.filter.get::<STOP>(), 0.0);
            self.doubt = Doubt::default();
        }
    }

    /// Adds a second of the bias' random walk to its variance.
    fn walk(&mut self) {
        let ZeroRateConfig { walk, max_bias, .. } = self.config;
        let variance = self.filter.variance::<BIAS>() + walk * walk;
        self.filter.put_variance::<BIAS>(variance.min(max_bias * max_bias));
    }

    fn second(&mut self, block: &Spread) -> ZeroRateOutcome {
        let own = block.variance() / (block.count() - 1) as f32;
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
        let before = self.waiting.replace(measured);
        match before {
            Some(before) if !self.is_off(&before) => self.update(before),
            Some(before) => self.contradict(before),
            None => {}
        }
        match before {
            _ if self.refused => ZeroRateOutcome::Refused,
            Some(_) => ZeroRateOutcome::Used,
            None => ZeroRateOutcome::Waits,
        }
    }

    /// Returns whether a second is off by more than the filter's own sigma explains.
    fn is_off(&self, measured: &Measurement) -> bool {
        let step = measured.mean - self.filter.get::<BIAS>() - self.filter.get::<STOP>();
        libm::fabsf(step) > GATE * sqrt(self.innovation_variance(measured.usual))
    }

    /// Notes a second at a probable standstill that contradicts the bias.
    fn contradict(&mut self, measured: Measurement) {
        if !self.standing.is_likely() {
            return;
        }
        let Doubt { mean, seconds, .. } = &mut self.doubt;
        *seconds = seconds.saturating_add(1);
        *mean += (measured.mean - *mean) / f32::from(*seconds);
    }

    /// Notes a second at a probable standstill that agrees with the bias.
    fn agree(&mut self) {
        self.doubt = Doubt::default();
        self.claim = self.claim.filter(|claim| !claim.has_moved);
    }

    /// Applies the Kalman filter's measurement update.
    fn update(&mut self, measured: Measurement) {
        self.take_thermal();
        if self.standing.is_likely() {
            self.agree();
        }
        self.filter.standstill(measured.mean, measured.variance);
        self.bound();
    }

    /// Adds the change with temperature to the variance of the bias.
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
