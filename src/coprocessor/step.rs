//! A board's loop in one call: it receives, reads the sensor, runs the network, polls and sends.

use super::{Coprocessor, Observation, Sink, TimedFrame};
use crate::can::DataFrame;
use crate::can::queue::TransmitQueue;
use crate::model::WindowNetwork;
use crate::sample::ImuSample;
use crate::sensor::Source;
use crate::units::Micros;
use embedded_can::{Frame, nb::Can};

/// A step takes at most this many samples; the next ones wait for the next step.
pub const MAX_SAMPLES: usize = 4;
/// A step takes at most this many received frames.
const MAX_RECEIVED: usize = 24;

/// The CAN bus of a board: takes the frames that are sent, and delivers those received.
pub trait Bus: Sink {
    /// Returns the next frame that was received.
    fn receive(&mut self) -> Option<DataFrame>;

    /// Sends what the bus accepts now, without waiting.
    fn flush(&mut self);

    /// Returns the number of frames lost since the start, sent or received. The messages report each loss.
    fn lost(&self) -> u32;

    /// Returns whether the controller is off the bus; the messages report it.
    fn is_off(&self) -> bool {
        false
    }
}

/// A controller with a queue of `N` frames, as it has fewer mailboxes than a sample has frames. One that newer ones
/// push out counts as lost, and so does an error at a reception.
#[derive(Debug)]
pub struct QueuedCan<C: Can, const N: usize = 24> {
    can: C,
    queue: TransmitQueue<C::Frame, N>,
    missed: u32,
}

impl<C: Can, const N: usize> QueuedCan<C, N> {
    /// Creates a bus with an empty queue.
    pub const fn new(can: C) -> Self {
        Self { can, queue: TransmitQueue::new(), missed: 0 }
    }

    /// Returns the controller.
    pub const fn controller(&self) -> &C {
        &self.can
    }
}

impl<C: Can, const N: usize> Sink for QueuedCan<C, N> {
    fn frame(&mut self, frame: TimedFrame) {
        Sink::frame(&mut self.queue, frame);
    }
}

impl<C: Can, const N: usize> Bus for QueuedCan<C, N> {
    fn receive(&mut self) -> Option<DataFrame> {
        // Remote frames are passed over, at most this many at once.
        for _ in 0..MAX_RECEIVED {
            match self.can.receive() {
                Ok(frame) if frame.is_remote_frame() => {}
                Ok(frame) => return DataFrame::new(frame.id(), frame.data()),
                Err(nb::Error::WouldBlock) => break,
                Err(nb::Error::Other(_)) => {
                    self.missed = self.missed.saturating_add(1);
                    break;
                }
            }
        }
        None
    }

    fn flush(&mut self) {
        self.queue.service(&mut self.can);
    }

    fn lost(&self) -> u32 {
        self.queue.dropped().saturating_add(self.missed)
    }
}

/// The results of a step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Step<E> {
    /// The newest sample's results, or those of a silent sensor; `None` where no message set was due.
    pub observation: Option<Observation>,
    /// The newest error of the sensor. It is counted, and a sensor that keeps failing is reported as silent.
    pub imu_error: Option<E>,
}

impl Coprocessor {
    /// Does everything that is due at `now`, about every millisecond: received frames are used, the samples of `imu`
    /// corrected, their windows estimated by `network`, silence reported, frames sent, errors counted and reported.
    /// With `None` as the network, run it in a task of lower priority ([`Coprocessor::window`],
    /// [`Coprocessor::deliver`]); the frames are the same.
    pub fn step<IMU: Source<Sample = ImuSample>>(
        &mut self,
        now: Micros,
        imu: &mut IMU,
        bus: &mut impl Bus,
        mut network: Option<&mut dyn WindowNetwork>,
    ) -> Step<IMU::Error> {
        self.bus(bus.lost(), bus.is_off());
        for _ in 0..MAX_RECEIVED {
            let Some(frame) = bus.receive() else { break };
            // It is counted.
            let _ = self.can(&frame, now);
        }
        let mut step = Step { observation: None, imu_error: None };
        for _ in 0..MAX_SAMPLES {
            if !self.is_ready(now) {
                break;
            }
            match imu.next_sample() {
                Some(Ok(sample)) => {
                    // A refused sample is counted.
                    let _ = self.take(sample, now, bus, &mut step.observation);
                }
                Some(Err(error)) => {
                    self.imu_error();
                    step.imu_error = Some(error);
                }
                None => break,
            }
            if let Some(network) = network.as_deref_mut() {
                self.estimate(network);
            }
        }
        // A clock that went back is counted.
        let _ = self.poll_into(now, bus, &mut step.observation);
        bus.flush();
        step
    }

    /// Runs GyroNet on the window that is due, if there is one.
    // Not inlined: the network's stack is not that of the steps before and after it.
    #[inline(never)]
    pub fn estimate(&mut self, network: &mut dyn WindowNetwork) {
        if let Some(due) = self.window() {
            // A late estimate is counted.
            let _ = self.deliver(due.end, network.estimate(&due.features));
        }
    }
}
