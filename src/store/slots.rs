//! Two slots take GyroNet's weight files, a third place takes FoGNet's, and a record names the files that the networks run
//! on.
//!
//! A file is uploaded, checked where it lies, and then accepted: a record names its place and checksum. GyroNet's goes to
//! the slot that is not in use. At the next start [`select`] takes the first file that passes all checks: the accepted
//! slot, the other slot if its file was once accepted, the built-in weights. So an upload that breaks off never harms the
//! file in use: it touches the unused slot only. FoGNet has one place ([`super::layout`]): an upload that breaks off leaves
//! no file there that was accepted, and the gyro is corrected without a network.

use super::error::{FieldError, FlashFault};
use super::place::{Place, Slot};
use super::record::Record;
use crate::fog::NotForThisGyro;
use crate::model::{Blob, BlobError, FogBlob};
use serde::{Deserialize, Serialize};

/// Records the files that were accepted, and the one to use.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Accepted {
    /// The slot to use; `None` selects the built-in weights.
    pub active: Option<Slot>,
    /// Checksum of the file that was accepted in each slot.
    pub files: [Option<u32>; 2],
    /// Checksum of FoGNet's file that was accepted.
    pub fognet: Option<u32>,
}

impl Accepted {
    /// No file has been accepted.
    pub const NONE: Self = Self { active: None, files: [None; 2], fognet: None };

    /// Returns these without the file in a place: it is being replaced.
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

    /// Returns the record with a checked file added in its place; a slot becomes the one to use.
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

    /// Returns what layout 1 lacks at its end: it had no place for FoGNet.
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
    /// No flash controller answers (the emulator has none).
    #[error("no flash controller answers: nothing can be stored")]
    NoFlash,
    /// The flash reports an error.
    #[error("flash: {0}")]
    Flash(FlashFault),
    /// The slot has not been written since it was erased.
    #[error("the slot is empty")]
    Empty,
    /// The length is longer than its place, or not a whole number of words.
    #[error("{0} bytes are no whole number of words that has room")]
    Length(u32),
    /// The block does not continue the upload.
    #[error("the next block must begin at {expected}")]
    Offset {
        /// The offset at which the next block must begin; the bytes before it are written.
        expected: u32,
    },
    /// No upload is under way.
    #[error("no upload is under way")]
    NotBegun,
    /// The upload has not reached its end.
    #[error("only {written} bytes have come")]
    Incomplete {
        /// Bytes written.
        written: u32,
    },
    /// The file's checksum is not the announced or accepted one.
    #[error("file {0:08x} is not the one that was accepted")]
    NotAccepted(u32),
    /// The file is refused.
    #[error(transparent)]
    Blob(BlobError),
    /// FoGNet's file is not for the gyro that is fitted.
    #[error(transparent)]
    Gyro(NotForThisGyro),
}

impl From<BlobError> for SlotError {
    fn from(error: BlobError) -> Self {
        Self::Blob(error)
    }
}

/// Returns the bytes of the file in a place, by the length that it states.
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

/// Checks GyroNet's file in a slot. Slots begin on a word.
///
/// # Errors
/// [`SlotError::Empty`], [`SlotError::Length`], [`SlotError::Blob`].
pub fn file(slot: &[u8]) -> Result<Blob<'_>, SlotError> {
    Ok(Blob::new_checked(bytes(slot)?)?)
}

/// Checks FoGNet's file in its place, and that it was accepted.
///
/// # Errors
/// As [`file()`], and [`SlotError::NotAccepted`].
pub fn fognet<'w>(accepted: &Accepted, place: &'w [u8]) -> Result<FogBlob<'w>, SlotError> {
    let blob = FogBlob::new_checked(bytes(place)?)?;
    if accepted.fognet == Some(blob.crc) { Ok(blob) } else { Err(SlotError::NotAccepted(blob.crc)) }
}

/// Says where the weights in use come from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum WeightSource {
    /// The weights come from a slot.
    Slot(Slot),
    /// The weights come from the image itself.
    BuiltIn,
    /// All weights are damaged: no network runs, and the rate is the gyro's less its bias.
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

/// Holds the result of [`select`].
#[derive(Debug, Clone, Copy)]
pub struct Selection<'w> {
    /// The weights to run on, if any passed.
    pub weights: Option<Blob<'w>>,
    /// The origin of the weights.
    pub source: WeightSource,
    /// The reasons why slots A and B were refused, for those that were tried.
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
