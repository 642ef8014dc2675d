//! Wheel frames, wherever they come from.

use gyronet::can::DataFrame;
use gyronet::can::wheel::{WheelReceiver, WheelSettings};
use gyronet::sample::WheelSample;
use gyronet::units::Micros;

/// What is known of the wheels, by the sensor's time.
pub struct Wheels {
    receiver: Option<WheelReceiver>,
    /// With the newest sample of the sensor.
    pub known: Option<WheelSample>,
}

impl Wheels {
    pub fn new(settings: Option<WheelSettings>) -> Self {
        let receiver = settings.and_then(|settings| WheelReceiver::new(settings).ok());
        Self { receiver, known: None }
    }

    /// Takes a frame, which may be another one.
    pub fn take(&mut self, frame: &DataFrame, now: Micros) {
        // What is wrong with one, the wheels' silence tells.
        let _ = self.receiver.as_mut().and_then(|receiver| receiver.process(frame, now));
    }

    /// What is known now, once one has come.
    pub fn at(&mut self, now: Micros) -> Option<WheelSample> {
        self.known = self.receiver.as_mut().and_then(|receiver| receiver.poll(now));
        self.known
    }
}
