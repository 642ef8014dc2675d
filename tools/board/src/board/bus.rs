//! The virtual board's CAN bus, for a tester: receiving lets board time pass.

use super::Board;
use gyronet::can::DataFrame;
use gyronet_tools::client::bus::Bus;
use std::io::Result;
use std::time::Duration;

const TURN: Duration = Duration::from_millis(1);

/// A board's bus, and where the frames of the board are kept.
#[derive(Debug)]
pub struct CanBus<'a>(pub(super) &'a mut Board, pub(super) Option<&'a mut Vec<(Duration, DataFrame)>>);

impl Bus for CanBus<'_> {
    fn send(&mut self, frame: &DataFrame) -> Result<()> {
        self.0.can_send(frame);
        Ok(())
    }

    fn receive(&mut self) -> Result<Vec<DataFrame>> {
        self.0.run(TURN);
        let frames = self.0.can_frames();
        if let Some(log) = &mut self.1 {
            log.extend(&frames);
        }
        Ok(frames.into_iter().map(|(_, frame)| frame).collect())
    }

    fn now(&mut self) -> Duration {
        self.0.counts().time
    }
}
