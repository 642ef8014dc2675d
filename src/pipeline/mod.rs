//! Samples in, corrected yaw rate and what it is worth out. This file owns the order of things and
//! nothing else; no module below it knows its neighbours. No clock is read: the samples' own
//! time stamps drive everything.
//!
//! The network runs beside the samples, not inside their turn: [`Output::window`] hands out a
//! window when one is due, whoever has time runs it, and [`Pipeline::deliver`] takes the
//! estimate back. It is used exactly [`crate::compensate::Mode::delay`] samples after the
//! window's newest one, so fast and slow machines emit the same frames.

mod config;
mod known;
mod output;
mod told;

pub use config::PipelineConfig;
pub use output::{DueWindow, Output, Owed, YawRate};

use known::{Known, raw};

use crate::align::{AlignError, Aligner};
use crate::bias::{Proof, Second, StaticInit, ZeroPoint, ZeroRate};
use crate::compensate::{Compensator, Emitted, Implausible, Settled};
use crate::health::{Counters, Faults, Status, count};
use crate::model::Estimate;
use crate::mounting::Rotation;
use crate::sample::{Frame, ImuSample, Standstill, WHEELS, WheelSample};
use crate::seal::seal;
use crate::uncertainty::Uncertainty;
use crate::units::{AngularRate, Yaw};
use crate::window::{self, Features, WINDOW, Window};

/// The whole way of the data for one vehicle.
#[derive(Debug, Clone)]
pub struct Pipeline {
    config: PipelineConfig,
    /// Of the mounting as it was configured.
    mounting_seal: u32,
    aligner: Aligner,
    static_init: StaticInit,
    known: Option<Known>,
    window: Window,
    since_window: u32,
    /// Tick of the window that is out, and its estimate when delivered.
    out: Option<(u32, Option<Estimate>)>,
    compensator: Compensator,
    uncertainty: Uncertainty,
    believed: bool,
    /// Samples for which the vehicle has stood.
    stood: u32,
    prompt_yaw: Yaw,
    navigation_yaw: Yaw,
    /// What was wrong with the newest estimate.
    estimate_faults: Faults,
    /// Samples until a gap is a whole window away.
    gap_within: u32,
    wheels: Option<WheelSample>,
    /// The newest sample as the networks see it.
    inertial: Option<Features>,
    /// Wheels that have had a speed.
    wheels_seen: [bool; WHEELS],
    counters: Counters,
}

impl Pipeline {
    /// Before the first sample.
    #[must_use]
    pub fn new(config: PipelineConfig) -> Self {
        Self {
            config,
            mounting_seal: seal(&config.mounting),
            aligner: Aligner::default(),
            static_init: StaticInit::new(config.static_init),
            known: None,
            window: Window::EMPTY,
            since_window: 0,
            out: None,
            compensator: Compensator::new(config.compensate),
            uncertainty: Uncertainty::new(config.uncertainty),
            believed: false,
            stood: 0,
            prompt_yaw: Yaw::default(),
            navigation_yaw: Yaw::default(),
            estimate_faults: Faults::NONE,
            gap_within: 0,
            wheels: None,
            inertial: None,
            wheels_seen: [false; WHEELS],
            counters: Counters::default(),
        }
    }

    /// Takes one sample of the inertial sensor.
    ///
    /// # Errors
    /// [`AlignError`] when its time stamp has no place; it is counted and not used. Unless
    /// it was a duplicate, the samples after it say [`Faults::GAP`] for as long as after a missing one.
    pub fn process(&mut self, sample: ImuSample) -> Result<Output, AlignError> {
        let mut frame = self.aligner.process(sample).inspect_err(|error| self.refuse(*error))?;
        frame.sample = self.config.mounting.sample(&sample);
        count(&mut self.counters.samples, 1);
        if frame.missing > 0 {
            count(&mut self.counters.missing, frame.missing);
            self.gap();
        }
        if sample.clipped {
            count(&mut self.counters.clipped, 1);
            self.break_window();
        }
        let implausible = self.use_estimate(frame.tick);
        let quiet = self.known.as_mut().is_some_and(|known| known.quiet.process(&frame.sample));
        let (prompt, navigation, settled, refused) = match self.turned(&mut frame.sample) {
            None => {
                let (raw, refused) = self.initialise(&frame);
                (raw, raw, None, refused)
            }
            Some(zero) => {
                let (prompt, navigation, settled) = self.correct(&frame, &zero, quiet);
                (prompt, navigation, settled, None)
            }
        };
        let vehicle = self.vehicle(&prompt, &navigation, &frame);
        let window = self.due_window(frame.tick);
        self.gap_within = self.gap_within.saturating_sub(1);
        Ok(Output { prompt, navigation, vehicle, settled, window, refused, implausible })
    }

    /// Takes what is known of the wheels, from [`crate::can::wheel::WheelReceiver`]: to be called
    /// before each sample where wheel speeds are configured, since silence is told here too.
    pub fn wheels(&mut self, wheels: WheelSample) {
        for (seen, speed) in self.wheels_seen.iter_mut().zip(&wheels.speeds) {
            *seen |= speed.is_some();
        }
        self.wheels = Some(wheels);
    }

    /// Takes back the estimate of a window that [`Output::window`] handed out.
    ///
    /// One that comes too late is counted when its turn has passed, and not used.
    pub fn deliver(&mut self, end: u32, estimate: Estimate) {
        if let Some((due, slot @ None)) = &mut self.out
            && *due == end
        {
            *slot = Some(estimate);
        }
    }

    /// The newest sample as the networks see it, for [`crate::fog`]; `None` before the bias is known
    /// and while the part is saturated.
    #[must_use]
    pub fn inertial(&self) -> Option<Features> {
        self.inertial
    }

    /// Event counters since start.
    #[must_use]
    pub fn counters(&self) -> &Counters {
        &self.counters
    }

    /// What the sums of the rates have yet to get, were the drive over now.
    #[must_use]
    pub fn owed(&self) -> Owed {
        Owed {
            prompt: Yaw(self.compensator.prompt_owed()),
            navigation: Yaw(self.compensator.navigation_owed(self.bias())),
        }
    }

    /// The gyro's static bias, once known.
    #[must_use]
    pub fn gyro_bias(&self) -> Option<[AngularRate; 3]> {
        self.known.as_ref().map(|known| known.zero.bias())
    }

    /// What the zero-rate updates take off beside it.
    #[must_use]
    pub fn bias(&self) -> AngularRate {
        self.zero_rate().map_or(AngularRate::ZERO, ZeroRate::bias)
    }

    /// The tilt that levelling took out, once known.
    #[must_use]
    pub fn levelling(&self) -> Option<Rotation> {
        self.known.as_ref().map(|known| known.levelling)
    }

    fn zero_rate(&self) -> Option<&ZeroRate> {
        self.known.as_ref()?.zero_rate.as_ref()
    }

    fn refuse(&mut self, error: AlignError) {
        if let AlignError::Jump { .. } = error {
            count(&mut self.counters.clock_jumps, 1);
            self.static_init.restart();
        } else {
            count(&mut self.counters.misplaced, 1);
        }
        // Whatever was wrong with its stamp, it may be of time that no other sample is of.
        if !matches!(error, AlignError::Duplicate { .. }) {
            self.gap();
        }
    }

    fn gap(&mut self) {
        self.gap_within = WINDOW as u32;
        self.break_window();
        if let Some(known) = &mut self.known {
            known.quiet.restart();
            known.zero_rate.as_mut().map(ZeroRate::restart);
        }
    }

    /// A window must not reach across a gap; neither must static initialisation.
    fn break_window(&mut self) {
        self.window.clear();
        self.since_window = 0;
        self.out = None;
        self.compensator.forget();
        self.believed = false;
        self.estimate_faults = Faults::NONE;
        if self.known.is_none() {
            self.static_init.restart();
        }
    }

    fn use_estimate(&mut self, tick: u32) -> Option<Implausible> {
        let (end, estimate) = self.out?;
        if tick.wrapping_sub(end) < self.config.compensate.mode.delay() {
            return None;
        }
        self.out = None;
        let Some(estimate) = estimate else {
            count(&mut self.counters.late, 1);
            self.believed = false;
            self.estimate_faults = Faults::LATE;
            self.compensator.forget();
            return None;
        };
        count(&mut self.counters.windows, 1);
        count(&mut self.counters.clamped_inputs, u32::from(estimate.clamped_inputs));
        let implausible = self.compensator.revise(&estimate.corrections).err();
        self.believed = implausible.is_none();
        if self.believed {
            self.uncertainty.window(estimate.scale);
        }
        self.estimate_faults = if self.believed { Faults::NONE } else { Faults::IMPLAUSIBLE };
        count(&mut self.counters.implausible, u32::from(implausible.is_some()));
        implausible
    }

    #[inline(never)]
    fn correct(
        &mut self,
        frame: &Frame,
        zero: &ZeroPoint,
        quiet: bool,
    ) -> (YawRate, YawRate, Option<Settled>) {
        let sample = &frame.sample;
        let features = window::features(sample, &zero.reading());
        let [.., rate] = features;
        self.compensator.push(frame.tick, AngularRate(rate), sample.clipped);
        self.inertial = (!sample.clipped).then_some(features);
        if !sample.clipped {
            self.window.push(features);
            self.since_window += 1;
        }
        let settled = self.compensator.settled();
        self.check_bias();
        self.update_bias(settled.as_ref(), AngularRate(rate), quiet, sample);
        let bias = self.bias();
        let stands = self.stood as usize > self.config.compensate.lag.samples();
        let prompt = self.compensator.prompt(bias);
        let navigation = self.compensator.navigation(bias, stands);
        if navigation.is_some_and(|emitted| emitted.damaged) {
            self.damaged();
        }
        let believed = self.believed;
        let prompt = self.yaw_rate(prompt, frame, |_| believed, |pipeline| &mut pipeline.prompt_yaw);
        let navigation = self.yaw_rate(
            navigation,
            frame,
            |emitted| !emitted.damaged && (emitted.covered || believed),
            |pipeline| &mut pipeline.navigation_yaw,
        );
        (prompt, navigation, settled)
    }

    fn update_bias(&mut self, settled: Option<&Settled>, rate: AngularRate, quiet: bool, sample: &ImuSample) {
        let proof = match (self.wheels, self.standstill()) {
            (Some(_), Standstill::Still) => Proof::Wheels,
            // Where there are wheels they decide.
            (Some(_), _) => Proof::None,
            (None, _) if quiet => Proof::Inertial,
            (None, _) => Proof::None,
        };
        let zero_rate = self.known.as_mut().and_then(|known| known.zero_rate.as_mut());
        let (Some(zero_rate), Some(settled)) = (zero_rate, settled) else { return };
        match zero_rate.process(settled, proof, sample.temperature) {
            Some(Second::Used) => {
                count(&mut self.counters.zero_rate_updates, 1);
                self.compensator.prove();
            }
            Some(Second::Refused) => count(&mut self.counters.contradicted, 1),
            Some(Second::Waits) | None => {}
        }
        if !sample.clipped && zero_rate.watch(rate) {
            count(&mut self.counters.contradicted, 1);
        }
        if zero_rate.stands() {
            self.stood = self.stood.saturating_add(1);
        } else if core::mem::take(&mut self.stood) > 0 {
            self.compensator.release();
        }
    }

    fn yaw_rate(
        &mut self,
        emitted: Option<Emitted>,
        frame: &Frame,
        estimated: impl Fn(&Emitted) -> bool,
        yaw: impl Fn(&mut Self) -> &mut Yaw,
    ) -> YawRate {
        let Some(emitted) = emitted else {
            let yaw = *yaw(self);
            return raw(frame, Status::Init, yaw);
        };
        let estimated = estimated(&emitted);
        let status = match (emitted.clipped, estimated) {
            (true, _) => Status::Clipped,
            (false, true) => Status::Ready,
            (false, false) => Status::Degraded,
        };
        let Emitted { tick, rate, correction, .. } = emitted;
        let bias = self.zero_rate().map_or(0.0, ZeroRate::sigma);
        let sigma = Some(self.uncertainty.sigma(estimated, bias));
        let yaw = yaw(self);
        yaw.0 = yaw.0.wrapping_add(i64::from(rate.0));
        YawRate { tick, rate, correction, yaw: *yaw, sigma, status }
    }

    #[inline(never)]
    fn due_window(&mut self, tick: u32) -> Option<DueWindow> {
        if self.since_window < self.config.compensate.mode.hop() || self.out.is_some() {
            return None;
        }
        let features = self.window.snapshot()?;
        self.since_window = 0;
        self.out = Some((tick, None));
        Some(DueWindow { end: tick, features })
    }

    /// Whether the vehicle stands, by its wheels.
    fn standstill(&self) -> Standstill {
        self.wheels.map_or(Standstill::Unknown, |wheels| wheels.standstill)
    }
}
