//! Two places for firmware: which image starts, an image on trial, and the way back to the one before.
//!
//! An update is written to the slot that does not run, and its trailer last. The boot loader starts the newest whole
//! image that is confirmed or on trial. Each start on trial uses up a word of the trailer; an image that has failed
//! uses up all, so that the one before it starts. Nothing is copied or erased to go back, and all marks are words that
//! are programmed once: whatever a power cut leaves of one, the other slot's image starts.
//!
//! The trailer is the last 64 bytes of a slot: length of the image, its CRC-32, what it must reach on trial, its
//! number, a check word of these, three words for trials, and one for its confirmation.

use super::layout::{FIRMWARE_A, FIRMWARE_B, FIRMWARE_SIZE, LAYOUT};
use super::slot::Slot;
use crate::model::blob::CRC;
use core::ops::Range;
use embedded_storage::nor_flash::{NorFlash, ReadNorFlash};
use serde::{Deserialize, Serialize};

/// Place of the label in an image, behind the vectors of an STM32F405 or STM32H563.
pub const LABEL: usize = 0x260;
pub const LABEL_SIZE: usize = 24;
pub const TRAILER: usize = 64;
pub const MAX_IMAGE: u32 = FIRMWARE_SIZE - TRAILER as u32;
const MAGIC: [u8; 4] = *b"GNFW";
/// Starts on trial, if each ends in another way than by the watchdog: the supply fails, or the image resets itself.
const TRIALS: u32 = 3;
const CHECK: u32 = 16;
const TRIAL: u32 = 20;
const CONFIRMED: u32 = TRIAL + 4 * TRIALS;

/// Returns the three numbers of a version such as `env!("CARGO_PKG_VERSION")`.
pub const fn version(text: &str) -> [u8; 3] {
    let (mut numbers, mut k, mut rest) = ([0; 3], 0, text.as_bytes());
    while let [byte, behind @ ..] = rest
        && k < numbers.len()
    {
        match byte.wrapping_sub(b'0') {
            digit @ 0..=9 => numbers[k] = numbers[k] * 10 + digit,
            _ => k += 1,
        }
        rest = behind;
    }
    numbers
}

/// What an image is, and for which board.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Label {
    /// Version of the flash layout, [`LAYOUT`].
    pub layout: u8,
    pub version: [u8; 3],
    /// Name of the board, zeros behind it.
    pub board: [u8; 16],
}

impl Label {
    /// Returns the label of an image with this layout. The end of a longer name is cut off.
    pub const fn new(version: [u8; 3], name: &str) -> Self {
        let (mut board, mut k, mut from) = ([0; 16], 0, name.as_bytes());
        while let [byte, rest @ ..] = from
            && k < board.len()
        {
            board[k] = *byte;
            (k, from) = (k + 1, rest);
        }
        Self { layout: LAYOUT, version, board }
    }

    pub const fn bytes(&self) -> [u8; LABEL_SIZE] {
        let ([a, b, c, d], [x, y, z]) = (MAGIC, self.version);
        let [g, h, i, j, k, l, m, n, o, p, q, r, s, t, u, v] = self.board;
        [a, b, c, d, self.layout, x, y, z, g, h, i, j, k, l, m, n, o, p, q, r, s, t, u, v]
    }

    /// Reads a label; `None` if these bytes are none.
    pub fn parse(bytes: &[u8; LABEL_SIZE]) -> Option<Self> {
        let ([magic @ .., layout, x, y, z], board) = bytes.split_first_chunk::<8>()?;
        (*magic == MAGIC).then_some(Self {
            layout: *layout,
            version: [*x, *y, *z],
            board: board.try_into().ok()?,
        })
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, thiserror::Error)]
#[allow(missing_docs, reason = "its messages say it")]
pub enum FirmwareError {
    #[error("this image was not started by the boot loader: flash it with `cargo flash-board`")]
    NoBootLoader,
    #[error("this is no firmware update")]
    NotAnUpdate,
    #[error("the firmware is for another board")]
    Board,
    #[error("the firmware expects flash layout {found}, but the board has {expected}: flash it by the probe")]
    Layout { found: u8, expected: u8 },
    #[error("the firmware is older than the board's: give --downgrade if you want it")]
    Older,
    #[error("the firmware has {0} bytes: too many, or not as many as the head of the update says")]
    Length(u32),
    #[error("the running firmware is on trial: wait until it is confirmed")]
    OnTrial,
    #[error("the head of the update, data 011A, has to be written first")]
    NoHead,
    #[error("the image that was received is not the one that was signed")]
    Content,
}

/// What a trailer says about the image before it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Trailer {
    pub length: u32,
    pub crc: u32,
    /// Bits of what the image must reach on trial.
    pub expected: u32,
    /// Number of the update; the greatest is the newest.
    pub number: u32,
    pub trials: u32,
    pub is_confirmed: bool,
}

impl Trailer {
    /// Returns the trailer of an image before its first start.
    pub const fn new(length: u32, crc: u32, expected: u32, number: u32) -> Self {
        Self { length, crc, expected, number, trials: 0, is_confirmed: false }
    }

    fn words(&self) -> [u32; 4] {
        [self.length, self.crc, self.expected, self.number]
    }

    /// Returns the check word, which is never zero, so that zeros withdraw a trailer.
    fn check(&self) -> u32 {
        CRC.checksum(bytemuck::bytes_of(&self.words())) | 1
    }

    /// Returns the bytes of a slot's end before its image has started.
    pub fn bytes(&self) -> [u8; TRAILER] {
        let mut bytes = [0xFF; TRAILER];
        let confirmed = if self.is_confirmed { 0 } else { u32::MAX };
        let words = self.words().into_iter().chain([self.check(), u32::MAX, u32::MAX, u32::MAX, confirmed]);
        for (place, word) in bytes.as_chunks_mut::<4>().0.iter_mut().zip(words) {
            *place = word.to_le_bytes();
        }
        bytes
    }

    /// Reads the trailer of a slot; `None` if there is none, or it is damaged.
    pub fn read<F: ReadNorFlash>(flash: &mut F, slot: Slot) -> Option<Self> {
        let mut bytes = [0; TRAILER];
        flash.read(place(slot, 0), &mut bytes).ok()?;
        let mut words = bytes.as_chunks::<4>().0.iter().map(|word| u32::from_le_bytes(*word));
        let mut next = || words.next();
        let trailer = Self::new(next()?, next()?, next()?, next()?);
        if next()? != trailer.check() || trailer.length > MAX_IMAGE {
            return None;
        }
        let trials = (0..TRIALS).filter(|_| next().is_some_and(|word| word != u32::MAX)).count() as u32;
        Some(Self { trials, is_confirmed: next()? == 0, ..trailer })
    }
}

impl Slot {
    /// Returns the flash offsets of the slot for firmware: two sectors.
    pub const fn firmware(self) -> Range<u32> {
        match self {
            Self::A => FIRMWARE_A,
            Self::B => FIRMWARE_B,
        }
    }
}

/// Returns the flash offset of a word in a slot's trailer.
const fn place(slot: Slot, word: u32) -> u32 {
    slot.firmware().start + MAX_IMAGE + word
}

fn checksum<F: ReadNorFlash>(flash: &mut F, slot: Slot, length: u32) -> Result<u32, F::Error> {
    let (mut digest, mut piece) = (CRC.digest(), [0; 256]);
    for at in (0..length).step_by(piece.len()) {
        let piece = piece.get_mut(..(length - at).min(256) as usize).unwrap_or_default();
        flash.read(slot.firmware().start + at, piece)?;
        digest.update(piece);
    }
    Ok(digest.finalize())
}

pub fn label<F: ReadNorFlash>(flash: &mut F, slot: Slot) -> Option<Label> {
    let mut bytes = [0; LABEL_SIZE];
    flash.read(slot.firmware().start + LABEL as u32, &mut bytes).ok()?;
    Label::parse(&bytes)
}

/// Chooses the image to start, and uses up a trial if it is not confirmed; `has_failed`: the watchdog ended the last
/// run. Without a better one, a whole image that has failed is better than none.
pub fn select<F: NorFlash>(flash: &mut F, has_failed: bool) -> Option<Slot> {
    let numbers = Slot::ALL.map(|slot| Trailer::read(flash, slot).map_or(0, |trailer| trailer.number));
    let newest = if Slot::B.of(numbers) > Slot::A.of(numbers) { Slot::B } else { Slot::A };
    let order = [newest, newest.other()];
    let chosen = order.into_iter().find(|slot| {
        let Some(trailer) = Trailer::read(flash, *slot) else { return false };
        let trials = trailer.trials;
        let is_over = !trailer.is_confirmed && (trials >= TRIALS || trials > 0 && has_failed);
        if is_over {
            withdraw(flash, *slot, &trailer);
        }
        !is_over
            && is_whole(flash, *slot, &trailer)
            && (trailer.is_confirmed || mark(flash, *slot, TRIAL + 4 * trials))
    });
    let whole =
        |slot: &Slot| Trailer::read(flash, *slot).is_some_and(|trailer| is_whole(flash, *slot, &trailer));
    chosen.or_else(|| order.into_iter().find(whole))
}

fn is_whole<F: ReadNorFlash>(flash: &mut F, slot: Slot, trailer: &Trailer) -> bool {
    checksum(flash, slot, trailer.length).is_ok_and(|crc| crc == trailer.crc)
}

/// Uses up the trials that an image has left: it has failed. If they cannot be programmed, the next start tries again.
pub fn withdraw<F: NorFlash>(flash: &mut F, slot: Slot, trailer: &Trailer) {
    for trial in trailer.trials..TRIALS {
        mark(flash, slot, TRIAL + 4 * trial);
    }
}

/// Programs a word of a trailer to zero. Returns whether it was.
fn mark<F: NorFlash>(flash: &mut F, slot: Slot, word: u32) -> bool {
    flash.write(place(slot, word), &[0; 4]).is_ok()
}

/// Confirms the image on trial in a slot. Returns whether that is stored.
pub fn confirm<F: NorFlash>(flash: &mut F, slot: Slot) -> bool {
    mark(flash, slot, CONFIRMED)
}

/// Withdraws and erases an image, the trailer's words that count first: a cut leaves no valid mixture.
pub fn erase<F: NorFlash>(flash: &mut F, slot: Slot) -> Result<(), F::Error> {
    flash.write(place(slot, CHECK), &[0; 4])?;
    flash.write(place(slot, CHECK - 4), &[0; 4])?;
    let Range { start, end } = slot.firmware();
    flash.erase(start, end)
}

/// Makes the boot loader start a slot's image on trial.
pub fn activate<F: NorFlash>(flash: &mut F, slot: Slot, trailer: &Trailer) -> Result<(), F::Error> {
    let bytes = trailer.bytes();
    let (values, rest) = bytes.split_at(CHECK as usize);
    flash.write(place(slot, 0), values)?;
    flash.write(place(slot, CHECK), rest.get(..4).unwrap_or_default())
}
