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
//! All values are little-endian. Records are appended until the sector in use is full, or holds one that a power cut
//! has torn. Then the *other* sector is erased, and the newest record of each key is copied there, together with the new
//! one. The header is written last, with the next generation; only then does the other sector become the one in use. The
//! sector in use is thus never erased, and an erase that is interrupted does no harm. If the configuration was damaged,
//! a record of layout 0 marks that in the new sector. A record of the generation stands for a damaged header, and behind
//! damage the next intact record is searched for.
//!
//! **Access** must not fall back to a key that was replaced, nor to none. Its record is written twice, then a mark that
//! there is one, and superseded ones are overwritten with zeros, which a programmed word takes (RM0090 3.6.4). A
//! damaged record is restored from the other; with both damaged, the mark makes access read as [`StoreError::Lost`].

use super::error::{FieldError, FlashFault, StoreError};
use super::{Access, Configuration};
use crate::model::blob::CRC;
use core::ops::Range;
use embedded_storage::nor_flash::{NorFlash, NorFlashError, NorFlashErrorKind};
use serde::{Serialize, de::DeserializeOwned};

const WORD: usize = 4;
const WORD_U32: u32 = WORD as u32;
const HEADER: u32 = 2 * WORD_U32;
pub(crate) const MAX_LEN: usize = 288;
/// Length of the longest record with its first and last word, bytes.
const BUFFER: usize = MAX_LEN + 2 * WORD;
/// Number of records of maximum length that must fit without an erase after a start.
const FEW: u32 = 8;
/// Layout version that marks a lost record; real layout versions begin at 1.
const LOST: u8 = 0;
const ACCESS_COPIES: u32 = 2;
const MAX_KEY: u8 = 7;
/// Key of the mark that there is a record of access, and of the sector's generation.
const HAS_ACCESS: u8 = 8;
const GENERATION: u8 = 9;
/// Constant in the header's checksum that distinguishes our sectors from other uses of the flash.
const FORMAT: u32 = u32::from_le_bytes(*b"GYR1");

/// A type that can be stored: its key, its layout version, and the check of its values.
pub trait Record: Serialize + DeserializeOwned {
    /// Key of this kind of record, 1 to 7; a key is never reused for another kind.
    const KEY: u8;
    /// Version of the layout; every change increments it.
    const VERSION: u8;

    /// Checks that all values are inside their ranges; the error names the first that is not. By default, all are valid.
    fn check(&self) -> Result<(), FieldError> {
        Ok(())
    }
}

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

    /// Writes a record that has no type: the mark of a lost one (layout 0), or one of the store's own.
    fn mark(&mut self, key: u8, version: u8, content: &[u8]) {
        (self.words, self.len) = ([0xFF; BUFFER], content.len());
        let head = [key, version, content.len() as u8, 0];
        let bytes = head.iter().chain(content);
        self.words.iter_mut().zip(bytes).for_each(|(place, byte)| *place = *byte);
        let end = Self::size(self.len) - WORD;
        let crc = CRC.checksum(self.words.get(..end).unwrap_or_default()).to_le_bytes();
        self.words.iter_mut().skip(end).zip(crc).for_each(|(place, byte)| *place = byte);
    }

    fn bytes(&self) -> &[u8] {
        self.words.get(..Self::size(self.len)).unwrap_or_default()
    }

    const fn key(&self) -> u8 {
        self.words[0]
    }

    const fn is_lost(&self) -> bool {
        self.words[1] == LOST
    }

    fn is_intact(&self) -> bool {
        let bytes = self.bytes();
        let content = bytes.get(..bytes.len().wrapping_sub(WORD));
        let crc = content.map(|content| CRC.checksum(content).to_le_bytes());
        crc.is_some_and(|crc| bytes.ends_with(&crc))
    }

    fn decode<R: Record>(&self) -> Result<R, StoreError> {
        let [_, found, ..] = self.words;
        if self.is_lost() {
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

#[derive(Clone, Copy, Default)]
struct Seen {
    damaged: bool,
    /// True if a damaged record may have been the configuration.
    configuration_damaged: bool,
    /// Offset of the first erased word behind the records.
    free: Option<u32>,
}

/// The store of the newest record of each kind, in two flash sectors that are used alternately.
pub struct Store<F> {
    flash: F,
    start: u32,
    /// Sector in use, and its generation.
    current: Option<(u32, u32)>,
    /// Offset of the next record, if one can be appended.
    free: Option<u32>,
    seen: Seen,
    /// True if a header is neither valid nor blank; the newest sector may then be lost.
    header_damaged: bool,
}

impl<F: NorFlash> Store<F> {
    /// Opens the store in the two sectors that begin at offset `start` of `flash`; writes nothing. Erased flash reads
    /// as ones; sectors of zeros were overwritten by a raw image of the flash, and are reported as damaged.
    pub fn open(flash: F, start: u32) -> Result<Self, StoreError> {
        const { assert!(F::READ_SIZE <= WORD && WORD.is_multiple_of(F::WRITE_SIZE)) };
        let mut store =
            Self { flash, start, current: None, free: None, seen: Seen::default(), header_damaged: false };
        let mut is_current_damaged = false;
        for sector in [0, 1] {
            let (generation, is_damaged) = store.generation(sector)?;
            let newest = store.current.map(|(_, generation)| generation);
            if generation > newest {
                store.current = generation.map(|generation| (sector, generation));
                is_current_damaged = is_damaged;
            }
            // The copy in a sector that is not used any more shows that it is not the newest.
            store.header_damaged |= is_damaged && generation.is_none();
        }
        store.header_damaged |= is_current_damaged;
        if store.current.is_some() {
            // No record has key 0, so the search reads all records.
            let mut nothing = Raw::EMPTY;
            store.find(0, &mut nothing)?;
        }
        Ok(store)
    }

    /// Returns whether a power cut or flipped bits have damaged a record or header; the one before is then used.
    pub fn damaged(&self) -> bool {
        self.seen.damaged || self.header_damaged
    }

    /// Returns the newest intact record, if any; another layout or a value out of range is an error.
    pub fn get<R: Record>(&mut self) -> Result<Option<R>, StoreError> {
        let mut raw = Raw::EMPTY;
        if self.find_any(R::KEY, &mut raw)? { raw.decode().map(Some) } else { Ok(None) }
    }

    /// Stores a record and reads it back. Until the new record is complete, the previous one remains valid.
    #[inline(never)]
    pub fn set<R: Record>(&mut self, record: &R) -> Result<(), StoreError> {
        record.check()?;
        let mut raw = Raw::EMPTY;
        raw.encode(record).ok_or(StoreError::Full)?;
        self.write(&raw)
    }

    /// Returns whether the next record of any length fits without an erase.
    pub fn has_room(&self) -> bool {
        self.room() >= BUFFER as u32
    }

    fn room(&self) -> u32 {
        let end = self.current.map(|(sector, _)| self.range(sector).end);
        self.free.zip(end).map_or(0, |(at, end)| end.saturating_sub(at))
    }

    /// If little room is left, or something is damaged, moves the newest records to the other sector; completes what a
    /// power cut has left of a record of access. For the start, when an erase disturbs nothing.
    pub fn make_room(&mut self) -> Result<(), StoreError> {
        let mut raw = Raw::EMPTY;
        let Some((sector, _)) = self.current else { return Ok(()) };
        if self.room() < FEW * BUFFER as u32 {
            for key in 1..=MAX_KEY {
                if self.find_any(key, &mut raw)? {
                    return self.change_sector(&raw);
                }
            }
            return Ok(());
        }
        if self.find(Access::KEY, &mut raw)? {
            if self.count(sector, &raw)? < ACCESS_COPIES {
                self.write(&raw)?;
            }
            self.supersede(sector, &raw)?;
        }
        Ok(())
    }

    /// Writes an encoded record. Not generic, unlike [`Store::set`], which is compiled for each kind of record.
    #[inline(never)]
    fn write(&mut self, raw: &Raw) -> Result<(), StoreError> {
        let appended = match (self.current, self.free) {
            (Some((sector, _)), Some(at)) => self.append_all(sector, at, raw)?.map(|_| sector),
            _ => None,
        };
        match appended {
            None => self.change_sector(raw)?,
            Some(sector) if raw.key() == Access::KEY => self.supersede(sector, raw)?,
            Some(_) => {}
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

    /// Returns the generation of a sector, and whether its header is damaged.
    fn generation(&mut self, sector: u32) -> Result<(Option<u32>, bool), StoreError> {
        let at = self.range(sector).start;
        let generation = u32::from_le_bytes(self.read(at)?);
        let crc = u32::from_le_bytes(self.read(at + WORD_U32)?);
        if crc == header_crc(generation) {
            return Ok((Some(generation), false));
        }
        if generation == u32::MAX && crc == u32::MAX {
            return Ok((None, false));
        }
        let mut raw = Raw::EMPTY;
        let copy = self.walk(sector, GENERATION, &mut raw, &mut Seen::default())?;
        let content = raw.words.get(WORD..).and_then(|words| words.first_chunk());
        Ok((content.filter(|_| copy).map(|content| u32::from_le_bytes(*content)), true))
    }

    /// Reads the next intact record from `at` on, a word at least, to behind it; returns its own offset.
    fn next(
        &mut self,
        sector: u32,
        at: &mut u32,
        raw: &mut Raw,
        seen: &mut Seen,
    ) -> Result<Option<u32>, StoreError> {
        let end = self.range(sector).end;
        let mut in_damage = false;
        while *at + WORD_U32 <= end {
            let here = *at;
            let first = self.read::<WORD>(here)?;
            let is_blank = first == [0xFF; WORD];
            if is_blank && !in_damage {
                seen.free = Some(here);
                return Ok(None);
            }
            // A word of zeros belongs to a superseded record.
            if !is_blank && first != [0; WORD] {
                let [key, _, low, high] = first;
                let len = usize::from(u16::from_le_bytes([low, high]));
                let fits = len <= MAX_LEN && here + Raw::size(len) as u32 <= end;
                if fits && let Some(words) = raw.words.get_mut(..Raw::size(len)) {
                    raw.len = len;
                    self.flash.read(here, words).map_err(fault)?;
                    if raw.is_intact() {
                        *at += Raw::size(len) as u32;
                        return Ok(Some(here));
                    }
                }
                // A power cut leaves the first word intact, which holds the key; flipped bits may not. Before zeros,
                // it may be what is left of a superseded record.
                let is_other =
                    fits && ((2..=GENERATION).contains(&key) || self.read(here + WORD_U32)? == [0; WORD]);
                seen.configuration_damaged |= !in_damage && !is_other;
                (in_damage, seen.damaged) = (true, true);
            }
            *at += WORD_U32;
        }
        Ok(None)
    }

    /// Copies the newest intact record of a key in a sector into `newest`, and returns whether there is one.
    #[inline(never)]
    fn walk(&mut self, sector: u32, key: u8, newest: &mut Raw, seen: &mut Seen) -> Result<bool, StoreError> {
        let mut at = self.range(sector).start + HEADER;
        let (mut raw, mut found) = (Raw::EMPTY, false);
        while self.next(sector, &mut at, &mut raw, seen)?.is_some() {
            if raw.key() == key {
                *newest = raw;
                found = true;
            }
        }
        Ok(found)
    }

    /// Copies a key's newest intact record; returns whether there is one. Updates `free` and what is damaged.
    fn find(&mut self, key: u8, newest: &mut Raw) -> Result<bool, StoreError> {
        let Some((sector, _)) = self.current else { return Ok(false) };
        let mut seen = Seen::default();
        let found = self.walk(sector, key, newest, &mut seen)?;
        self.seen = seen;
        // No record is appended after one that may be torn.
        self.free = seen.free.filter(|_| !self.damaged());
        Ok(found)
    }

    /// As [`Self::find`]; access that was there and is not is the mark of a lost record.
    fn find_any(&mut self, key: u8, newest: &mut Raw) -> Result<bool, StoreError> {
        let is_found = self.find(key, newest)?;
        if is_found || key != Access::KEY {
            return Ok(is_found);
        }
        let mut is_lost = self.find(HAS_ACCESS, newest)?;
        if self.header_damaged {
            let (mut others, used) = (0, self.current.map(|(sector, _)| sector));
            for sector in [0, 1].into_iter().filter(|sector| used != Some(*sector)) {
                is_lost |= self.walk(sector, HAS_ACCESS, newest, &mut Seen::default())?;
                others += u32::from(!self.is_blank(sector)?);
            }
            // Both headers are gone, and no power cut does that.
            is_lost |= others > 1;
        }
        if is_lost {
            newest.mark(key, LOST, &[]);
        }
        Ok(is_lost)
    }

    fn is_blank(&mut self, sector: u32) -> Result<bool, StoreError> {
        let at = self.range(sector).start;
        Ok(self.read(at)? == [0xFF; 2 * WORD])
    }

    fn count(&mut self, sector: u32, record: &Raw) -> Result<u32, StoreError> {
        let (mut at, mut raw, mut count) = (self.range(sector).start + HEADER, Raw::EMPTY, 0);
        while self.next(sector, &mut at, &mut raw, &mut Seen::default())?.is_some() {
            count += u32::from(raw.bytes() == record.bytes());
        }
        Ok(count)
    }

    /// Overwrites all records of access with zeros, but `newest`: in this sector, and in the other one.
    #[inline(never)]
    fn supersede(&mut self, sector: u32, newest: &Raw) -> Result<(), StoreError> {
        for (sector, is_current) in [(sector, true), (1 - sector, false)] {
            let (mut at, mut raw) = (self.range(sector).start + HEADER, Raw::EMPTY);
            while let Some(here) = self.next(sector, &mut at, &mut raw, &mut Seen::default())? {
                if raw.key() == Access::KEY && !(is_current && raw.bytes() == newest.bytes()) {
                    // The first word last: a power cut leaves a record that is damaged, and whose key is known.
                    for word in (here..at).step_by(WORD).rev() {
                        self.flash.write(word, &[0; WORD]).map_err(fault)?;
                    }
                }
            }
        }
        Ok(())
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

    /// Writes a record as [`Self::append`]; one of access twice, then the mark that there is one.
    fn append_all(&mut self, sector: u32, at: u32, raw: &Raw) -> Result<Option<u32>, StoreError> {
        let mut at = self.append(sector, at, raw)?;
        if raw.key() == Access::KEY {
            let mut mark = Raw::EMPTY;
            mark.mark(HAS_ACCESS, 1, &[]);
            for raw in [raw, &mark] {
                let Some(behind) = at else { break };
                at = self.append(sector, behind, raw)?;
            }
        }
        Ok(at)
    }

    /// Fills the other sector with the newest records, this one included, and switches to it. A damaged configuration
    /// is marked, and reads as [`StoreError::Lost`] until one is stored: the axes are unknown.
    #[inline(never)]
    fn change_sector(&mut self, newest: &Raw) -> Result<(), StoreError> {
        let (sector, generation) = match self.current {
            Some((sector, generation)) => (1 - sector, generation.wrapping_add(1)),
            None => (0, 1),
        };
        let Range { start, end } = self.range(sector);
        let mut at = start + HEADER;
        let mut raw = Raw::EMPTY;
        // The sector that is erased may hold the only mark of it.
        let is_access_lost = self.find_any(Access::KEY, &mut raw)? && raw.is_lost();
        self.flash.erase(start, end).map_err(fault)?;
        for key in (1..=MAX_KEY).filter(|key| *key != newest.key()) {
            if !self.find(key, &mut raw)? {
                match key {
                    Access::KEY if is_access_lost => raw.mark(key, LOST, &[]),
                    Configuration::KEY if self.seen.configuration_damaged => raw.mark(key, LOST, &[]),
                    _ => continue,
                }
            }
            at = self.append_all(sector, at, &raw)?.ok_or(StoreError::Full)?;
        }
        at = self.append_all(sector, at, newest)?.ok_or(StoreError::Full)?;
        raw.mark(GENERATION, 1, &generation.to_le_bytes());
        let free = self.append(sector, at, &raw)?.ok_or(StoreError::Full)?;
        self.flash.write(start, &generation.to_le_bytes()).map_err(fault)?;
        self.flash.write(start + WORD_U32, &header_crc(generation).to_le_bytes()).map_err(fault)?;
        // The header of the previous sector was good, if there was one.
        self.header_damaged &= self.current.is_none();
        (self.current, self.free) = (Some((sector, generation)), Some(free));
        if self.find(Access::KEY, &mut raw)? { self.supersede(sector, &raw) } else { Ok(()) }
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
