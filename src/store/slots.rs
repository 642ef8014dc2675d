//! This module selects weight files: two slots hold GyroNet's, a third place holds FoGNet's, and a record lists the
//! accepted files.
//!
//! A file is uploaded, checked in flash, and then accepted: the record stores its place and checksum. GyroNet's file
//! is written to the unused slot. At the next start, [`select`] tries in this order and uses the first file that
//! passes all checks: the active slot, the other slot if its file was accepted, the built-in weights. An interrupted
//! upload thus never harms the file in use. FoGNet has only one place ([`super::layout`]): an interrupted upload
//! leaves no accepted file there, and the gyro is corrected without a network.

use super::error::{FieldError, FlashFault};
use super::place::{Place, Slot};
use super::record::Record;
use crate::fog::GyroMismatch;
use crate::model::{Blob, BlobError, FogBlob};
use serde::{Deserialize, Serialize};

/// The record of the accepted files, and of the slot to use.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Accepted {
    /// Slot to use; `None` selects the built-in weights.
    pub active: Option<Slot>,
    /// Checksum of the accepted file in each slot.
    pub files: [Option<u32>; 2],
    /// Checksum of FoGNet's accepted file.
    pub fognet: Option<u32>,
}

impl Accepted {
    /// Record without accepted files.
    pub const NONE: Self = Self { active: None, files: [None; 2], fognet: None };

    /// Returns the record without the file in a place, which is being replaced.
    #[must_use]
    pub const fn without(mut self, place: Place) -> Self {
        let [a, b] = self.files;
        match place {
            Place::Slot(Slot::A) => self.files = [None, b],
            Place::Slot(Slot::B) => self.files = [a, None],
            Place::FogNet => self.fognet = None,
        }
        self
    }

    /// Returns the record with the checksum `file` for a place; a slot also becomes the one to use.
    #[must_use]
    pub const fn with(mut self, place: Place, file: u32) -> Self {
        let [a, b] = self.files;
        match place {
            Place::Slot(Slot::A) => self.files = [Some(file), b],
            Place::Slot(Slot::B) => self.files = [a, Some(file)],
            Place::FogNet => self.fognet = Some(file),
        }
        if let Place::Slot(slot) = place {
            self.active = Some(slot);
        }
        self
    }
}

impl Record for Accepted {
    const KEY: u8 = 3;
    const VERSION: u8 = 2;

    /// Returns the byte that layout 1 lacks at its end: `fognet`, which is `None`.
    fn missing(version: u8) -> Option<&'static [u8]> {
        (version == 1).then_some(&[0])
    }

    fn check(&self) -> Result<(), FieldError> {
        Ok(())
    }
}

/// The reason why a slot, or the upload to it, is not used.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, thiserror::Error)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum SlotError {
    /// The board has no flash that it may write.
    #[error("the board has no flash that it may write: nothing can be stored")]
    NoFlash,
    /// The flash reports an error.
    #[error("flash: {0}")]
    Flash(FlashFault),
    /// The place is erased and holds no file.
    #[error("the slot is empty")]
    Empty,
    /// The length exceeds the place, or is not a whole number of words.
    #[error("{0} bytes are too many, or not a whole number of words")]
    Length(u32),
    /// The block does not continue the upload.
    #[error("the next block must begin at {expected}")]
    Offset {
        /// Offset at which the next block must begin; all bytes before it are written.
        expected: u32,
    },
    /// No upload is in progress.
    #[error("no upload is in progress")]
    NotBegun,
    /// The upload is not complete.
    #[error("only {written} bytes have been received")]
    Incomplete {
        /// Number of bytes written.
        written: u32,
    },
    /// The file's checksum is not that of the accepted file; the file has this checksum.
    #[error("file {0:08x} is not the one that was accepted")]
    NotAccepted(u32),
    /// The content of the file is invalid.
    #[error(transparent)]
    Blob(BlobError),
    /// FoGNet's file is not for the gyro that is fitted.
    #[error(transparent)]
    Gyro(GyroMismatch),
}

impl From<BlobError> for SlotError {
    fn from(error: BlobError) -> Self {
        Self::Blob(error)
    }
}

/// Returns the bytes of the file in a place, using the length in its header.
///
/// # Errors
/// [`SlotError::Empty`], [`SlotError::Length`].
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
///
/// # Errors
/// [`SlotError::Empty`], [`SlotError::Length`], [`SlotError::Blob`].
pub fn file(slot: &[u8]) -> Result<Blob<'_>, SlotError> {
    Ok(Blob::new_checked(bytes(slot)?)?)
}

/// Checks FoGNet's file in its place, and that it was accepted.
///
/// # Errors
/// Those of [`file()`], and [`SlotError::NotAccepted`].
pub fn fognet<'w>(accepted: &Accepted, place: &'w [u8]) -> Result<FogBlob<'w>, SlotError> {
    let blob = FogBlob::new_checked(bytes(place)?)?;
    if accepted.fognet == Some(blob.crc) { Ok(blob) } else { Err(SlotError::NotAccepted(blob.crc)) }
}

/// The origin of the weights in use.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum WeightSource {
    /// Weights from a slot.
    Slot(Slot),
    /// Weights built into the image.
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

/// The result of [`select`].
#[derive(Debug, Clone, Copy)]
pub struct Selection<'w> {
    /// Weights to use, if any passed the checks.
    pub weights: Option<Blob<'w>>,
    /// Origin of the weights.
    pub source: WeightSource,
    /// Reasons why slots A and B were refused, if they were tried.
    pub refused: [Option<SlotError>; 2],
}

/// Selects the first weights that pass all checks.
#[must_use]
pub fn select<'w>(accepted: &Accepted, slots: [&'w [u8]; 2], built_in: &'w [u8]) -> Selection<'w> {
    let mut refused = [None; 2];
    let order = accepted.active.map(|active| [active, active.other()]);
    for slot in order.into_iter().flatten() {
        let Some(accepted) = slot.of(accepted.files) else { continue };
        match file(slot.of(slots)) {
            Ok(blob) if blob.crc == accepted => {
                return Selection { weights: Some(blob), source: WeightSource::Slot(slot), refused };
            }
            Ok(blob) => refuse(&mut refused, slot, SlotError::NotAccepted(blob.crc)),
            Err(error) => refuse(&mut refused, slot, error),
        }
    }
    let weights = Blob::new_checked(built_in).ok();
    let source = if weights.is_some() { WeightSource::BuiltIn } else { WeightSource::None };
    Selection { weights, source, refused }
}

fn refuse(refused: &mut [Option<SlotError>; 2], slot: Slot, error: SlotError) {
    let [a, b] = refused;
    *match slot {
        Slot::A => a,
        Slot::B => b,
    } = Some(error);
}
