//! Selection of GyroNet's weight file: two slots hold one each, and a record lists the accepted files.
//!
//! A file is uploaded to the unused slot, checked in flash, and accepted by a record of slot and checksum. The next
//! start [`select`]s the first that passes all checks: the active slot, the other slot if accepted, the built-in
//! weights. A file whose windows the processor cannot run in time is refused like a damaged one.

use super::error::FlashFault;
use super::record::Record;
use super::slot::Slot;
use crate::model::{Blob, BlobError};
use serde::{Deserialize, Serialize};

#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Accepted {
    /// Slot to use; `None` selects the built-in weights.
    pub active: Option<Slot>,
    /// Checksum of the accepted file in each slot.
    pub files: [Option<u32>; 2],
}

impl Accepted {
    pub const NONE: Self = Self { active: None, files: [None; 2] };

    /// Returns the record without the file in a slot, which is being replaced.
    #[must_use]
    pub const fn without(mut self, slot: Slot) -> Self {
        self.files[slot as usize] = None;
        self
    }

    /// Returns the record with the checksum `file` for a slot, which becomes the one to use.
    #[must_use]
    pub const fn with(mut self, slot: Slot, file: u32) -> Self {
        self.files[slot as usize] = Some(file);
        self.active = Some(slot);
        self
    }
}

impl Record for Accepted {
    const KEY: u8 = 3;
    const VERSION: u8 = 3;
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, thiserror::Error)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[allow(missing_docs, reason = "its messages say it")]
pub enum SlotError {
    #[error("the board has no flash that it may write: nothing can be stored")]
    NoFlash,
    #[error("flash: {0}")]
    Flash(FlashFault),
    #[error("the slot is empty")]
    Empty,
    #[error("{0} bytes are too many, or not a whole number of words")]
    Length(u32),
    #[error("no upload is in progress")]
    NotBegun,
    #[error("only {written} bytes have been received")]
    Incomplete { written: u32 },
    /// The file's checksum is not that of the accepted file; the file has this checksum.
    #[error("file {0:08x} is not the one that was accepted")]
    NotAccepted(u32),
    #[error("a window takes {cycles} cycles, and clock and `compensate.stride` leave {available}")]
    Slow { cycles: u32, available: u32 },
    #[error(transparent)]
    Blob(#[from] BlobError),
}

/// Returns the bytes of the file in a slot, using the length in its header.
pub fn bytes(slot: &[u8]) -> Result<&[u8], SlotError> {
    let header = slot.first_chunk::<12>().ok_or(SlotError::Empty)?;
    if *header == [0xFF; 12] {
        return Err(SlotError::Empty);
    }
    let [.., a, b, c, d] = *header;
    let length = u32::from_le_bytes([a, b, c, d]);
    slot.get(..length as usize).ok_or(SlotError::Length(length))
}

/// Checks GyroNet's file in a slot, which must be aligned to words.
pub fn file(slot: &[u8]) -> Result<Blob<'_>, SlotError> {
    Ok(Blob::new_checked(bytes(slot)?)?)
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum WeightSource {
    Slot(Slot),
    BuiltIn,
    /// No valid weights: the network is off, and the rate is that of the gyro minus its bias.
    None,
}

impl core::fmt::Display for WeightSource {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::Slot(slot) => write!(f, "slot {slot}"),
            Self::BuiltIn => f.write_str("built in"),
            Self::None => f.write_str("none, the network is off"),
        }
    }
}

#[derive(Debug, Clone, Copy)]
pub struct Selection<'w> {
    pub weights: Option<Blob<'w>>,
    pub source: WeightSource,
    /// Reasons why slots A and B were refused, if they were tried.
    pub refused: [Option<SlotError>; 2],
}

/// Selects the first weights that pass all checks, and of which a window takes no more than the `available` cycles.
pub fn select<'w>(
    accepted: &Accepted,
    slots: [&'w [u8]; 2],
    built_in: &'w [u8],
    available: u32,
) -> Selection<'w> {
    let slow = |blob: &Blob<'_>| {
        let cycles = blob.shape.window_cycles();
        (!fits(cycles, available)).then_some(SlotError::Slow { cycles, available })
    };
    let mut refused = [None; 2];
    let order = accepted.active.map(|active| [active, active.other()]);
    for slot in order.into_iter().flatten() {
        let Some(accepted) = slot.of(accepted.files) else { continue };
        let error = match file(slot.of(slots)) {
            Ok(blob) if blob.crc != accepted => SlotError::NotAccepted(blob.crc),
            Ok(blob) => match slow(&blob) {
                None => return Selection { weights: Some(blob), source: WeightSource::Slot(slot), refused },
                Some(error) => error,
            },
            Err(error) => error,
        };
        refused[slot as usize] = Some(error);
    }
    let weights = Blob::new_checked(built_in).ok().filter(|blob| slow(blob).is_none());
    let source = if weights.is_some() { WeightSource::BuiltIn } else { WeightSource::None };
    Selection { weights, source, refused }
}

/// Returns whether a window fits. Not inlined, so that a test can force one that does not upon the image.
#[inline(never)]
fn fits(cycles: u32, available: u32) -> bool {
    cycles <= available
}
