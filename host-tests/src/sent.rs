//! The frames that a coprocessor has sent, kept for a test.

use gyronet::coprocessor::{Sink, TimedFrame};
use gyronet::estimate::YawEstimate;

#[derive(Debug, Clone, Default)]
pub struct Sent {
    pub frames: Vec<TimedFrame>,
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
