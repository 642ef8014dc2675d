//! This module finds and makes the frames of the service line.

use crate::model::blob::CRC;
use cobs::{CobsEncoder, DecodeResult, DecoderState};
use heapless::Vec;
use serde::{Serialize, de::DeserializeOwned};

/// Most bytes of a message.
pub const MAX_MESSAGE: usize = 320;
/// The longest content, with its number and checksum.
const MAX_CONTENT: usize = MAX_MESSAGE + 5;
/// The longest frame, with the bytes that COBS adds (one for each 254 begun) and the zeros around it.
pub const MAX_FRAME: usize = MAX_CONTENT + MAX_CONTENT / 254 + 1 + 2;

/// A frame, ready for the line.
pub type Frame = Vec<u8, MAX_FRAME>;

/// The reason why the bytes between two zeros are no message.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum FrameError {
    /// Longer than any frame.
    #[error("service frame: too long")]
    TooLong,
    /// The bytes are not COBS.
    #[error("service frame: not COBS")]
    Encoding,
    /// The checksum does not fit.
    #[error("service frame: wrong checksum")]
    Crc,
    /// Intact, but no message of this protocol.
    #[error("service frame: not a message of this protocol")]
    Message {
        /// The number that it came under.
        number: u8,
    },
}

/// Finds frames in a stream of bytes.
#[derive(Debug)]
pub struct Deframer {
    content: Vec<u8, MAX_CONTENT>,
    state: DecoderState,
    failed: Option<FrameError>,
}

impl Deframer {
    /// Begins before the first sample.
    #[must_use]
    pub const fn new() -> Self {
        Self { content: Vec::new(), state: DecoderState::Idle, failed: None }
    }

    /// Takes one byte. With the last one of a frame returns its number and message, or why it
    /// has none.
    pub fn receive<M: DeserializeOwned>(&mut self, byte: u8) -> Option<Result<(u8, M), FrameError>> {
        if byte == 0 {
            let idle = matches!(self.state, DecoderState::Idle) && self.failed.is_none();
            let finished = (!idle).then(|| self.finish(byte));
            *self = Self::new();
            return finished;
        }
        if self.failed.is_none() {
            self.failed = self.decode(byte).err();
        }
        None
    }

    /// Takes a byte out of its encoding; whether it is the last one.
    fn decode(&mut self, byte: u8) -> Result<bool, FrameError> {
        match self.state.feed(byte).map_err(|_| FrameError::Encoding)? {
            DecodeResult::DataComplete => Ok(true),
            DecodeResult::DataContinue(byte) => {
                self.content.push(byte).map_err(|_| FrameError::TooLong)?;
                Ok(false)
            }
            DecodeResult::NoData => Ok(false),
        }
    }

    #[inline(never)]
    fn finish<M: DeserializeOwned>(&mut self, byte: u8) -> Result<(u8, M), FrameError> {
        if let Some(error) = self.failed {
            return Err(error);
        }
        if !self.decode(byte)? {
            return Err(FrameError::Encoding);
        }
        let (content, crc) = self.content.split_last_chunk::<4>().ok_or(FrameError::Crc)?;
        if CRC.checksum(content).to_le_bytes() != *crc {
            return Err(FrameError::Crc);
        }
        let (number, message) = content.split_first().ok_or(FrameError::Crc)?;
        match postcard::take_from_bytes::<M>(message) {
            Ok((message, [])) => Ok((*number, message)),
            _ => Err(FrameError::Message { number: *number }),
        }
    }
}

impl Default for Deframer {
    fn default() -> Self {
        Self::new()
    }
}

/// Encodes a message as a frame; `None` when it is longer than [`MAX_MESSAGE`].
#[inline(never)]
pub fn emit<M: Serialize>(number: u8, message: &M) -> Option<Frame> {
    let mut content = [0; MAX_CONTENT];
    let (first, rest) = content.split_first_mut()?;
    *first = number;
    let len = 1 + postcard::to_slice(message, rest.get_mut(..MAX_MESSAGE)?).ok()?.len();
    let crc = CRC.checksum(content.get(..len)?).to_le_bytes();
    content.get_mut(len..len + crc.len())?.copy_from_slice(&crc);
    let mut frame = Frame::new();
    frame.resize(MAX_FRAME, 0).ok()?;
    let mut encoder = CobsEncoder::new(frame.get_mut(1..)?);
    encoder.push(content.get(..len + crc.len())?).ok()?;
    let encoded = encoder.finalize();
    // The encoder may leave a byte behind its end.
    frame.truncate(1 + encoded);
    frame.push(0).ok()?;
    Some(frame)
}
