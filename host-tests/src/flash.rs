//! A mock of the STM32F405's flash: its sectors, its rules, and a power cut at any operation.
//!
//! The rules (RM0090 3.5, 3.6): a sector is erased as a whole, and the sectors are of unequal sizes; a word that has
//! been programmed is not programmed again until its sector has been erased, and programming only clears bits. Breaking
//! a rule is a bug of the caller and panics. Two exceptions, as the part allows both: a word that a power cut has torn
//! may be programmed again if that only clears bits, and any word to zero.

use crate::noise::Noise;
use embedded_storage::nor_flash::{ErrorType, NorFlash, NorFlashError, NorFlashErrorKind, ReadNorFlash};
use gyronet::service::MappedSlots;
use gyronet::store::Slot;
use gyronet::store::layout::{RECORD_SECTOR, SLOT_SIZE, SLOTS, sector};
use std::cell::RefCell;
use std::ops::Range;
use std::rc::Rc;

const WORD: usize = 4;
const BYTES: usize = 1 << 20;

/// How a power cut hits an operation.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Cut {
    /// The cut comes just before the operation.
    Before,
    /// The cut comes in the middle: a word has some of its bits, a sector is erased from its start to somewhere.
    Front,
    /// The cut comes in the middle, and any part of the sector may be erased.
    Anywhere,
    /// The cut comes in the middle, while the part still programs all of a sector's words to zero before it
    /// erases them: any of them may be zero.
    Zeros,
    /// The cut comes just after: the operation is done, but not reported.
    After,
}

impl Cut {
    /// All kinds of cut, in the order of their effect.
    pub const ALL: [Self; 5] = [Self::Before, Self::Front, Self::Anywhere, Self::Zeros, Self::After];

    const fn tears(self) -> bool {
        matches!(self, Self::Front | Self::Anywhere | Self::Zeros)
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MockError {
    PowerCut,
    /// The range is not a word or a sector.
    Alignment,
}

impl NorFlashError for MockError {
    fn kind(&self) -> NorFlashErrorKind {
        match self {
            Self::PowerCut => NorFlashErrorKind::Other,
            Self::Alignment => NorFlashErrorKind::NotAligned,
        }
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Word {
    Erased,
    Programmed,
    Torn,
    /// Left by anything before: programming clears bits.
    Unknown,
}

#[derive(Debug, Clone)]
pub struct F405 {
    words: Vec<u32>,
    states: Vec<Word>,
    operations: u64,
    cut: Option<(u64, Cut)>,
    powered: bool,
    noise: Noise,
}

/// The flash of a board, which everything on the board shares.
pub type Flash = Rc<RefCell<F405>>;

pub fn shared(content: F405) -> Flash {
    Rc::new(RefCell::new(content))
}

impl Default for F405 {
    fn default() -> Self {
        Self::up_to(BYTES)
    }
}

impl F405 {
    /// The first so many bytes, erased: a copy of a few sectors is made faster than one of the whole part.
    pub fn up_to(bytes: usize) -> Self {
        Self {
            words: vec![u32::MAX; bytes / WORD],
            states: vec![Word::Erased; bytes / WORD],
            operations: 0,
            cut: None,
            powered: true,
            noise: Noise::new(405),
        }
    }

    /// Words programmed and sectors erased so far.
    pub fn operations(&self) -> u64 {
        self.operations
    }

    /// Cuts the power at the operation that `after` others precede, counted from now.
    pub fn cut_after(&mut self, after: u64, cut: Cut) {
        self.cut = Some((self.operations + after, cut));
    }

    /// Switches power on again. Returns whether it had been cut.
    pub fn restore(&mut self) -> bool {
        self.cut = None;
        !std::mem::replace(&mut self.powered, true)
    }

    pub fn bytes(&self) -> &[u8] {
        bytemuck::cast_slice(&self.words)
    }

    /// Puts bytes into erased flash, as anything before may have left them.
    pub fn fill(&mut self, offset: u32, bytes: &[u8]) {
        bytemuck::cast_slice_mut::<u32, u8>(&mut self.words)[offset as usize..][..bytes.len()]
            .copy_from_slice(bytes);
        let unknown = offset as usize / WORD..(offset as usize + bytes.len()).div_ceil(WORD);
        self.states[unknown].fill(Word::Unknown);
    }

    /// Flips bits of a byte, as a fault of the part would.
    pub fn damage(&mut self, offset: usize, bits: u8) {
        bytemuck::cast_slice_mut::<u32, u8>(&mut self.words)[offset] ^= bits;
    }

    /// Starts an operation; returns how a power cut hits it, or `None` if it is completed.
    fn step(&mut self) -> Result<Option<Cut>, MockError> {
        if !self.powered {
            return Err(MockError::PowerCut);
        }
        let hit = self.cut.filter(|(at, _)| *at == self.operations).map(|(_, cut)| cut);
        self.operations += 1;
        self.powered = hit.is_none();
        if hit == Some(Cut::Before) { Err(MockError::PowerCut) } else { Ok(hit) }
    }

    fn program(&mut self, word: usize, value: u32) -> Result<(), MockError> {
        let (old, state) = (self.words[word], self.states[word]);
        let (at, is_unknown) = (word * WORD, state == Word::Unknown);
        let value = if is_unknown { value & old } else { value };
        assert!(state != Word::Programmed || value == 0, "the word at {at:#x} is programmed twice");
        assert!(value & old == value, "the word at {at:#x}: {old:08x} cannot become {value:08x}");
        let hit = self.step()?;
        if hit.is_some_and(Cut::tears) {
            let kept = u32::from_le_bytes(std::array::from_fn(|_| self.noise.byte()));
            self.words[word] = old & (value | kept);
            self.states[word] = Word::Torn;
        } else {
            self.words[word] = value;
            self.states[word] = Word::Programmed;
        }
        if hit.is_some() { Err(MockError::PowerCut) } else { Ok(()) }
    }

    fn erase_sector(&mut self, sector: Range<usize>) -> Result<(), MockError> {
        let hit = self.step()?;
        let words = sector.start / WORD..sector.end / WORD;
        let middle = words.start + self.noise.int(0, words.len() as i64) as usize;
        for word in words {
            let erased = match hit {
                Some(Cut::Front) => word < middle,
                Some(Cut::Anywhere | Cut::Zeros) => self.noise.byte().is_multiple_of(2),
                _ => true,
            };
            if erased {
                self.words[word] = if hit == Some(Cut::Zeros) { 0 } else { u32::MAX };
            }
            // After a torn erasure no word can be programmed reliably.
            self.states[word] = if hit.is_some_and(Cut::tears) { Word::Programmed } else { Word::Erased };
        }
        if hit.is_some() { Err(MockError::PowerCut) } else { Ok(()) }
    }
}

/// A part of the flash; offsets count from its start.
#[derive(Debug, Clone)]
pub struct Region {
    flash: Flash,
    range: Range<usize>,
    /// The content after the last operation, for reading in place, because the mock's bytes are in a `RefCell`.
    copy: Vec<u32>,
    /// Slot of the firmware that runs.
    running: Option<Slot>,
}

impl Region {
    pub fn new(flash: &Flash, range: Range<u32>) -> Self {
        let range = range.start as usize..range.end as usize;
        Self { flash: Rc::clone(flash), range, copy: Vec::new(), running: None }
    }

    /// The whole flash of a board whose boot loader has started a slot, which can also be read in place.
    pub fn mapped(flash: &Flash, running: Option<Slot>) -> Self {
        let copy = flash.borrow().words.clone();
        Self { copy, running, ..Self::new(flash, 0..BYTES as u32) }
    }

    fn bytes(&self, range: Range<u32>) -> &[u8] {
        bytemuck::cast_slice(&self.copy[range.start as usize / WORD..range.end as usize / WORD])
    }

    /// Keeps what an operation has left of a range.
    fn keep(&mut self, range: Range<usize>) {
        if !self.copy.is_empty() {
            let words = range.start / WORD..range.end / WORD;
            self.copy[words.clone()].copy_from_slice(&self.flash.borrow().words[words]);
        }
    }

    fn absolute(&self, offset: u32, len: usize, unit: usize) -> Result<Range<usize>, MockError> {
        let start = self.range.start + offset as usize;
        let inside = start + len <= self.range.end;
        let aligned = (offset as usize).is_multiple_of(unit) && len.is_multiple_of(unit);
        if inside && aligned { Ok(start..start + len) } else { Err(MockError::Alignment) }
    }
}

impl ErrorType for Region {
    type Error = MockError;
}

impl ReadNorFlash for Region {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), MockError> {
        let range = self.absolute(offset, bytes.len(), 1)?;
        let flash = self.flash.borrow();
        if !flash.powered {
            return Err(MockError::PowerCut);
        }
        bytes.copy_from_slice(&flash.bytes()[range]);
        Ok(())
    }

    fn capacity(&self) -> usize {
        self.range.len()
    }
}

impl NorFlash for Region {
    const WRITE_SIZE: usize = WORD;
    const ERASE_SIZE: usize = RECORD_SECTOR;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), MockError> {
        let range = self.absolute(from, (to - from) as usize, RECORD_SECTOR)?;
        let mut at = range.start;
        while at < range.end {
            let sector = sector(at as u32).expect("the start of a sector");
            assert!(sector.end as usize <= range.end, "sector {sector:x?} reaches beyond {range:x?}");
            let sector = at..sector.end as usize;
            at = sector.end;
            let erased = self.flash.borrow_mut().erase_sector(sector.clone());
            self.keep(sector);
            erased?;
        }
        Ok(())
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), MockError> {
        let range = self.absolute(offset, bytes.len(), WORD)?;
        let mut words = (range.start / WORD..).zip(bytes.as_chunks::<WORD>().0);
        let program = |(word, value): (usize, &[u8; WORD])| {
            self.flash.borrow_mut().program(word, u32::from_le_bytes(*value))
        };
        let written = words.try_for_each(program);
        self.keep(range);
        written
    }
}

impl MappedSlots for Region {
    fn slots(&self) -> [&[u8]; 2] {
        self.bytes(SLOTS).split_at(SLOT_SIZE).into()
    }

    fn running(&self) -> Option<Slot> {
        self.running
    }

    fn firmware(&self, slot: Slot) -> &[u8] {
        self.bytes(slot.firmware())
    }
}
