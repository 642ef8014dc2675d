//! The upload of a weight file into the board's unused slot.

use super::{Device, DeviceError};
use gyronet::service::message::{BLOCK, Refusal};
use gyronet::service::{Reply, Request};
use gyronet::store::slots::{Slot, SlotError};
use std::io::{Read, Write};

/// A file that the board has accepted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Uploaded {
    /// The slot that holds it.
    pub slot: Slot,
    /// The checksum that the board computed.
    pub crc: u32,
}

/// Uploads a file, has the board check it, and has it used from the next start on. `progress`
/// hears how many bytes are there.
///
/// # Errors
/// [`DeviceError`]; the weights in use have not been touched then.
pub fn upload<L: Read + Write>(
    device: &mut Device<L>,
    file: &[u8],
    mut progress: impl FnMut(usize),
) -> Result<Uploaded, DeviceError> {
    let length = u32::try_from(file.len()).map_err(|_| DeviceError::TooLong)?;
    device.ask(&Request::WeightsBegin { length })?;
    let mut at = 0;
    while let Some(rest) = file.get(at..).filter(|rest| !rest.is_empty()) {
        let block = rest.get(..BLOCK).unwrap_or(rest);
        let bytes = block.try_into().map_err(|_| DeviceError::TooLong)?;
        let written = match device.ask(&Request::WeightsBlock { offset: at as u32, bytes }) {
            Ok(Reply::Weights { written, .. }) => written,
            // An answer was lost: the board knows where to go on.
            Err(DeviceError::Refused(Refusal::Slot(SlotError::Offset { expected }))) => expected,
            Ok(_) => return Err(DeviceError::Mismatch),
            Err(error) => return Err(error),
        } as usize;
        // Forward, or this would never end.
        if written <= at {
            return Err(DeviceError::Mismatch);
        }
        at = written;
        progress(at);
    }
    let Reply::Weights { slot, checked: Some(crc), .. } = device.ask(&Request::WeightsVerify)? else {
        return Err(DeviceError::Mismatch);
    };
    device.ask(&Request::WeightsActivate)?;
    Ok(Uploaded { slot, crc })
}
