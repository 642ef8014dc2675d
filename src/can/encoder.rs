//! Makes the configured frames of one sample of the inertial sensor.

use super::DataFrame;
use super::bosch::{LAYOUTS, Motion, SetEncoder, SignalStatus};
use super::config::{BoschSettings, Config, MAX_MESSAGES};
use super::status::{SlowStatus, StatusEncoder};
use super::yaw::Quality;
use super::yaw_encoder::YawEncoder;
use crate::estimate::VehicleSample;
use crate::health::count;
use heapless::Vec;

/// The encoder of every configured message. It carries the rounding residual of each signal.
#[derive(Debug, Clone, Copy)]
pub struct CanEncoder {
    config: Config,
    bosch: SetEncoder,
    yaw: Option<YawEncoder>,
    status: Option<StatusEncoder>,
    /// Messages marked "failed" because a value was outside its signal's range.
    pub out_of_range: u32,
}

impl CanEncoder {
    pub const fn new(config: Config) -> Self {
        let yaw = match config.settings().yaw {
            Some(yaw) => Some(YawEncoder::new(yaw.e2e.profiles(), config.samples_per_yaw())),
            None => None,
        };
        let status = match config.settings().status {
            Some(status) => StatusEncoder::new(status.id),
            None => None,
        };
        Self { config, bosch: SetEncoder::START, yaw, status, out_of_range: 0 }
    }

    /// The frames of one sample, for a caller without a queue of its own.
    pub fn encode(&mut self, sample: &VehicleSample) -> Vec<DataFrame, MAX_MESSAGES> {
        let mut frames = Vec::new();
        self.send(sample, |frame| {
            // No configuration has more than MAX_MESSAGES messages.
            let _ = frames.push(frame);
        });
        frames
    }

    #[inline(never)]
    pub fn send(&mut self, sample: &VehicleSample, mut send: impl FnMut(DataFrame)) {
        let status = match sample.live.quality {
            Quality::Good | Quality::Degraded => SignalStatus::OK,
            Quality::Initialising => SignalStatus::INITIALISING,
            Quality::Unusable => SignalStatus::FAILURE,
        };
        // The accelerometer is in the same sensor as the gyro.
        let unusable = sample.live.quality == Quality::Unusable;
        let force_status = if unusable { SignalStatus::FAILURE } else { SignalStatus::OK };
        let settings = self.config.settings();
        if let Some(BoschSettings { tx1_only }) = settings.bosch {
            let messages = self.bosch.encode(&motion(sample, status, force_status));
            let sent = if tx1_only { 1 } else { LAYOUTS.len() };
            for (message, layout) in messages.iter().zip(&LAYOUTS).take(sent) {
                let fits = message.rate_status == status && message.acceleration_status == force_status;
                count(&mut self.out_of_range, u32::from(!fits));
                message.frame(layout).into_iter().for_each(&mut send);
            }
        }
        if let (Some(feed), Some(yaw)) = (self.yaw.as_mut(), settings.yaw.as_ref()) {
            feed.send(&sample.delayed, yaw.ids, send);
        }
    }
}

impl CanEncoder {
    /// Counts a sample, and returns the frame of the slow status message when it is due and configured.
    pub fn status(&mut self, status: impl FnOnce() -> SlowStatus) -> Option<DataFrame> {
        self.status.as_mut()?.frame(status)
    }
}

/// Collects the values of the Bosch set; its counter is the grid step, so that a receiver sees what is missing.
fn motion(sample: &VehicleSample, rate_status: SignalStatus, force_status: SignalStatus) -> Motion {
    Motion {
        angular_rate: [sample.roll_rate, sample.pitch_rate, sample.live.rate],
        specific_force: sample.specific_force,
        temperature: sample.temperature,
        rate_status,
        force_status,
        counter: (sample.tick & 0x0F) as u8,
    }
}
