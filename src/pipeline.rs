//! Samples in, corrected yaw rate and CAN frame out. This file owns the order of things and
//! nothing else; no module below it knows its neighbours. No clock is read: the samples' own
//! time stamps drive everything.
//!
//! The network runs beside the samples, not inside their turn: [`Output::window`] hands out a
//! window when one is due, whoever has time runs it, and [`Pipeline::deliver`] takes the
//! estimate back. It is used exactly [`DELAY`] samples after the window's newest one, so fast
//! and slow machines emit the same frames.

use crate::align::{AlignError, Aligner};
use crate::bias::{StaticConfig, StaticError, StaticInit};
use crate::can::bosch::{self, SignalStatus, Tx1, YawRateSignal};
use crate::compensate::{CompensateConfig, Compensator, DELAY, HOP, Implausible, SETTLED_AFTER};
use crate::health::{Counters, Status, count};
use crate::model::Estimate;
use crate::sample::{Frame, ImuSample};
use crate::units::{AngularRate, Yaw};
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
    /// The same as the CAN message TX1.
    pub tx1: Tx1,
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
    signal: YawRateSignal,
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
            signal: YawRateSignal::default(),
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
            self.break_window();
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
        let tx1 = self.tx1(&yaw_rate, &sample);
        let window = self.due_window(frame.tick);
        Ok(Output { yaw_rate, tx1, settled, window, refused, implausible })
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
            self.break_window();
            self.static_init.restart();
        } else {
            count(&mut self.counters.misplaced, 1);
        }
    }

    /// A window must not reach across a gap; neither must static initialisation.
    fn break_window(&mut self) {
        self.window.clear();
        self.since_window = 0;
        self.out = None;
        self.compensator.break_window();
        self.believed = false;
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
            self.compensator.forget();
            return None;
        };
        count(&mut self.counters.windows, 1);
        count(&mut self.counters.clamped_inputs, u32::from(estimate.clamped_inputs));
        let implausible = self.compensator.revise(&estimate.corrections).err();
        self.believed = implausible.is_none();
        count(&mut self.counters.implausible, u32::from(implausible.is_some()));
        implausible
    }

    fn initialise(&mut self, frame: &Frame) -> (YawRate, Option<StaticError>) {
        // A clipped reading says nothing about the bias; the gap it leaves has restarted it.
        let judged = if frame.sample.clipped { None } else { self.static_init.process(&frame.sample) };
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

    fn tx1(&mut self, yaw_rate: &YawRate, sample: &ImuSample) -> Tx1 {
        let mut yaw_rate_status = match yaw_rate.status {
            Status::Init => SignalStatus::INITIALISING,
            Status::Clipped => SignalStatus::FAILURE,
            Status::Ready | Status::Degraded => SignalStatus::OK,
        };
        let code = self.signal.encode(yaw_rate.rate).unwrap_or_else(|limit| {
            count(&mut self.counters.out_of_range, 1);
            yaw_rate_status = SignalStatus::FAILURE;
            limit.0
        });
        let [_, lateral, _] = sample.specific_force;
        let (lateral_acceleration, lateral_acceleration_status) = bosch::encode_acceleration(lateral);
        Tx1 {
            yaw_rate: code,
            yaw_rate_status,
            temperature: bosch::encode_temperature(sample.temperature),
            lateral_acceleration,
            lateral_acceleration_status,
            // The grid step, so that a receiver sees what is missing.
            counter: (yaw_rate.tick & 0x0F) as u8,
        }
    }
}
