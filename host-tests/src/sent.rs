//! Frames and observations of a coprocessor, kept for a test.

use gyronet::coprocessor::{Observation, Sink, TimedFrame};
use gyronet::estimate::YawEstimate;

#[derive(Debug, Clone, Default)]
pub struct Sent {
    pub frames: Vec<TimedFrame>,
    pub seen: Vec<Observation>,
    pub fog: Vec<YawEstimate>,
}

impl Sink for Sent {
    fn frame(&mut self, frame: TimedFrame) {
        self.frames.push(frame);
    }

    fn observed(&mut self, observation: &Observation) {
        self.seen.push(*observation);
    }

    fn fog_rate(&mut self, rate: &YawEstimate) {
        self.fog.push(*rate);
    }
}
