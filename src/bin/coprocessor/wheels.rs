//! Wheel frames, wherever they come from.

use gyronet::can::DataFrame;
use gyronet::can::wheel::{WheelReceiver, WheelSettings};
use gyronet::sample::WheelSample;
use gyronet::units::Micros;

/// What is known of the wheels, by the sensor's time.
pub struct Wheels {
    receiver: Option<WheelReceiver>,
    /// One has come; a vehicle that sends none is not at fault.
    heard: bool,
    /// With the newest sample of the sensor.
    pub known: Option<WheelSample>,
}

impl Wheels {
    pub fn new(settings: Option<WheelSettings>) -> Self {
        let receiver = settings.and_then(|settings| WheelReceiver::new(settings).ok());
        Self { receiver, heard: false, known: None }
    }

    /// Takes a frame, which may be another one.
    pub fn take(&mut self, frame: &DataFrame, now: Micros) {
        let taken = self.receiver.as_mut().and_then(|receiver| receiver.process(frame, now));
        self.heard |= matches!(taken, Some(Ok(_)));
    }

    /// What is known now, once one has come.
    pub fn at(&mut self, now: Micros) -> Option<WheelSample> {
        let receiver = self.receiver.as_mut().filter(|_| self.heard)?;
        self.known = Some(receiver.poll(now));
        self.known
    }
}
