//! The board runs on one weight file, while another one is written to the slot that is not in use.

use super::Device;
use crate::model::Blob;
use crate::service::event::EventKind;
use crate::service::message::{BLOCK, Refusal};
use crate::store::Slot;
use crate::store::slots::{Selection, SlotError, Upload, WeightSource, select};
use embedded_storage::nor_flash::NorFlash;

/// The flash of the weight slots, which the processor can also read in place.
pub trait MappedSlots: NorFlash {
    /// Returns both slots, each on a word boundary.
    fn slots(&self) -> [&[u8]; 2];
}

/// An upload, and its file's checksum once checked.
#[derive(Debug, Clone, Copy)]
pub(super) struct Uploading {
    pub(super) upload: Upload,
    pub(super) checked: Option<u32>,
}

impl<R: NorFlash, W: MappedSlots> Device<R, W> {
    /// Selects the weights to run on from `slots` as the processor reads them, the image's own last.
    pub fn weights<'w>(&mut self, slots: Option<[&'w [u8]; 2]>, built_in: &'w [u8]) -> Option<Blob<'w>> {
        let Selection { weights, source, refused } =
            select(&self.accepted, slots.unwrap_or_default(), built_in);
        self.weights = source;
        self.weights_crc = weights.map(|blob| blob.crc);
        self.refused_slots = refused;
        for (slot, error) in Slot::ALL.into_iter().zip(refused) {
            if let Some(error) = error {
                self.refuse(EventKind::SlotRefused(slot, error));
            }
        }
        if source == WeightSource::None {
            self.refuse(EventKind::NoWeights);
        }
        weights
    }

    /// Notes that the weights in use no longer fit their checksum; they are not used until the next start, which
    /// checks all files again.
    pub fn weights_damaged(&mut self) {
        self.weights = WeightSource::None;
        self.weights_crc = None;
        self.note(EventKind::WeightsDamaged);
    }

    /// Returns the slot that the network does not run on.
    fn unused_slot(&self) -> Slot {
        match self.weights {
            WeightSource::Slot(slot) => slot.other(),
            // The network runs on neither; the file accepted last is spared all the same.
            WeightSource::BuiltIn | WeightSource::None => self.accepted.active.map_or(Slot::A, Slot::other),
        }
    }

    pub(super) fn weights_begin(&mut self, length: u32) -> Result<(), Refusal> {
        let slot = self.unused_slot();
        self.uploading = None;
        let flash = self.slots.as_mut().ok_or(SlotError::NoFlash)?;
        let upload = Upload::begin(flash, slot, length)?;
        self.uploading = Some(Uploading { upload, checked: None });
        Ok(())
    }

    pub(super) fn weights_block(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Refusal> {
        let flash = self.slots.as_mut().ok_or(SlotError::NoFlash)?;
        let uploading = self.uploading.as_mut().ok_or(SlotError::NotBegun)?;
        // Every block but the last one is full, so a block that is there already ends where the
        // next one begins.
        let written = uploading.upload.written();
        let repeated = bytes.len() <= BLOCK && offset.checked_add(bytes.len() as u32) == Some(written);
        if repeated {
            return Ok(());
        }
        uploading.upload.block(flash, offset, bytes).map_err(|error| {
            if let SlotError::Flash(_) = error {
                self.uploading = None;
            }
            error.into()
        })
    }

    #[inline(never)]
    pub(super) fn weights_verify(&mut self) -> Result<(), Refusal> {
        let flash = self.slots.as_ref().ok_or(SlotError::NoFlash)?;
        let uploading = self.uploading.as_mut().ok_or(SlotError::NotBegun)?;
        uploading.checked = Some(uploading.upload.verify(flash.slots())?);
        Ok(())
    }

    pub(super) fn weights_activate(&mut self) -> Result<(), Refusal> {
        let Uploading { upload, checked } = self.uploading.ok_or(SlotError::NotBegun)?;
        let file = checked.ok_or(SlotError::Incomplete { written: upload.written() })?;
        let accepted = self.accepted.with(upload.slot(), file);
        self.store()?.set(&accepted)?;
        self.accepted = accepted;
        self.uploading = None;
        self.note(EventKind::WeightsAccepted(upload.slot()));
        Ok(())
    }
}
