//! The frames that a coprocessor has sent, kept for a test.

use gyronet::coprocessor::{Sink, TimedFrame};
use gyronet::estimate::YawEstimate;

/// Everything that was sent.
#[derive(Debug, Clone, Default)]
pub struct Sent {
    /// Frames, in the order of sending.
    pub frames: Vec<TimedFrame>,
    /// Rates of the fibre-optic gyro.
    pub fog: Vec<YawEstimate>,
}

impl Sink for Sent {
    fn frame(&mut self, frame: TimedFrame) {
        self.frames.push(frame);
    }

    fn fog_rate(&mut self, rate: &YawEstimate) {
        self.fog.push(*rate);
    }
}
