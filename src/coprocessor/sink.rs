//! Where a coprocessor's frames go: each one straight from its encoder to the caller's queue.

use super::Observation;
use crate::can::DataFrame;
use crate::can::queue::TransmitQueue;
use crate::estimate::YawEstimate;
use crate::units::Micros;
use embedded_can::Frame;

/// A frame to send.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct TimedFrame {
    /// The frame.
    pub frame: DataFrame,
    /// Time stamp of the frame's sample, by the sensor's clock.
    pub time: Micros,
}

/// Takes frames in the order in which they are sent: a closure, or a [`TransmitQueue`]. `()` takes none, and none is
/// encoded.
pub trait Sink {
    /// False where frames are dropped, so that none needs to be encoded.
    const TAKES_FRAMES: bool = true;

    /// Takes a frame without waiting: one that the bus does not accept is counted for [`super::Coprocessor::bus`].
    fn frame(&mut self, frame: TimedFrame);

    /// Takes what was observed in 10 ms of the inertial sensor, or in its silence, after its frames.
    fn observed(&mut self, _observation: &Observation) {}

    /// Takes a rate of the fibre-optic gyro, before its frames.
    fn fog_rate(&mut self, _rate: &YawEstimate) {}
}

impl<F: FnMut(TimedFrame)> Sink for F {
    fn frame(&mut self, frame: TimedFrame) {
        self(frame);
    }
}

impl Sink for () {
    const TAKES_FRAMES: bool = false;

    fn frame(&mut self, _frame: TimedFrame) {}
}

impl<F: Frame, const N: usize> Sink for TransmitQueue<F, N> {
    /// Queues the frame; one that the driver's type cannot hold counts as dropped.
    fn frame(&mut self, frame: TimedFrame) {
        match frame.frame.convert() {
            Some(frame) => self.enqueue(frame),
            None => self.refuse(),
        }
    }
}
