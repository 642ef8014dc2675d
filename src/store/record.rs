//! The record store keeps records in two flash sectors; each record has a key, and the newest record of a key is
//! valid.
//!
//! A sector contains a header of two words, followed by the records:
//!
//! | words | record | | header |
//! |---|---|---|---|
//! | 1 | key, layout version, length n (u16) | 1 | generation |
//! | n / 4, rounded up | postcard's encoding, then FF | 1 | CRC-32 of the generation |
//! | 1 | CRC-32 of all words before it | | |
//!
//! All values are little-endian. Records are appended until the sector in use is full, or ends with a record that a
//! power cut has torn. Then the *other* sector is erased, and the newest record of each key is copied there, together
//! with the new one. The header is written last, with the next generation; only then does the other sector become the
//! one in use. The sector in use is thus never erased or rewritten, and an erase that is interrupted does no harm. If
//! the configuration was damaged, a record of layout 0 marks that in the new sector.

use super::Configuration;
use super::error::{FieldError, FlashFault, StoreError};
use crate::model::blob::CRC;
use core::ops::Range;
use embedded_storage::nor_flash::{NorFlash, NorFlashError, NorFlashErrorKind};
use serde::{Serialize, de::DeserializeOwned};

const WORD: usize = 4;
const WORD_U32: u32 = WORD as u32;
/// Length of the sector header, bytes.
const HEADER: u32 = 2 * WORD_U32;
/// Length of the longest encoded record, bytes.
pub(crate) const MAX_LEN: usize = 260;
/// Length of the longest record with its first and last word, bytes.
const BUFFER: usize = MAX_LEN + 2 * WORD;
/// Number of records of maximum length that must fit without an erase after a start.
const FEW: u32 = 8;
/// Layout version that marks a lost record; real layout versions begin at 1.
const LOST: u8 = 0;
/// Highest key of a record.
const MAX_KEY: u8 = 7;
/// Constant in the header's checksum that distinguishes our sectors from other uses of the flash.
const FORMAT: u32 = u32::from_le_bytes(*b"GYR1");

/// A type that can be stored: its key, its layout version, and the check of its values.
pub trait Record: Serialize + DeserializeOwned {
    /// Key of this kind of record, 1 to 7; a key is never reused for another kind.
    const KEY: u8;
    /// Version of the layout; every change increments it.
    const VERSION: u8;

    /// Checks that all values are inside their ranges.
    ///
    /// # Errors
    /// [`FieldError`], which names the first value out of range.
    fn check(&self) -> Result<(), FieldError>;
}

/// A record as stored in flash.
#[derive(Clone, Copy)]
struct Raw {
    words: [u8; BUFFER],
    len: usize,
}

impl Raw {
    const EMPTY: Self = Self { words: [0; BUFFER], len: 0 };

    const fn size(len: usize) -> usize {
        2 * WORD + len.next_multiple_of(WORD)
    }

    /// Encodes a record; `None` if it does not fit.
    fn encode<R: Record>(&mut self, record: &R) -> Option<()> {
        let (first, rest) = self.words.split_first_chunk_mut::<WORD>()?;
        let len = postcard::to_slice(record, rest.get_mut(..MAX_LEN)?).ok()?.len();
        // The encoder may have written beyond the end of the record.
        rest.get_mut(len..)?.fill(0xFF);
        let [low, high] = u16::try_from(len).ok()?.to_le_bytes();
        *first = [R::KEY, R::VERSION, low, high];
        self.len = len;
        let crc = CRC.checksum(self.bytes().get(..Self::size(len) - WORD)?);
        *self.words.get_mut(..Self::size(len))?.last_chunk_mut()? = crc.to_le_bytes();
        Some(())
    }

    /// Writes the mark of a lost record.
    fn mark_lost(&mut self, key: u8) {
        (self.words, self.len) = ([0xFF; BUFFER], 0);
        self.words[..WORD].copy_from_slice(&[key, LOST, 0, 0]);
        let crc = CRC.checksum(&self.words[..WORD]).to_le_bytes();
        self.words[WORD..2 * WORD].copy_from_slice(&crc);
    }

    fn bytes(&self) -> &[u8] {
        self.words.get(..Self::size(self.len)).unwrap_or_default()
    }

    const fn key(&self) -> u8 {
        self.words[0]
    }

    fn is_intact(&self) -> bool {
        let bytes = self.bytes();
        let content = bytes.get(..bytes.len().wrapping_sub(WORD));
        let crc = content.map(|content| CRC.checksum(content).to_le_bytes());
        crc.is_some_and(|crc| bytes.ends_with(&crc))
    }

    fn decode<R: Record>(&self) -> Result<R, StoreError> {
        let [_, found, ..] = self.words;
        if found == LOST {
            return Err(StoreError::Lost);
        }
        if found != R::VERSION {
            return Err(StoreError::Version { found, expected: R::VERSION });
        }
        let content = self.words.get(WORD..WORD + self.len).ok_or(StoreError::Encoding)?;
        let (record, rest) = postcard::take_from_bytes::<R>(content).map_err(|_| StoreError::Encoding)?;
        if !rest.is_empty() {
            return Err(StoreError::Encoding);
        }
        record.check()?;
        Ok(record)
    }
}

/// The content found at an offset in a sector.
enum Place {
    /// A record, which may be torn.
    Record,
    /// Erased flash.
    Blank,
    /// No record: the bytes are not those of a record, or the sector ends here.
    End,
}

/// The store of the newest record of each kind, in two flash sectors that are used alternately.
pub struct Store<F> {
    flash: F,
    start: u32,
    /// Sector in use, and its generation.
    current: Option<(u32, u32)>,
    /// Offset of the next record, if one can be appended.
    free: Option<u32>,
    damaged: bool,
    /// True if a damaged record may have been the configuration.
    configuration_damaged: bool,
    /// True if a header is neither valid nor blank; the newest sector may then be lost.
    header_damaged: bool,
}

impl<F: NorFlash> Store<F> {
    /// Opens the store in the two sectors that begin at offset `start` of `flash`; writes nothing. Erased flash reads
    /// as ones; sectors of zeros were overwritten by a raw image of the flash, and are reported as damaged.
    ///
    /// # Errors
    /// [`StoreError::Flash`].
    pub fn open(flash: F, start: u32) -> Result<Self, StoreError> {
        const { assert!(F::READ_SIZE <= WORD && WORD.is_multiple_of(F::WRITE_SIZE)) };
        let mut store = Self {
            flash,
            start,
            current: None,
            free: None,
            damaged: false,
            configuration_damaged: false,
            header_damaged: false,
        };
        for sector in [0, 1] {
            let generation = store.generation(sector)?;
            let newest = store.current.map(|(_, generation)| generation);
            if generation > newest {
                store.current = generation.map(|generation| (sector, generation));
            }
        }
        if store.current.is_some() {
            // No record has key 0, so the search reads all records.
            let mut nothing = Raw::EMPTY;
            store.find(0, &mut nothing)?;
        }
        Ok(store)
    }

    /// Returns whether a damaged record or sector header was found, because of a power cut or flipped bits. The
    /// previous record is then used.
    #[must_use]
    pub fn damaged(&self) -> bool {
        self.damaged || self.header_damaged
    }

    /// Returns the newest intact record; `None` if there is none.
    ///
    /// # Errors
    /// [`StoreError`] if the flash cannot be read, or the record has an unknown layout, does not decode or has a
    /// value out of range.
    pub fn get<R: Record>(&mut self) -> Result<Option<R>, StoreError> {
        let mut raw = Raw::EMPTY;
        if self.find(R::KEY, &mut raw)? { raw.decode().map(Some) } else { Ok(None) }
    }

    /// Stores a record and reads it back. Until the new record is complete, the previous one remains valid.
    ///
    /// # Errors
    /// [`StoreError::Field`] for a value out of range; nothing is written then. [`StoreError::Flash`] or
    /// [`StoreError::Full`] if the record could not be written.
    #[inline(never)]
    pub fn set<R: Record>(&mut self, record: &R) -> Result<(), StoreError> {
        record.check()?;
        let mut raw = Raw::EMPTY;
        raw.encode(record).ok_or(StoreError::Full)?;
        self.write(&raw)
    }

    /// Returns whether the next record of any length fits without an erase.
    #[must_use]
    pub fn has_room(&self) -> bool {
        self.room() >= BUFFER as u32
    }

    /// Returns the number of free bytes in the sector in use.
    fn room(&self) -> u32 {
        let end = self.current.map(|(sector, _)| self.range(sector).end);
        self.free.zip(end).map_or(0, |(at, end)| end.saturating_sub(at))
    }

    /// If little room is left, erases the other sector and moves the newest records there. Call it at the start, when
    /// an erase disturbs nothing: records stored while the vehicle drives must fit without an erase.
    ///
    /// # Errors
    /// [`StoreError::Flash`].
    pub fn make_room(&mut self) -> Result<(), StoreError> {
        let mut raw = Raw::EMPTY;
        if self.current.is_none() || self.room() >= FEW * BUFFER as u32 {
            return Ok(());
        }
        for key in 1..=MAX_KEY {
            if self.find(key, &mut raw)? {
                return self.change_sector(&raw);
            }
        }
        Ok(())
    }

    /// Writes an encoded record. It is not generic, unlike [`Store::set`], which is compiled once for each kind of
    /// record.
    #[inline(never)]
    fn write(&mut self, raw: &Raw) -> Result<(), StoreError> {
        let appended = match (self.current, self.free) {
            (Some((sector, _)), Some(at)) => self.append(sector, at, raw)?,
            _ => None,
        };
        if appended.is_none() {
            self.change_sector(raw)?;
        }
        let mut stored = Raw::EMPTY;
        if self.find(raw.key(), &mut stored)? && stored.bytes() == raw.bytes() {
            Ok(())
        } else {
            Err(StoreError::Flash(FlashFault::Refused))
        }
    }

    fn range(&self, sector: u32) -> Range<u32> {
        let start = self.start + sector * F::ERASE_SIZE as u32;
        start..start + F::ERASE_SIZE as u32
    }

    fn read<const N: usize>(&mut self, at: u32) -> Result<[u8; N], StoreError> {
        let mut bytes = [0; N];
        self.flash.read(at, &mut bytes).map_err(fault)?;
        Ok(bytes)
    }

    fn generation(&mut self, sector: u32) -> Result<Option<u32>, StoreError> {
        let at = self.range(sector).start;
        let generation = u32::from_le_bytes(self.read(at)?);
        let crc = u32::from_le_bytes(self.read(at + WORD_U32)?);
        let intact = crc == header_crc(generation);
        let blank = generation == u32::MAX && crc == u32::MAX;
        self.header_damaged |= !intact && !blank;
        Ok(intact.then_some(generation))
    }

    /// Reads the record at offset `at` into `raw`, if there is one.
    fn place(&mut self, sector: u32, at: u32, raw: &mut Raw) -> Result<Place, StoreError> {
        let end = self.range(sector).end;
        if at + WORD_U32 > end {
            return Ok(Place::End);
        }
        let first = self.read::<WORD>(at)?;
        if first == [0xFF; WORD] {
            return Ok(Place::Blank);
        }
        let [_, _, low, high] = first;
        let len = usize::from(u16::from_le_bytes([low, high]));
        let fits = len <= MAX_LEN && at + Raw::size(len) as u32 <= end;
        raw.len = len;
        match raw.words.get_mut(..Raw::size(len)) {
            Some(words) if fits => self.flash.read(at, words).map_err(fault)?,
            _ => return Ok(Place::End),
        }
        Ok(Place::Record)
    }

    /// Copies the newest intact record of a key into `newest`, and returns whether there is one. Also updates `free`
    /// and the damage flags.
    #[inline(never)]
    fn find(&mut self, key: u8, newest: &mut Raw) -> Result<bool, StoreError> {
        let Some((sector, _)) = self.current else { return Ok(false) };
        let mut at = self.range(sector).start + HEADER;
        let mut raw = Raw::EMPTY;
        let mut found = false;
        (self.damaged, self.configuration_damaged) = (false, false);
        loop {
            // Each iteration advances by the length of a record, at least two words.
            match self.place(sector, at, &mut raw)? {
                Place::Record => {
                    at += Raw::size(raw.len) as u32;
                    if !raw.is_intact() {
                        self.damaged = true;
                        // A power cut leaves the first word intact, which holds the key; flipped bits may not.
                        self.configuration_damaged |= !(2..=MAX_KEY).contains(&raw.key());
                    } else if raw.key() == key {
                        *newest = raw;
                        found = true;
                    }
                }
                // No record is appended after one that may be torn.
                Place::Blank => {
                    self.free = (!self.damaged()).then_some(at);
                    return Ok(found);
                }
                Place::End => {
                    let is_damage = at + WORD_U32 <= self.range(sector).end;
                    self.damaged |= is_damage;
                    self.configuration_damaged |= is_damage;
                    self.free = None;
                    return Ok(found);
                }
            }
        }
    }

    /// Writes a record at offset `at` and returns the offset of the next one; `None` if the record does not fit.
    fn append(&mut self, sector: u32, at: u32, raw: &Raw) -> Result<Option<u32>, StoreError> {
        let end = at + raw.bytes().len() as u32;
        if end > self.range(sector).end {
            return Ok(None);
        }
        let written = self.flash.write(at, raw.bytes()).map_err(fault);
        if written.is_err() {
            // Some of its words may be programmed.
            self.free = None;
        }
        written.map(|()| Some(end))
    }

    /// Fills the other sector with the newest record of each key, including the given one, and switches to it. A mark
    /// replaces a damaged configuration, which then reads as [`StoreError::Lost`] until a new one is stored: the
    /// sensor's axes are unknown meanwhile.
    #[inline(never)]
    fn change_sector(&mut self, newest: &Raw) -> Result<(), StoreError> {
        let (sector, generation) = match self.current {
            Some((sector, generation)) => (1 - sector, generation.wrapping_add(1)),
            None => (0, 1),
        };
        let Range { start, end } = self.range(sector);
        self.flash.erase(start, end).map_err(fault)?;
        let mut at = start + HEADER;
        let mut raw = Raw::EMPTY;
        for key in (1..=MAX_KEY).filter(|key| *key != newest.key()) {
            let is_lost =
                !self.find(key, &mut raw)? && key == Configuration::KEY && self.configuration_damaged;
            if is_lost {
                raw.mark_lost(key);
            } else if raw.key() != key {
                continue;
            }
            at = self.append(sector, at, &raw)?.ok_or(StoreError::Full)?;
        }
        let free = self.append(sector, at, newest)?.ok_or(StoreError::Full)?;
        self.flash.write(start, &generation.to_le_bytes()).map_err(fault)?;
        self.flash.write(start + WORD_U32, &header_crc(generation).to_le_bytes()).map_err(fault)?;
        // The header of the previous sector was good, if there was one.
        self.header_damaged &= self.current.is_none();
        (self.current, self.free) = (Some((sector, generation)), Some(free));
        Ok(())
    }
}

fn header_crc(generation: u32) -> u32 {
    CRC.checksum(&(generation ^ FORMAT).to_le_bytes())
}

fn fault(error: impl NorFlashError) -> StoreError {
    StoreError::Flash(FlashFault::from(error.kind()))
}

impl From<NorFlashErrorKind> for FlashFault {
    fn from(kind: NorFlashErrorKind) -> Self {
        match kind {
            NorFlashErrorKind::NotAligned => Self::NotAligned,
            NorFlashErrorKind::OutOfBounds => Self::OutOfBounds,
            _ => Self::Refused,
        }
    }
}
