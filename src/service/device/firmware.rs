//! Firmware updates: the image goes to the slot that does not run, starts on trial, and confirms itself.
//!
//! The image that runs notes what it has reached within its first half minute: samples of the sensor, a frame that
//! another node has acknowledged, a window of the network. The image on trial has a minute to reach the same; idle, which
//! serves diagnosis, asks for it. It is confirmed after a quarter of a minute at the earliest, in which all weights have been
//! checked once. If it does not reach it, hangs, or crashes three times, the boot loader starts the one before.

use super::weights::{Checked, Uploading};
use super::{Device, INTERRUPTS, MappedSlots};
use crate::model::blob::CRC;
use crate::service::message::{Firmware, FirmwareState, Refusal};
use crate::store::firmware::{self, FirmwareError, Label, MAX_IMAGE, Trailer};
use crate::store::slots::SlotError;
use crate::store::{FlashFault, Slot, Upload};
use embedded_storage::nor_flash::{NorFlash, NorFlashError as _};

/// Time in which an image counts what it reaches, the least time on trial, and the longest, ms.
const COUNTED_MS: u32 = 30_000;
const LEAST_MS: u32 = 15_000;
const LONGEST_MS: u32 = 60_000;
/// Bits of what an image has reached.
const SENSOR: u32 = 1;
const CAN: u32 = 1 << 1;
const WINDOW: u32 = 1 << 2;

impl Firmware {
    pub(super) fn of<W: MappedSlots>(flash: &mut W) -> Self {
        let Some(slot) = flash.running() else { return Self::ALONE };
        let Some(own) = Trailer::read(flash, slot) else { return Self::ALONE };
        let newer = Trailer::read(flash, slot.other()).filter(|other| other.number > own.number);
        let state = match newer {
            _ if !own.is_confirmed => FirmwareState::OnTrial,
            Some(Trailer { is_confirmed: false, trials: 1.., .. }) => FirmwareState::RolledBack,
            Some(_) => FirmwareState::NewerDamaged,
            None => FirmwareState::Confirmed,
        };
        Self { slot: Some(slot), crc: Some(own.crc), state }
    }
}

impl<R: NorFlash, W: MappedSlots> Device<R, W> {
    /// Checks what an update is, and returns the slot that it goes to, which does not run.
    pub fn firmware_check(&mut self, label: &Label, downgrade: bool) -> Result<Slot, Refusal> {
        self.request(false, |device| {
            let running = device.info.firmware.slot.zip(device.slots.as_mut());
            let own = running.and_then(|(slot, flash)| Some((slot, firmware::label(flash, slot)?)));
            let (slot, own) = own.ok_or(FirmwareError::NoBootLoader)?;
            let refused = if label.board != own.board {
                FirmwareError::Board
            } else if label.layout != own.layout {
                FirmwareError::Layout { found: label.layout, expected: own.layout }
            } else if label.version < own.version && !downgrade {
                FirmwareError::Older
            } else if device.info.firmware.state == FirmwareState::OnTrial {
                FirmwareError::OnTrial
            } else {
                return Ok(slot.other());
            };
            Err(refused.into())
        })
    }

    /// Begins the upload of an image to a slot that does not run, and erases it.
    #[inline(never)]
    pub fn firmware_begin(&mut self, slot: Slot, length: u32) -> Result<(), Refusal> {
        self.request(INTERRUPTS, |device| {
            if length == 0 || length > MAX_IMAGE || !length.is_multiple_of(4) {
                return Err(FirmwareError::Length(length).into());
            }
            if device.info.firmware.slot != Some(slot.other()) {
                return Err(FirmwareError::NoBootLoader.into());
            }
            device.uploading = None;
            let flash = device.slots.as_mut().ok_or(SlotError::NoFlash)?;
            let upload = Upload::firmware(flash, slot, length)?;
            device.uploading = Some(Uploading { upload, checked: None });
            Ok(())
        })
    }

    /// Checks the complete image: its label, and by `of`, which makes of its bytes what is returned if they are right.
    #[inline(never)]
    pub fn firmware_verify<T>(
        &mut self,
        expected: &Label,
        of: impl FnOnce(&[u8]) -> Option<T>,
    ) -> Result<T, Refusal> {
        self.request(false, |device| {
            let flash = device.slots.as_mut().ok_or(SlotError::NoFlash)?;
            let uploading = device.uploading.as_mut().ok_or(SlotError::NotBegun)?;
            let (slot, length, written) = uploading.upload.image().ok_or(SlotError::NotBegun)?;
            if written != length {
                return Err(SlotError::Incomplete { written }.into());
            }
            let image = flash.firmware(slot).get(..length as usize).unwrap_or_default();
            let found = flash.check(|| Some((of(image)?, CRC.checksum(image))));
            let is_named = firmware::label(flash, slot) == Some(*expected);
            let (result, crc) = found.filter(|_| is_named).ok_or(FirmwareError::Content)?;
            uploading.checked = Some(Checked { crc, window: 0 });
            Ok(result)
        })
    }

    /// Lets the checked image start on trial at the next start. It has to reach what this one has reached.
    #[inline(never)]
    pub fn firmware_activate(&mut self) -> Result<(), Refusal> {
        self.request(INTERRUPTS, |device| {
            let Uploading { upload, checked } = device.uploading.ok_or(SlotError::NotBegun)?;
            let (slot, length, written) = upload.image().ok_or(SlotError::NotBegun)?;
            let Checked { crc, .. } = checked.ok_or(SlotError::Incomplete { written })?;
            let flash = device.slots.as_mut().ok_or(SlotError::NoFlash)?;
            let number = Trailer::read(flash, slot.other()).map_or(0, |own| own.number).wrapping_add(1);
            let trailer = Trailer::new(length, crc, device.reached, number);
            firmware::activate(flash, slot, &trailer)
                .map_err(|error| SlotError::Flash(FlashFault::from(error.kind())))?;
            device.uploading = None;
            Ok(())
        })
    }

    /// Notes what has been reached, and confirms an image on trial with enough of it. Returns whether the board must
    /// restart for the lack of it, and the boot loader start the other. Idle calls it, with the time since the start.
    pub fn firmware_trial(&mut self, is_acknowledged: bool, windows: u32, milliseconds: u32) -> bool {
        let on_trial = self.info.firmware.state == FirmwareState::OnTrial;
        if on_trial || milliseconds < COUNTED_MS {
            self.reached |= if is_acknowledged { CAN } else { 0 } | if windows > 0 { WINDOW } else { 0 };
            self.reached |= if self.has_sample { SENSOR } else { 0 };
        }
        let Some((slot, flash)) = self.info.firmware.slot.filter(|_| on_trial).zip(self.slots.as_mut())
        else {
            return false;
        };
        let trailer = Trailer::read(flash, slot);
        let expected = trailer.map_or(u32::MAX, |trailer| trailer.expected);
        if milliseconds >= LEAST_MS && expected & !self.reached == 0 && firmware::confirm(flash, slot) {
            self.info.firmware.state = FirmwareState::Confirmed;
            return false;
        }
        let has_failed = milliseconds >= LONGEST_MS;
        if let Some(trailer) = trailer.filter(|_| has_failed) {
            firmware::withdraw(flash, slot, &trailer);
        }
        has_failed
    }
}
