//! Samples in, corrected yaw rate and what it is worth out. This file owns the order of things and
//! nothing else; no module below it knows its neighbours. No clock is read: the samples' own
//! time stamps drive everything.
//!
//! The network runs beside the samples, not inside their turn: [`Output::window`] hands out a
//! window when one is due, whoever has time runs it, and [`Pipeline::deliver`] takes the
//! estimate back. It is used exactly [`DELAY`] samples after the window's newest one, so fast
//! and slow machines emit the same frames.

use crate::align::{AlignError, Aligner};
use crate::bias::{StaticConfig, StaticError, StaticInit};
use crate::compensate::{CompensateConfig, Compensator, DELAY, HOP, Implausible, SETTLED_AFTER};
use crate::health::{Counters, Faults, Status, count, judge};
use crate::model::Estimate;
use crate::sample::{Frame, ImuSample, Standstill, WHEELS, WheelSample};
use crate::units::{AngularRate, Yaw};
use crate::vehicle::{VehicleSample, YawSample};
use crate::window::{self, Features, WINDOW, Window};

/// Everything that can be set.
#[derive(Debug, Clone, Copy)]
pub struct PipelineConfig {
    /// Limits of static initialisation.
    pub static_init: StaticConfig,
    /// Bounds of the correction.
    pub compensate: CompensateConfig,
}

impl PipelineConfig {
    /// A MEMS part on a car.
    pub const DEFAULT: Self =
        Self { static_init: StaticConfig::DEFAULT, compensate: CompensateConfig::DEFAULT };
}

/// The corrected yaw rate of one sample.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct YawRate {
    /// Grid step of the sample.
    pub tick: u32,
    /// Gyro less bias and correction; in [`Status::Init`] the raw gyro.
    pub rate: AngularRate,
    /// What the network's estimates took off, carried revisions included.
    pub correction: AngularRate,
    /// Sum of all emitted rates since the bias became known.
    pub yaw: Yaw,
    /// How good it is.
    pub status: Status,
}

/// The best estimate for an earlier sample, which nothing will revise any more. A user who can
/// wait 110 ms gets a quieter rate from it than the one that went out at once.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Settled {
    /// Tick of the sample.
    pub tick: u32,
    /// What the network's estimates take off its gyro rate less bias.
    pub correction: AngularRate,
}

/// A window that is due, oldest sample first, and the tick of its newest one.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct DueWindow {
    /// Tick of the newest sample.
    pub end: u32,
    /// The samples.
    pub features: [Features; WINDOW],
}

/// What one sample led to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Output {
    /// The corrected yaw rate.
    pub yaw_rate: YawRate,
    /// The same with all that is sent beside it, for [`crate::can::feeds::Feeds`].
    pub vehicle: VehicleSample,
    /// The sample whose estimate is final with this one, if windows have covered it.
    pub settled: Option<Settled>,
    /// Run this through the network and [`Pipeline::deliver`] the estimate before the sample
    /// [`DELAY`] steps on.
    pub window: Option<DueWindow>,
    /// Static initialisation was refused with this sample; it has started anew.
    pub refused: Option<StaticError>,
    /// The estimate due with this sample was not believed.
    pub implausible: Option<Implausible>,
}

/// The whole way of the data for one vehicle.
#[derive(Debug, Clone)]
pub struct Pipeline {
    aligner: Aligner,
    static_init: StaticInit,
    gyro_bias: Option<[AngularRate; 3]>,
    window: Window,
    since_window: u32,
    /// Tick of the window that is out, and its estimate when delivered.
    out: Option<(u32, Option<Estimate>)>,
    compensator: Compensator,
    believed: bool,
    yaw: Yaw,
    /// What was wrong with the newest estimate.
    estimate_faults: Faults,
    /// Samples until a gap is a whole window away.
    gap_within: u32,
    wheels: Option<WheelSample>,
    /// Wheels that have had a speed.
    wheels_seen: [bool; WHEELS],
    counters: Counters,
}

impl Pipeline {
    /// Before the first sample.
    #[must_use]
    pub fn new(config: PipelineConfig) -> Self {
        Self {
            aligner: Aligner::default(),
            static_init: StaticInit::new(config.static_init),
            gyro_bias: None,
            window: Window::EMPTY,
            since_window: 0,
            out: None,
            compensator: Compensator::new(config.compensate),
            believed: false,
            yaw: Yaw::default(),
            estimate_faults: Faults::NONE,
            gap_within: 0,
            wheels: None,
            wheels_seen: [false; WHEELS],
            counters: Counters::default(),
        }
    }

    /// Takes one sample of the inertial sensor.
    ///
    /// # Errors
    /// [`AlignError`] when its time stamp has no place; it is counted and not used.
    pub fn process(&mut self, sample: ImuSample) -> Result<Output, AlignError> {
        let frame = self.aligner.process(sample).inspect_err(|error| self.refuse(*error))?;
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
        let (yaw_rate, settled, refused) = match self.gyro_bias {
            None => {
                let (yaw_rate, refused) = self.initialise(&frame);
                (yaw_rate, None, refused)
            }
            Some(bias) => {
                let (yaw_rate, settled) = self.correct(&frame, &bias);
                (yaw_rate, settled, None)
            }
        };
        let vehicle = self.vehicle(&yaw_rate, &sample);
        let window = self.due_window(frame.tick);
        self.gap_within = self.gap_within.saturating_sub(1);
        Ok(Output { yaw_rate, vehicle, settled, window, refused, implausible })
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

    /// Event counters since start.
    #[must_use]
    pub fn counters(&self) -> &Counters {
        &self.counters
    }

    /// Revisions of past corrections that are still to be emitted, in rate codes x samples.
    #[must_use]
    pub fn carry(&self) -> i64 {
        self.compensator.carry()
    }

    /// The gyro's static bias, once known.
    #[must_use]
    pub fn gyro_bias(&self) -> Option<[AngularRate; 3]> {
        self.gyro_bias
    }

    fn refuse(&mut self, error: AlignError) {
        if let AlignError::Jump { .. } = error {
            count(&mut self.counters.clock_jumps, 1);
            self.gap();
            self.static_init.restart();
        } else {
            count(&mut self.counters.misplaced, 1);
        }
    }

    fn gap(&mut self) {
        self.gap_within = WINDOW as u32;
        self.break_window();
    }

    /// A window must not reach across a gap; neither must static initialisation.
    fn break_window(&mut self) {
        self.window.clear();
        self.since_window = 0;
        self.out = None;
        self.compensator.break_window();
        self.believed = false;
        self.estimate_faults = Faults::NONE;
        if self.gyro_bias.is_none() {
            self.static_init.restart();
        }
    }

    fn use_estimate(&mut self, tick: u32) -> Option<Implausible> {
        let (end, estimate) = self.out?;
        if tick.wrapping_sub(end) < DELAY {
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
        self.estimate_faults = if self.believed { Faults::NONE } else { Faults::IMPLAUSIBLE };
        count(&mut self.counters.implausible, u32::from(implausible.is_some()));
        implausible
    }

    fn initialise(&mut self, frame: &Frame) -> (YawRate, Option<StaticError>) {
        let judged = if self.standstill() == Standstill::Moving {
            self.static_init.refuse_wheels().map(Err)
        } else if frame.sample.clipped {
            // A clipped reading says nothing about the bias; the gap it leaves has restarted it.
            None
        } else {
            self.static_init.process(&frame.sample)
        };
        let refused = match judged {
            Some(Ok(bias)) => {
                self.gyro_bias = Some(bias);
                None
            }
            Some(Err(error)) => {
                count(&mut self.counters.moving, 1);
                Some(error)
            }
            None => None,
        };
        let status = if frame.sample.clipped { Status::Clipped } else { Status::Init };
        let [_, _, rate] = frame.sample.angular_rate;
        (YawRate { tick: frame.tick, rate, correction: AngularRate::ZERO, yaw: self.yaw, status }, refused)
    }

    fn correct(&mut self, frame: &Frame, bias: &[AngularRate; 3]) -> (YawRate, Option<Settled>) {
        let features = window::features(&frame.sample, bias);
        let (correction, settled) = self.compensator.correction(!frame.sample.clipped);
        let settled =
            settled.map(|correction| Settled { tick: frame.tick.wrapping_sub(SETTLED_AFTER), correction });
        let [.., yaw_feature] = features;
        let rate = AngularRate(yaw_feature.saturating_sub(correction.0));
        self.yaw = Yaw(self.yaw.0.wrapping_add(i64::from(rate.0)));
        if !frame.sample.clipped {
            self.window.push(features);
            self.since_window += 1;
        }
        let status = match (frame.sample.clipped, self.believed) {
            (true, _) => Status::Clipped,
            (false, true) => Status::Ready,
            (false, false) => Status::Degraded,
        };
        (YawRate { tick: frame.tick, rate, correction, yaw: self.yaw, status }, settled)
    }

    fn due_window(&mut self, tick: u32) -> Option<DueWindow> {
        if self.since_window < HOP || self.out.is_some() {
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

    /// What is wrong with this sample.
    fn faults(&self, sample: &ImuSample) -> Faults {
        let fault = |present: bool, fault| if present { fault } else { Faults::NONE };
        self.estimate_faults
            .with(fault(self.gap_within > 0, Faults::GAP))
            .with(fault(sample.clipped, Faults::CLIPPED))
            .with(fault(self.wheels_silent(), Faults::WHEELS))
    }

    /// A wheel that has had a speed has none, or none has ever had one.
    fn wheels_silent(&self) -> bool {
        let Some(WheelSample { speeds, .. }) = self.wheels else { return false };
        let lost = |(speed, seen): (&Option<_>, bool)| seen && speed.is_none();
        speeds.iter().all(Option::is_none) || speeds.iter().zip(self.wheels_seen).any(lost)
    }

    fn vehicle(&self, yaw_rate: &YawRate, sample: &ImuSample) -> VehicleSample {
        let (source, quality) = judge(yaw_rate.status);
        let [roll_bias, pitch_bias, _] = self.gyro_bias.unwrap_or_default();
        let [roll_rate, pitch_rate, _] = sample.angular_rate;
        let less = |rate: AngularRate, bias: AngularRate| AngularRate(rate.0.saturating_sub(bias.0));
        VehicleSample {
            yaw: YawSample {
                rate: yaw_rate.rate,
                correction: yaw_rate.correction,
                yaw: yaw_rate.yaw,
                sigma: None,
                source,
                quality,
                faults: self.faults(sample),
                // The pipeline has no clock.
                latency_us: None,
            },
            roll_rate: less(roll_rate, roll_bias),
            pitch_rate: less(pitch_rate, pitch_bias),
            specific_force: sample.specific_force,
            temperature: sample.temperature,
            tick: yaw_rate.tick,
        }
    }
}
