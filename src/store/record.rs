//! Records lie in two sectors of flash; each is found by its key, and the newest with a key is valid.
//!
//! A sector is a header of two words, then records one behind the other:
//!
//! | words | record | | header |
//! |---|---|---|---|
//! | 1 | key, version of its layout, length n (u16) | 1 | generation |
//! | n / 4, rounded up | postcard's encoding, then FF | 1 | CRC-32 of the generation |
//! | 1 | CRC-32 of all words before it | | |
//!
//! All little-endian. Records are appended until the sector in use is full, or ends in a record that a power cut has
//! torn. Then the *other* sector is erased, the newest record of each key is copied there with the new one, and the
//! header comes last, with the next generation: only then does that sector take over. So the sector in use is never the
//! one being erased or filled, and it does not matter in what state an interrupted erasure leaves the other. Where the
//! configuration was damaged, a record of layout 0 says so there.

use super::Configuration;
use super::error::{FieldError, FlashFault, StoreError};
use crate::model::blob::CRC;
use core::ops::Range;
use embedded_storage::nor_flash::{NorFlash, NorFlashError, NorFlashErrorKind};
use serde::{Serialize, de::DeserializeOwned};

const WORD: usize = 4;
const WORD_U32: u32 = WORD as u32;
/// Bytes of a sector's header.
const HEADER: u32 = 2 * WORD_U32;
/// Most bytes of an encoded record.
pub(crate) const MAX_LEN: usize = 248;
/// The longest record, with its first and last word.
const BUFFER: usize = MAX_LEN + 2 * WORD;
/// Records of the longest kind that must fit after a start.
const FEW: u32 = 8;
/// The layout of a record that was lost; those of records begin at 1.
const LOST: u8 = 0;
/// Highest key.
const MAX_KEY: u8 = 7;
/// This mark in the header's checksum tells our sectors from other uses of the flash.
const FORMAT: u32 = u32::from_le_bytes(*b"GYR1");

/// Gives a stored type its key, the version of its layout, and its ranges.
pub trait Record: Serialize + DeserializeOwned {
    /// The key of this kind of record, 1 to 7; a key is never reused for another kind.
    const KEY: u8;
    /// The version of the layout; every change raises it.
    const VERSION: u8;

    /// Returns the bytes that a record of an older layout lacks at its end; `None` where this firmware does not
    /// read that layout.
    fn missing(_version: u8) -> Option<&'static [u8]> {
        None
    }

    /// Checks that all values are inside their ranges.
    ///
    /// # Errors
    /// [`FieldError`], which names the first value that is not.
    fn check(&self) -> Result<(), FieldError>;
}

/// Holds a record as it lies in flash.
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

    /// Encodes a record; `None` when it does not fit.
    fn encode<R: Record>(&mut self, record: &R) -> Option<()> {
        let (first, rest) = self.words.split_first_chunk_mut::<WORD>()?;
        let len = postcard::to_slice(record, rest.get_mut(..MAX_LEN)?).ok()?.len();
        // The encoder may leave bytes behind its end.
        rest.get_mut(len..)?.fill(0xFF);
        let [low, high] = u16::try_from(len).ok()?.to_le_bytes();
        *first = [R::KEY, R::VERSION, low, high];
        self.len = len;
        let crc = CRC.checksum(self.bytes().get(..Self::size(len) - WORD)?);
        *self.words.get_mut(..Self::size(len))?.last_chunk_mut()? = crc.to_le_bytes();
        Some(())
    }

    /// Makes the mark of a record that was lost.
    fn lose(&mut self, key: u8) {
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

    fn is_whole(&self) -> bool {
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
        let missing = if found == R::VERSION { Some(&[][..]) } else { R::missing(found) };
        let missing = missing.ok_or(StoreError::Version { found, expected: R::VERSION })?;
        let mut content = self.words;
        let content = content.get_mut(WORD..WORD + self.len + missing.len()).ok_or(StoreError::Encoding)?;
        content.get_mut(self.len..).ok_or(StoreError::Encoding)?.copy_from_slice(missing);
        let (record, rest) = postcard::take_from_bytes::<R>(content).map_err(|_| StoreError::Encoding)?;
        if !rest.is_empty() {
            return Err(StoreError::Encoding);
        }
        record.check()?;
        Ok(record)
    }
}

/// Describes what lies at a place in a sector.
enum Place {
    /// A record; it may be torn.
    Record,
    /// The place is empty since its sector was erased.
    Blank,
    /// No record begins here: the bytes are not a record's, or no room is left.
    End,
}

/// Keeps the newest record of each kind, in two flash sectors that are used in turn.
pub struct Store<F> {
    flash: F,
    start: u32,
    /// Flash that reads as zeros counts as never written, as in an emulator without a flash controller.
    zeros_are_blank: bool,
    /// Sector in use and its generation.
    current: Option<(u32, u32)>,
    /// The place of the next record, while there is room.
    free: Option<u32>,
    damaged: bool,
    /// A damaged record may have been the configuration.
    configuration_damaged: bool,
    /// A header is neither valid nor blank: the newest sector may be lost.
    header_damaged: bool,
}

impl<F: NorFlash> Store<F> {
    /// Opens the two sectors from `start` on (an offset into `flash`); writes nothing. `zeros_are_blank` holds for an
    /// emulator without a flash controller; a chip's erased flash reads as ones, and sectors of zeros are then reported
    /// as damaged: a raw image of the flash has overwritten them.
    ///
    /// # Errors
    /// [`StoreError::Flash`].
    pub fn open(flash: F, start: u32, zeros_are_blank: bool) -> Result<Self, StoreError> {
        const { assert!(F::READ_SIZE <= WORD && WORD.is_multiple_of(F::WRITE_SIZE)) };
        let mut store = Self {
            flash,
            start,
            zeros_are_blank,
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
            // No record has key 0: the walk goes to the end.
            let mut nothing = Raw::EMPTY;
            store.find(0, &mut nothing)?;
        }
        Ok(store)
    }

    /// Returns whether a damaged record or sector header was found: a power cut tore it, or the flash has lost
    /// bits. The record before it is then read.
    #[must_use]
    pub fn damaged(&self) -> bool {
        self.damaged || self.header_damaged
    }

    /// Returns the newest whole record; `None` before the first one.
    ///
    /// # Errors
    /// [`StoreError`] when the flash cannot be read, or the record has another layout, does not decode or has a value
    /// out of its range.
    pub fn get<R: Record>(&mut self) -> Result<Option<R>, StoreError> {
        let mut raw = Raw::EMPTY;
        if self.find(R::KEY, &mut raw)? { raw.decode().map(Some) } else { Ok(None) }
    }

    /// Stores a record and reads it back; until it is whole the one before remains valid.
    ///
    /// # Errors
    /// [`StoreError::Field`] for a value out of its range: nothing is written then.
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

    /// Returns the bytes that are free in the sector in use.
    fn room(&self) -> u32 {
        let end = self.current.map(|(sector, _)| self.range(sector).end);
        self.free.zip(end).map_or(0, |(at, end)| end.saturating_sub(at))
    }

    /// Moves the newest records to the other sector, which needs an erase, where little room is left. Call it at the
    /// start, when nothing is lost by an erase: what is stored while the vehicle drives has to fit without one.
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

    /// Writes an encoded record. It is separate from [`Store::set`], which is compiled once for each kind of record.
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
        let whole = crc == header_crc(generation);
        let blank = generation == crc && (crc == u32::MAX || self.zeros_are_blank && crc == 0);
        self.header_damaged |= !whole && !blank;
        Ok(whole.then_some(generation))
    }

    /// Reads the record at `at` into `raw`, if there is one.
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

    /// Copies the newest whole record of a key into `newest`; returns whether there is one. Also finds the place of the
    /// next record.
    #[inline(never)]
    fn find(&mut self, key: u8, newest: &mut Raw) -> Result<bool, StoreError> {
        let Some((sector, _)) = self.current else { return Ok(false) };
        let mut at = self.range(sector).start + HEADER;
        let mut raw = Raw::EMPTY;
        let mut found = false;
        (self.damaged, self.configuration_damaged) = (false, false);
        loop {
            // Each turn goes on by a record's length, of two words at least.
            match self.place(sector, at, &mut raw)? {
                Place::Record => {
                    at += Raw::size(raw.len) as u32;
                    if !raw.is_whole() {
                        self.damaged = true;
                        // A power cut leaves the first word, which has the key; flipped bits may not.
                        self.configuration_damaged |= !(2..=MAX_KEY).contains(&raw.key());
                    } else if raw.key() == key {
                        *newest = raw;
                        found = true;
                    }
                }
                // No record is appended behind one that may be torn.
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

    /// Writes a record at `at` and returns the place of the next one; `None` if there is no room for it.
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

    /// Starts the other sector with the newest record of each key, the given one among them. Of a configuration that was
    /// damaged a mark stays, [`StoreError::Lost`], until one is stored: without it the vehicle's axes are not known.
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
                raw.lose(key);
            } else if raw.key() != key {
                continue;
            }
            at = self.append(sector, at, &raw)?.ok_or(StoreError::Full)?;
        }
        let free = self.append(sector, at, newest)?.ok_or(StoreError::Full)?;
        self.flash.write(start, &generation.to_le_bytes()).map_err(fault)?;
        self.flash.write(start + WORD_U32, &header_crc(generation).to_le_bytes()).map_err(fault)?;
        // The other sector's was good, if there was one.
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
