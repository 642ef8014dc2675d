//! Two slots take weight files, and a record names the file that the network runs on.
//!
//! A file is uploaded to the slot that is not in use, checked there, and then accepted: a record names the slot and the
//! file's checksum. At the next start [`select`] takes the first file that passes all checks: the accepted slot, the
//! other slot if its file was once accepted, the built-in weights. So an upload that breaks off never harms the file in
//! use: it touches the unused slot only.

use super::error::{FieldError, FlashFault};
use super::layout::SLOT_SIZE;
use super::record::Record;
use crate::model::{Blob, BlobError};
use embedded_storage::nor_flash::{NorFlash, NorFlashError};
use serde::{Deserialize, Serialize};

/// Names one of the two slots.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Slot {
    /// Sector 10.
    A,
    /// Sector 11.
    B,
}

impl Slot {
    /// Both slots, in order.
    pub const ALL: [Self; 2] = [Self::A, Self::B];

    /// Returns the other slot.
    #[must_use]
    pub const fn other(self) -> Self {
        match self {
            Self::A => Self::B,
            Self::B => Self::A,
        }
    }

    /// Returns the offset of the slot's first byte, from that of slot A.
    #[must_use]
    pub const fn offset(self) -> u32 {
        match self {
            Self::A => 0,
            Self::B => SLOT_SIZE as u32,
        }
    }

    /// Returns this slot's element of a pair.
    pub(crate) const fn of<T: Copy>(self, [a, b]: [T; 2]) -> T {
        match self {
            Self::A => a,
            Self::B => b,
        }
    }
}

impl core::fmt::Display for Slot {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(Self::of(*self, ["A", "B"]))
    }
}

/// Records the files that were accepted, and the one to use.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Accepted {
    /// The slot to use; `None` selects the built-in weights.
    pub active: Option<Slot>,
    /// Checksum of the file that was accepted in each slot.
    pub files: [Option<u32>; 2],
}

impl Accepted {
    /// No file has been accepted.
    pub const NONE: Self = Self { active: None, files: [None; 2] };

    /// Returns the record with a checked file added in a slot, which becomes the one to use.
    #[must_use]
    pub const fn with(mut self, slot: Slot, file: u32) -> Self {
        let [a, b] = self.files;
        self.files = match slot {
            Slot::A => [Some(file), b],
            Slot::B => [a, Some(file)],
        };
        self.active = Some(slot);
        self
    }
}

impl Record for Accepted {
    const KEY: u8 = 3;
    const VERSION: u8 = 1;

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
    /// The length is longer than a slot, or not a whole number of words.
    #[error("{0} bytes are no whole number of words up to {SLOT_SIZE}")]
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
}

/// Checks the file in a slot. Slots begin on a word.
///
/// # Errors
/// [`SlotError::Empty`], [`SlotError::Length`], [`SlotError::Blob`].
pub fn file(slot: &[u8]) -> Result<Blob<'_>, SlotError> {
    let header = slot.first_chunk::<12>().ok_or(SlotError::Empty)?;
    if *header == [0xFF; 12] {
        return Err(SlotError::Empty);
    }
    let [.., a, b, c, d] = *header;
    let length = u32::from_le_bytes([a, b, c, d]);
    let bytes = slot.get(..length as usize).ok_or(SlotError::Length(length))?;
    Blob::new_checked(bytes).map_err(SlotError::Blob)
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

/// Tracks a file that is being uploaded into a slot.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Upload {
    slot: Slot,
    length: u32,
    written: u32,
}

impl Upload {
    /// Erases the slot and begins an upload. The processor stands still meanwhile: one to two seconds on an F405 (its
    /// datasheet, 128 KiB sector).
    ///
    /// # Errors
    /// [`SlotError::Length`], [`SlotError::Flash`].
    pub fn begin<F: NorFlash>(flash: &mut F, slot: Slot, length: u32) -> Result<Self, SlotError> {
        if length as usize > SLOT_SIZE || length == 0 || !length.is_multiple_of(4) {
            return Err(SlotError::Length(length));
        }
        let end = slot.offset() + SLOT_SIZE as u32;
        flash.erase(slot.offset(), end).map_err(|error| SlotError::Flash(FlashFault::from(error.kind())))?;
        Ok(Self { slot, length, written: 0 })
    }

    /// Writes the next block, a whole number of words.
    ///
    /// # Errors
    /// [`SlotError::Offset`] when it does not continue what is written, [`SlotError::Length`] when it is not a whole
    /// number of words or goes beyond the announced end, [`SlotError::Flash`]; after a flash error the upload must
    /// begin again.
    pub fn block<F: NorFlash>(&mut self, flash: &mut F, offset: u32, bytes: &[u8]) -> Result<(), SlotError> {
        if offset != self.written {
            return Err(SlotError::Offset { expected: self.written });
        }
        let len = bytes.len() as u32;
        if !len.is_multiple_of(4) || len > self.length - self.written {
            return Err(SlotError::Length(len));
        }
        let at = self.slot.offset() + self.written;
        flash.write(at, bytes).map_err(|error| SlotError::Flash(FlashFault::from(error.kind())))?;
        self.written += len;
        Ok(())
    }

    /// Checks the whole file in its slot and returns its checksum.
    ///
    /// # Errors
    /// [`SlotError::Incomplete`], and the errors of [`file()`].
    pub fn verify(&self, slots: [&[u8]; 2]) -> Result<u32, SlotError> {
        if self.written != self.length {
            return Err(SlotError::Incomplete { written: self.written });
        }
        file(self.slot.of(slots)).map(|blob| blob.crc)
    }

    /// Returns the slot.
    #[must_use]
    pub const fn slot(&self) -> Slot {
        self.slot
    }

    /// Returns the number of bytes written.
    #[must_use]
    pub const fn written(&self) -> u32 {
        self.written
    }
}
