//! The CAN log of a drive.

use crate::board::Board;
use crate::drive::candump::Log;
use crate::drive::replay::Steps;
use crate::drive::stream::Drive;
use gyronet::coprocessor::{self, TimedFrame};
use gyronet::model::WindowNetwork;

/// Writes the frames that the board sends on a drive, and returns their number.
pub fn write_log(
    drive: &Drive<'_>,
    network: impl WindowNetwork,
    out: impl std::io::Write,
) -> Result<u64, Box<dyn std::error::Error>> {
    let mut log = Log::new(out);
    for step in Steps::new(drive, Board::new(coprocessor::Config::DEFAULT, drive.wheels(), network))? {
        for TimedFrame { frame, time } in &step?.frames {
            log.frame(*time, frame)?;
        }
    }
    Ok(log.finish()?)
}
