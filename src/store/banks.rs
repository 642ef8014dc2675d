//! Flash of two banks that swap, as an STM32H5 has it: the bank that runs is the lower half of the memory map, and the
//! other one is erased and written without a stall of the processor.
//!
//! | sectors of a bank | content |
//! |---|---|
//! | 0, 1 | boot loader, the same in both banks |
//! | 2 to 33 | image, up to [`MAX_IMAGE`](super::firmware::MAX_IMAGE) |
//! | 34 | trailer of the image ([`super::firmware`]) |
//! | 111 | number of the records |
//! | 112 to 127 | records |
//!
//! The image in bank 1 is that of slot A. Both slots take the same image, since the one that runs is always the lower one.
//!
//! This flash programs quad-words of 16 bytes, each once, since it keeps a code of each. Records and trailers consist of words, of
//! which some are later overwritten with zeros. So a word takes two quad-words: its value, and a mark that it is zero by now.
//! A power cut leaves a quad-word whose code does not fit; its word reads as zero, which no record's checksum fits.
//!
//! Records are written in the upper bank. After a swap the newest are in the lower one. The start then copies them to the upper
//! one and numbers them one higher, so that either image finds the newest, whichever way the banks swap and wherever the
//! power is cut.

use super::firmware::{self, MAX_IMAGE};
use super::layout::{BOOT_SIZE, FIRMWARE_SIZE};
use super::slot::Slot;
use core::ops::Range;
use embedded_storage::nor_flash::{ErrorType, NorFlash, NorFlashErrorKind as Kind, ReadNorFlash};

pub const BANK: u32 = 1 << 20;
pub const SECTOR: u32 = 8 << 10;
/// Bytes that are programmed at once.
pub const QUAD: usize = 16;
pub const IMAGE: u32 = BOOT_SIZE;
pub const TRAILER: u32 = IMAGE + FIRMWARE_SIZE;
const NUMBER: u32 = 111 * SECTOR;
/// Offset of the records in their bank.
pub const RECORDS: u32 = NUMBER + SECTOR;
const WORD: usize = 4;
/// Bytes of flash for each byte of words.
const SPREAD: u32 = (2 * QUAD / WORD) as u32;
/// Size of the records, bytes: two sectors of them.
const RECORDS_SIZE: u32 = (BANK - RECORDS) / SPREAD;
const ERASED: [u8; QUAD] = [0xFF; QUAD];

/// The flash, by offset into the memory map.
#[allow(clippy::missing_errors_doc, reason = "they are the part's own, but that of `read`")]
pub trait Banks {
    fn is_swapped(&self) -> bool;

    fn mapped(&self, range: Range<u32>) -> &[u8];

    /// Reads flash; a quad-word whose code does not fit is an error.
    fn read(&mut self, at: u32, bytes: &mut [u8]) -> Result<(), Kind>;

    fn erase(&mut self, sector: u32) -> Result<(), Kind>;

    fn write(&mut self, at: u32, quad: &[u8; QUAD]) -> Result<(), Kind>;
}

fn quad<F: Banks>(flash: &mut F, at: u32) -> Option<[u8; QUAD]> {
    let mut quad = ERASED;
    flash.read(at, &mut quad).ok().map(|()| quad)
}

fn program<F: Banks>(flash: &mut F, at: u32, written: &[u8; QUAD]) -> Result<(), Kind> {
    flash.write(at, written)?;
    if quad(flash, at) == Some(*written) { Ok(()) } else { Err(Kind::Other) }
}

fn is_erased<F: Banks>(flash: &mut F, sector: u32) -> bool {
    (sector..sector + SECTOR).step_by(QUAD).all(|at| quad(flash, at) == Some(ERASED))
}

/// Erases sectors, except those that are.
fn erase<F: Banks>(flash: &mut F, range: Range<u32>) -> Result<(), Kind> {
    for sector in range.step_by(SECTOR as usize) {
        if !is_erased(flash, sector) {
            flash.erase(sector)?;
            if !is_erased(flash, sector) {
                return Err(Kind::Other);
            }
        }
    }
    Ok(())
}

/// Returns the word whose quad-words are at an offset.
fn word<F: Banks>(flash: &mut F, at: u32) -> [u8; WORD] {
    let value = quad(flash, at).filter(|_| quad(flash, at + QUAD as u32) == Some(ERASED));
    value.and_then(|value| value.first_chunk().copied()).unwrap_or([0; WORD])
}

/// Writes a word into erased flash, or makes any one zero.
fn set_word<F: Banks>(flash: &mut F, at: u32, written: [u8; WORD]) -> Result<(), Kind> {
    let mut quad = ERASED;
    quad[..WORD].copy_from_slice(&written);
    match (word(flash, at), written) {
        (old, written) if old == written => Ok(()),
        ([0xFF, 0xFF, 0xFF, 0xFF], _) => program(flash, at, &quad),
        (_, [0, 0, 0, 0]) => program(flash, at + QUAD as u32, &[0; QUAD]),
        _ => Err(Kind::Other),
    }
}

/// Returns a trailer as this flash holds it.
pub fn spread(trailer: &[u8; firmware::TRAILER]) -> [u8; firmware::TRAILER * SPREAD as usize] {
    let mut flash = [0xFF; _];
    let places = flash.as_chunks_mut::<{ 2 * QUAD }>().0.iter_mut();
    places.zip(trailer.as_chunks::<WORD>().0).for_each(|(place, word)| place[..WORD].copy_from_slice(word));
    flash
}

fn read_words<F: Banks>(flash: &mut F, at: u32, bytes: &mut [u8]) {
    for (at, read) in (at..).step_by(SPREAD as usize * WORD).zip(bytes.as_chunks_mut().0) {
        *read = word(flash, at);
    }
}

fn write_words<F: Banks>(flash: &mut F, at: u32, bytes: &[u8]) -> Result<(), Kind> {
    let mut words = (at..).step_by(SPREAD as usize * WORD).zip(bytes.as_chunks().0);
    words.try_for_each(|(at, written)| set_word(flash, at, *written))
}

fn aligned(from: u32, to: u32, unit: u32) -> Result<(), Kind> {
    let fits = from.is_multiple_of(unit) && to.is_multiple_of(unit);
    if fits { Ok(()) } else { Err(Kind::NotAligned) }
}

pub struct Records<F>(F);

impl<F: Banks> Records<F> {
    /// Opens the records. If the newest ones are in the lower bank, it copies them to the upper one first.
    pub fn open(mut flash: F) -> Result<Self, Kind> {
        let [lower, upper] = [0, BANK].map(|bank| number(&mut flash, bank));
        if lower > upper {
            erase(&mut flash, BANK + NUMBER..2 * BANK)?;
            for offset in (RECORDS..BANK).step_by(SPREAD as usize * WORD) {
                let newest = word(&mut flash, offset);
                set_word(&mut flash, BANK + offset, newest)?;
            }
        } else if upper.is_some() {
            return Ok(Self(flash));
        } else {
            // The first start, or one that was interrupted.
            erase(&mut flash, BANK + NUMBER..BANK + RECORDS)?;
        }
        let next = lower.map_or(0, |lower| lower.saturating_add(1));
        let mut written = [next.to_le_bytes(); 4];
        written[1] = (!next).to_le_bytes();
        for at in [0, QUAD as u32] {
            program(&mut flash, BANK + NUMBER + at, bytemuck::must_cast_ref(&written))?;
        }
        Ok(Self(flash))
    }

    fn inside(offset: u32, len: usize) -> Result<u32, Kind> {
        let end = offset.saturating_add(len as u32);
        aligned(offset, end, WORD as u32)?;
        if end <= RECORDS_SIZE { Ok(BANK + RECORDS + offset * SPREAD) } else { Err(Kind::OutOfBounds) }
    }
}

/// Returns the number of a bank's records, which stands twice; `None` if they are not complete.
fn number<F: Banks>(flash: &mut F, bank: u32) -> Option<u32> {
    let mut places = [0, QUAD as u32].into_iter().filter_map(|at| quad(flash, bank + NUMBER + at));
    places.find_map(|quad| {
        let [number, inverse, ..] = bytemuck::must_cast::<_, [[u8; WORD]; 4]>(quad).map(u32::from_le_bytes);
        (number == !inverse).then_some(number)
    })
}

impl<F> ErrorType for Records<F> {
    type Error = Kind;
}

impl<F: Banks> ReadNorFlash for Records<F> {
    const READ_SIZE: usize = WORD;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), Kind> {
        read_words(&mut self.0, Self::inside(offset, bytes.len())?, bytes);
        Ok(())
    }

    fn capacity(&self) -> usize {
        RECORDS_SIZE as usize
    }
}

impl<F: Banks> NorFlash for Records<F> {
    const WRITE_SIZE: usize = WORD;
    const ERASE_SIZE: usize = RECORDS_SIZE as usize / 2;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), Kind> {
        aligned(from, to, Self::ERASE_SIZE as u32)?;
        let len = to.checked_sub(from).ok_or(Kind::OutOfBounds)?;
        let start = Self::inside(from, len as usize)?;
        erase(&mut self.0, start..start + len * SPREAD)
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Kind> {
        write_words(&mut self.0, Self::inside(offset, bytes.len())?, bytes)
    }
}

/// The slots for firmware, by the offsets of [`Slot::firmware`].
pub struct Slots<F>(pub F);

enum Place {
    Image(u32),
    Trailer(u32),
}

impl<F: Banks> Slots<F> {
    pub fn lower(&self) -> Slot {
        if self.0.is_swapped() { Slot::B } else { Slot::A }
    }

    fn bank(&self, slot: Slot) -> u32 {
        if slot == self.lower() { 0 } else { BANK }
    }

    fn place(&self, offset: u32, len: usize) -> Result<Place, Kind> {
        let slot = Slot::ALL.into_iter().find(|slot| slot.firmware().contains(&offset));
        let slot = slot.ok_or(Kind::OutOfBounds)?;
        let (bank, at) = (self.bank(slot), offset - slot.firmware().start);
        let end = at.saturating_add(len as u32);
        match at.checked_sub(MAX_IMAGE) {
            None if end <= MAX_IMAGE => Ok(Place::Image(bank + IMAGE + at)),
            Some(at) if end <= FIRMWARE_SIZE => {
                aligned(at, end, WORD as u32)?;
                Ok(Place::Trailer(bank + TRAILER + at * SPREAD))
            }
            _ => Err(Kind::OutOfBounds),
        }
    }
}

impl<F> ErrorType for Slots<F> {
    type Error = Kind;
}

impl<F: Banks> ReadNorFlash for Slots<F> {
    const READ_SIZE: usize = WORD;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), Kind> {
        match self.place(offset, bytes.len())? {
            Place::Image(at) => self.0.read(at, bytes),
            Place::Trailer(at) => {
                read_words(&mut self.0, at, bytes);
                Ok(())
            }
        }
    }

    fn capacity(&self) -> usize {
        BANK as usize
    }
}

impl<F: Banks> NorFlash for Slots<F> {
    const WRITE_SIZE: usize = WORD;
    const ERASE_SIZE: usize = FIRMWARE_SIZE as usize;

    /// Erases the whole slot of the upper bank, its trailer last: a trailer of which a cut leaves a part has no image.
    fn erase(&mut self, from: u32, to: u32) -> Result<(), Kind> {
        if (from..to) != self.lower().other().firmware() {
            return Err(Kind::OutOfBounds);
        }
        erase(&mut self.0, BANK + IMAGE..BANK + TRAILER + SECTOR)
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Kind> {
        match self.place(offset, bytes.len())? {
            Place::Image(at) if at >= BANK => {
                aligned(at, at, QUAD as u32)?;
                (at..).step_by(QUAD).zip(bytes.chunks(QUAD)).try_for_each(|(at, bytes)| {
                    let mut quad = ERASED;
                    quad.iter_mut().zip(bytes).for_each(|(place, byte)| *place = *byte);
                    program(&mut self.0, at, &quad)
                })
            }
            // The image that runs stays as it is.
            Place::Image(_) => Err(Kind::OutOfBounds),
            Place::Trailer(at) => write_words(&mut self.0, at, bytes),
        }
    }
}

#[cfg(feature = "service")]
impl<F: Banks> crate::service::MappedSlots for Slots<F> {
    fn slots(&self) -> [&[u8]; 2] {
        [&[]; 2]
    }

    /// Returns the slot that runs, if the other bank has the same boot loader: else a swap would start nothing.
    fn running(&self) -> Option<Slot> {
        let [lower, upper] = [0, BANK].map(|bank| self.0.mapped(bank..bank + BOOT_SIZE));
        (lower == upper).then(|| self.lower())
    }

    fn firmware(&self, slot: Slot) -> &[u8] {
        let image = self.bank(slot) + IMAGE;
        self.0.mapped(image..image + MAX_IMAGE)
    }
}
