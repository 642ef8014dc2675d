//! A sample in, every configured frame out.

use super::bosch::{LAYOUTS, Motion, SetEncoder, SignalStatus};
use super::config::{BoschSettings, Config, MAX_MESSAGES};
use super::j1939::{Validity, Vdc2Encoder};
use super::yaw::Quality;
use super::yaw_feed::YawFeed;
use crate::health::count;
use crate::vehicle::VehicleSample;
use embedded_can::Frame;
use heapless::Vec;

/// Every configured message of a sample, each with what rounding owes its receiver.
#[derive(Debug, Clone, Copy)]
pub struct Feeds {
    config: Config,
    bosch: SetEncoder,
    yaw: Option<YawFeed>,
    vdc2: Vdc2Encoder,
    out_of_range: u32,
}

impl Feeds {
    /// Nothing sent yet.
    #[must_use]
    pub fn new(config: Config) -> Self {
        let yaw = config.settings().yaw;
        Self {
            config,
            bosch: SetEncoder::default(),
            yaw: yaw.map(|yaw| YawFeed::new(yaw.e2e.profiles(), config.samples_per_yaw())),
            vdc2: Vdc2Encoder::default(),
            out_of_range: 0,
        }
    }

    /// Messages that had to say "failed" because a value does not fit its signal.
    #[must_use]
    pub fn out_of_range(&self) -> u32 {
        self.out_of_range
    }

    /// The frames of one sample, in a driver's own type.
    #[inline(never)]
    pub fn process<F: Frame>(&mut self, sample: &VehicleSample) -> Vec<F, MAX_MESSAGES> {
        let (status, validity) = match sample.prompt.quality {
            Quality::Good | Quality::Degraded => (SignalStatus::OK, Validity::Valid),
            Quality::Initialising => (SignalStatus::INITIALISING, Validity::NotAvailable),
            Quality::Unusable => (SignalStatus::FAILURE, Validity::Error),
        };
        // What is wrong with the rate is wrong with the part.
        let unusable = sample.prompt.quality == Quality::Unusable;
        let force_status = if unusable { SignalStatus::FAILURE } else { SignalStatus::OK };
        let settings = *self.config.settings();
        let mut frames = Vec::new();
        // MAX_MESSAGES is what a configuration can have at most.
        let mut send = |frame: Option<F>| frame.map(|frame| frames.push(frame).is_ok());
        if let Some(BoschSettings { tx1_only }) = settings.bosch {
            let messages = self.bosch.encode(&motion(sample, status, force_status));
            let sent = if tx1_only { 1 } else { LAYOUTS.len() };
            for (message, layout) in messages.iter().zip(&LAYOUTS).take(sent) {
                let fits = message.rate_status == status && message.acceleration_status == force_status;
                count(&mut self.out_of_range, u32::from(!fits));
                send(message.frame(layout));
            }
        }
        if let (Some(feed), Some(yaw)) = (self.yaw.as_mut(), settings.yaw) {
            for frame in feed.frames(&sample.yaw, yaw.ids) {
                send(Some(frame));
            }
        }
        if let Some(vdc2) = settings.vdc2 {
            let message = self.vdc2.encode(sample.prompt.rate, validity, &sample.specific_force);
            count(&mut self.out_of_range, u32::from(validity != Validity::Error && message.has_error()));
            send(message.frame(vdc2.source));
        }
        frames
    }
}

/// The grid step is the counter, so that a receiver sees what is missing.
fn motion(sample: &VehicleSample, rate_status: SignalStatus, force_status: SignalStatus) -> Motion {
    Motion {
        angular_rate: [sample.roll_rate, sample.pitch_rate, sample.prompt.rate],
        specific_force: sample.specific_force,
        temperature: sample.temperature,
        rate_status,
        force_status,
        counter: (sample.tick & 0x0F) as u8,
    }
}
