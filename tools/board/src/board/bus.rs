//! The virtual board's CAN bus, for a tester: receiving lets board time pass.

use super::{Board, Seen};
use gyronet::can::DataFrame;
use gyronet_tools::client::bus::Bus;
use std::io::Result;
use std::time::Duration;

const TURN: Duration = Duration::from_millis(1);

#[derive(Debug)]
pub struct CanBus<'a>(pub(super) &'a mut Board);

impl CanBus<'_> {
    /// As receiving does, with the frames of other nodes.
    pub fn observe(&mut self) -> Vec<Seen> {
        self.0.run(TURN);
        self.0.bus_log()
    }
}

impl Bus for CanBus<'_> {
    fn send(&mut self, frame: &DataFrame) -> Result<()> {
        self.0.can_send(frame);
        Ok(())
    }

    fn receive(&mut self) -> Result<Vec<DataFrame>> {
        self.0.run(TURN);
        Ok(self.0.can_frames().into_iter().map(|(_, frame)| frame).collect())
    }

    fn now(&mut self) -> Duration {
        self.0.counts().time
    }
}
