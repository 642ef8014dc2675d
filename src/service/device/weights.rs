//! Selection and upload of weight files. A new file is written to the unused slot while GyroNet runs.

use super::{Device, INTERRUPTS};
use crate::model::Blob;
use crate::service::message::Refusal;
use crate::store::slots::{Selection, SlotError, WeightSource, select};
use crate::store::{Accepted, Slot, Upload};
use embedded_storage::nor_flash::NorFlash;

/// The flash of the weight files, memory-mapped for reading. Offsets are from the start of the flash.
pub trait MappedSlots: NorFlash {
    /// Returns both slots, aligned to words.
    fn slots(&self) -> [&[u8]; 2];

    /// Returns the slot of the firmware that runs; `None` if it can have no other.
    fn running(&self) -> Option<Slot> {
        None
    }

    /// Returns the content of a slot for firmware.
    fn firmware(&self, _: Slot) -> &[u8] {
        &[]
    }

    /// Runs a check of a file or signature, a tenth of a second at 168 MHz: a board may extend its watchdog.
    fn check<T>(&self, work: impl FnOnce() -> T) -> T {
        work()
    }
}

#[derive(Debug, Clone, Copy)]
pub(super) struct Uploading {
    pub(super) upload: Upload,
    pub(super) checked: Option<Checked>,
}

#[derive(Debug, Clone, Copy)]
pub(super) struct Checked {
    pub(super) crc: u32,
    /// Largest cost of a window of weights, cycles.
    pub(super) window: u32,
}

impl<R: NorFlash, W: MappedSlots> Device<R, W> {
    /// Selects the weights to run from `slots`, as the processor reads them, else from the image itself.
    pub fn weights<'w>(&mut self, slots: Option<[&'w [u8]; 2]>, built_in: &'w [u8]) -> Option<Blob<'w>> {
        let available = self.configuration.compensate.stride.window_cycles(self.info.identity.clock_hz);
        let accepted = if self.has_failed() { &Accepted::NONE } else { &self.accepted };
        let Selection { weights, source, refused } =
            select(accepted, slots.unwrap_or_default(), built_in, available);
        self.info.weights = source;
        self.info.weights_crc = weights.map(|blob| blob.crc);
        let slow = refused.into_iter().flatten().find_map(|error| match error {
            SlotError::Slow { cycles, .. } => Some(cycles),
            _ => None,
        });
        self.next_window = slow.or(weights.map(|blob| blob.shape.window_cycles())).unwrap_or(0);
        self.info.refused_slots = refused;
        self.refused |= refused.iter().any(Option::is_some) || source == WeightSource::None;
        weights
    }

    /// Notes that the weights in use are damaged: not used until the next start, which checks all files.
    pub fn weights_damaged(&mut self) {
        self.info.weights = WeightSource::None;
        self.info.weights_crc = None;
    }

    /// Returns the slot to overwrite: one that GyroNet does not run on.
    fn unused_slot(&self) -> Slot {
        match self.info.weights {
            WeightSource::Slot(slot) => slot.other(),
            // GyroNet runs on neither slot; keep the file that was accepted last.
            WeightSource::BuiltIn | WeightSource::None => self.accepted.active.map_or(Slot::A, Slot::other),
        }
    }

    /// Begins the upload of a weight file of this length, bytes, and erases the unused slot.
    #[inline(never)]
    pub fn weights_begin(&mut self, length: u32) -> Result<(), Refusal> {
        self.request(INTERRUPTS, |device| {
            let slot = device.unused_slot();
            Upload::check(slot, length)?;
            device.uploading = None;
            if device.slots.is_none() {
                return Err(SlotError::NoFlash.into());
            }
            // Withdraw the acceptance of the old file: a new file could have the same checksum by intent.
            let accepted = device.accepted.without(slot);
            if accepted != device.accepted {
                device.store.as_mut().ok_or(SlotError::NoFlash)?.set(&accepted)?;
                device.accepted = accepted;
            }
            let flash = device.slots.as_mut().ok_or(SlotError::NoFlash)?;
            let upload = Upload::begin(flash, slot, length)?;
            device.uploading = Some(Uploading { upload, checked: None });
            Ok(())
        })
    }

    /// Returns the upload of a file or an image that is in progress.
    pub fn upload(&self) -> Option<&Upload> {
        self.uploading.as_ref().map(|uploading| &uploading.upload)
    }

    /// Writes the next block of the file or image, a whole number of words.
    pub fn upload_block(&mut self, bytes: &[u8]) -> Result<(), Refusal> {
        self.request(INTERRUPTS, |device| {
            let flash = device.slots.as_mut().ok_or(SlotError::NoFlash)?;
            let uploading = device.uploading.as_mut().ok_or(SlotError::NotBegun)?;
            uploading.upload.block(flash, bytes).map_err(|error| {
                if let SlotError::Flash(_) = error {
                    device.uploading = None;
                }
                error.into()
            })
        })
    }

    /// Checks the complete file, and returns what `of` makes of its bytes.
    #[inline(never)]
    pub fn weights_verify<T>(&mut self, of: impl FnOnce(&[u8]) -> T) -> Result<T, Refusal> {
        self.request(false, |device| {
            let flash = device.slots.as_ref().ok_or(SlotError::NoFlash)?;
            let uploading = device.uploading.as_mut().filter(|uploading| uploading.upload.image().is_none());
            let uploading = uploading.ok_or(SlotError::NotBegun)?;
            let upload = &uploading.upload;
            let of_file = || upload.verify(flash.slots()).map(|(bytes, blob)| (of(bytes), blob));
            let (result, Blob { crc, shape, .. }) = flash.check(of_file)?;
            uploading.checked = Some(Checked { crc, window: shape.window_cycles() });
            Ok(result)
        })
    }

    /// Uses the checked file from the next start on.
    #[inline(never)]
    pub fn weights_activate(&mut self) -> Result<(), Refusal> {
        self.request(INTERRUPTS, |device| {
            let uploading = device.uploading.filter(|uploading| uploading.upload.image().is_none());
            let Uploading { upload, checked } = uploading.ok_or(SlotError::NotBegun)?;
            let Checked { crc, window: cycles } =
                checked.ok_or(SlotError::Incomplete { written: upload.written() })?;
            let stride = device.next_configuration.compensate.stride;
            let available = stride.window_cycles(device.supported.clock_hz);
            if cycles > available {
                return Err(SlotError::Slow { cycles, available }.into());
            }
            let accepted = device.accepted.with(upload.slot(), crc);
            device.store()?.set(&accepted)?;
            (device.accepted, device.next_window) = (accepted, cycles);
            device.uploading = None;
            Ok(())
        })
    }
}
