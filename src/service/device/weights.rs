//! This module selects and uploads weight files. A new file for GyroNet is written to the unused slot while GyroNet
//! runs. FoGNet's file has only one place, so FoGNet stops when a new file is written.

use super::Device;
use crate::fog::FogNetUse;
use crate::model::{Blob, FogBlob};
use crate::service::event::EventKind;
use crate::service::message::{BLOCK, Network, Refusal};
use crate::store::slots::{self, Selection, SlotError, WeightSource, select};
use crate::store::{Place, Slot, Upload};
use embedded_storage::nor_flash::NorFlash;

/// The flash of the weight files, which is also memory-mapped for reading. Offsets are from the start of the whole
/// flash.
pub trait MappedSlots: NorFlash {
    /// Returns both slots, aligned to words.
    fn slots(&self) -> [&[u8]; 2];
    /// Returns the place of FoGNet's file, aligned to words.
    fn fognet(&self) -> &[u8];

    /// Runs the check of a file, which takes a tenth of a second. A board may override this to extend its watchdog
    /// timeout.
    fn check<T>(&self, work: impl FnOnce() -> T) -> T {
        work()
    }
}

/// An upload in progress, and the checksum of its file once checked.
#[derive(Debug, Clone, Copy)]
pub(super) struct Uploading {
    pub(super) upload: Upload,
    pub(super) checked: Option<u32>,
}

impl<R: NorFlash, W: MappedSlots> Device<R, W> {
    /// Selects the weights to run from `slots`, as the processor reads them, else from the image itself.
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

    /// Selects FoGNet's weights from `place`, as the processor reads it. Returns `None` if FoGNet is off, or the file
    /// is refused, which is logged.
    pub fn fognet<'w>(&mut self, place: &'w [u8]) -> Option<FogBlob<'w>> {
        if self.configuration.fog_lane.fognet == FogNetUse::Off {
            return None;
        }
        let found = slots::fognet(&self.accepted, place).and_then(|blob| {
            let fits = self.configuration.check_training(blob.training);
            fits.map(|()| blob).map_err(SlotError::Gyro)
        });
        self.fognet = Some(found.map(|blob| blob.crc));
        found.map_err(|error| self.refuse(EventKind::FogNetRefused(error))).ok()
    }

    /// Returns `true` once after FoGNet's file was erased or found damaged: its use must stop at once. See
    /// [`Coprocessor::fognet_unavailable`](crate::Coprocessor::fognet_unavailable).
    pub fn take_fognet_unavailable(&mut self) -> bool {
        core::mem::take(&mut self.fognet_unavailable)
    }

    /// Records that FoGNet's file no longer matches its checksum. The file is not used until the next start, which
    /// checks it again.
    pub fn fognet_damaged(&mut self) {
        if let Some(Ok(crc)) = self.fognet {
            self.lose_fognet(SlotError::NotAccepted(crc));
            self.note(EventKind::WeightsDamaged);
        }
    }

    fn lose_fognet(&mut self, why: SlotError) {
        self.fognet = self.fognet.map(|_| Err(why));
        self.fognet_unavailable = true;
    }

    /// Records that the weights in use no longer match their checksum. They are not used until the next start, which
    /// checks all files again.
    pub fn weights_damaged(&mut self) {
        self.weights = WeightSource::None;
        self.weights_crc = None;
        self.note(EventKind::WeightsDamaged);
    }

    /// Returns the slot to overwrite: one that GyroNet does not run on.
    fn unused_slot(&self) -> Slot {
        match self.weights {
            WeightSource::Slot(slot) => slot.other(),
            // GyroNet runs on neither slot; keep the file that was accepted last.
            WeightSource::BuiltIn | WeightSource::None => self.accepted.active.map_or(Slot::A, Slot::other),
        }
    }

    pub(super) fn weights_begin(&mut self, network: Network, length: u32) -> Result<(), Refusal> {
        let place = match network {
            Network::GyroNet => Place::Slot(self.unused_slot()),
            Network::FogNet => Place::FogNet,
        };
        Upload::check(place, length)?;
        self.uploading = None;
        if self.slots.is_none() {
            return Err(SlotError::NoFlash.into());
        }
        // Withdraw the acceptance of the old file: a new file could have the same checksum by intent.
        let accepted = self.accepted.without(place);
        if accepted != self.accepted {
            self.store.as_mut().ok_or(SlotError::NoFlash)?.set(&accepted)?;
            self.accepted = accepted;
        }
        if network == Network::FogNet {
            // A failed erase may have erased a part of the file.
            self.lose_fognet(SlotError::Empty);
        }
        let flash = self.slots.as_mut().ok_or(SlotError::NoFlash)?;
        let upload = Upload::begin(flash, place, length)?;
        self.uploading = Some(Uploading { upload, checked: None });
        Ok(())
    }

    pub(super) fn weights_block(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Refusal> {
        let flash = self.slots.as_mut().ok_or(SlotError::NoFlash)?;
        let uploading = self.uploading.as_mut().ok_or(SlotError::NotBegun)?;
        // A block that ends where the next one begins is a repetition.
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
        let upload = &uploading.upload;
        uploading.checked = Some(flash.check(|| upload.verify(flash.slots(), flash.fognet()))?);
        Ok(())
    }

    pub(super) fn weights_activate(&mut self) -> Result<(), Refusal> {
        let Uploading { upload, checked } = self.uploading.ok_or(SlotError::NotBegun)?;
        let file = checked.ok_or(SlotError::Incomplete { written: upload.written() })?;
        let accepted = self.accepted.with(upload.place(), file);
        self.store()?.set(&accepted)?;
        self.accepted = accepted;
        self.uploading = None;
        self.note(EventKind::WeightsAccepted(upload.place()));
        Ok(())
    }
}
