//! The two lines that frames leave by: SLCAN always, CAN where its controller is up.

use crate::chip::bus::Bus;
use crate::{board, serial};
use gyronet::can::DataFrame;
use gyronet::can::queue::TransmitQueue;
use gyronet::can::slcan::host::StatusFlags;
use gyronet::can::slcan::port::Port;
use gyronet::units::Micros;

/// Frames that may wait for a line: what older ones say is of no use to anybody.
const QUEUE: usize = 24;

pub type SlcanPort = serial::Port<{ board::SLCAN_QUEUE }>;

/// Both lines and what waits for them.
pub struct Outgoing {
    slcan: SlcanPort,
    port: Port<QUEUE>,
    can: Option<Bus>,
    queue: TransmitQueue<DataFrame, QUEUE>,
}

impl Outgoing {
    pub fn new(slcan: SlcanPort, bits_per_second: u32, can: Option<Bus>) -> Self {
        Self { slcan, port: Port::new(bits_per_second), can, queue: TransmitQueue::new() }
    }

    /// Puts a frame behind those that wait.
    pub fn push(&mut self, frame: DataFrame, time: Micros) {
        self.port.push(frame, time);
        if self.can.is_some() {
            self.queue.push(frame);
        }
    }

    /// Sends what the lines take; gives what a host has sent over SLCAN.
    pub fn service(&mut self, take: impl FnMut(DataFrame)) {
        self.port.set_bus(if self.off() { StatusFlags::BUS_ERROR } else { StatusFlags::default() });
        // A byte that the line lost is answered as a bad line, or missing in it.
        let _ = self.port.service(&mut self.slcan, take);
        self.refill();
    }

    /// Gives the controller what it has room for.
    pub fn refill(&mut self) {
        if let Some(can) = self.can.as_mut() {
            self.queue.service(can);
        }
    }

    /// Frames that a line did not take in time.
    pub fn dropped(&self) -> u32 {
        self.port.dropped().saturating_add(self.queue.dropped())
    }

    /// Whether the controller has taken itself off the bus.
    pub fn off(&self) -> bool {
        self.can.as_ref().is_some_and(Bus::off)
    }

    /// Bytes of the SLCAN line that came damaged, and bytes that had to wait.
    pub fn line_faults(&self) -> [u32; 2] {
        [self.slcan.lost(), self.slcan.held()]
    }
}
