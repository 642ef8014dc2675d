//! GyroNet runs on one weight file, while another one is written to the slot that is not in use. FoGNet's file has one
//! place, and FoGNet stops when another one is written there.

use super::Device;
use crate::fog::FogNetUse;
use crate::model::{Blob, FogBlob};
use crate::service::event::EventKind;
use crate::service::message::{BLOCK, Network, Refusal};
use crate::store::slots::{self, Selection, SlotError, WeightSource, select};
use crate::store::{Place, Slot, Upload};
use embedded_storage::nor_flash::NorFlash;

/// The flash of the weight files, which the processor can also read in place. Offsets are those into the whole flash.
pub trait MappedSlots: NorFlash {
    /// Returns both slots, each on a word boundary.
    fn slots(&self) -> [&[u8]; 2];
    /// Returns the place of FoGNet's file, on a word boundary.
    fn fognet(&self) -> &[u8];

    /// Checks a file: a tenth of a second, for which a board may have to lengthen its watchdog.
    fn check<T>(&self, work: impl FnOnce() -> T) -> T {
        work()
    }
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

    /// Selects FoGNet's weights from its place as the processor reads it; `None` where FoGNet is off, or the file is
    /// refused, which is noted.
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

    /// Returns once whether FoGNet's file has been erased or damaged since the start: what runs on it must stop, and
    /// [`Coprocessor::fognet_gone`](crate::Coprocessor::fognet_gone).
    pub fn take_fognet_gone(&mut self) -> bool {
        core::mem::take(&mut self.fognet_gone)
    }

    /// Notes that FoGNet's file no longer fits its checksum; it is not used until the next start, which checks it again.
    pub fn fognet_damaged(&mut self) {
        if let Some(Ok(crc)) = self.fognet {
            self.lose_fognet(SlotError::NotAccepted(crc));
            self.note(EventKind::WeightsDamaged);
        }
    }

    fn lose_fognet(&mut self, why: SlotError) {
        self.fognet = self.fognet.map(|_| Err(why));
        self.fognet_gone = true;
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
        // What was accepted there is no more: whoever uploads can give a file any checksum.
        let accepted = self.accepted.without(place);
        if accepted != self.accepted {
            self.store.as_mut().ok_or(SlotError::NoFlash)?.set(&accepted)?;
            self.accepted = accepted;
        }
        if network == Network::FogNet {
            // An erase that fails may have erased a part.
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
