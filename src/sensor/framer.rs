//! The framer finds frames in a byte stream that may start in the middle of a frame and contain gaps and corrupt
//! bytes.
//!
//! A header alone does not synchronise, because its bytes may occur in a payload; only header and checksum together
//! do. When a candidate fails its check, the search therefore continues one byte after its start, inside the bytes
//! already received. An intact frame after a false header is thus found, and only corrupt frames are lost. The buffer
//! holds at most one frame.

use heapless::Vec;

/// A protocol whose frames have a header and a checksum.
pub trait Protocol {
    /// Number of bytes at the start of a frame that identify it and determine its length.
    const HEADER: usize;
    /// Returns the length of the frame that begins with these [`Protocol::HEADER`] bytes, header included;
    /// `None` if the bytes are not a header.
    fn length(header: &[u8]) -> Option<usize>;
    /// Returns whether the checksum of a whole frame is correct.
    fn check(frame: &[u8]) -> bool;
}

/// The framer of a protocol whose frames are at most `N` bytes long.
#[derive(Debug, Clone, Default)]
pub struct Framer<P, const N: usize> {
    buffer: Vec<u8, N>,
    /// Number of bytes at the start of `buffer` that belong to the frame returned last.
    used: usize,
    /// Number of bytes that `buffer` must hold before the next search, so that a header is examined once, not at
    /// every byte.
    needed: usize,
    bad_checksums: u32,
    skipped: u32,
    protocol: core::marker::PhantomData<P>,
}

impl<P: Protocol, const N: usize> Framer<P, N> {
    pub const fn new() -> Self {
        Self {
            buffer: Vec::new(),
            used: 0,
            needed: 0,
            bad_checksums: 0,
            skipped: 0,
            protocol: core::marker::PhantomData,
        }
    }

    /// Processes one byte. Call [`Framer::next_frame`] until it returns `None` before passing the next byte.
    #[inline]
    pub fn receive(&mut self, byte: u8) {
        if self.used > 0 {
            self.release();
        }
        if self.buffer.push(byte).is_err() {
            // The buffer is full only if the caller has not fetched all frames: drop and count the oldest byte.
            self.skip(1);
            self.needed = 0;
            let _ = self.buffer.push(byte);
        }
    }

    /// Processes as many of `bytes` as are needed before the next search, and returns their number. A frame thus
    /// costs two calls instead of one per byte. Call [`Framer::next_frame`] until it returns `None` before passing
    /// the rest.
    #[inline]
    pub fn receive_some(&mut self, bytes: &[u8]) -> usize {
        if self.used > 0 {
            self.release();
        }
        let wanted = self.needed.saturating_sub(self.buffer.len()).min(bytes.len());
        if let Some(some) = bytes.get(..wanted).filter(|some| !some.is_empty())
            && self.buffer.extend_from_slice(some).is_ok()
        {
            return wanted;
        }
        let Some(first) = bytes.first() else { return 0 };
        self.receive(*first);
        1
    }

    /// Returns the next intact frame, if one is complete.
    pub fn next_frame(&mut self) -> Option<&[u8]> {
        if self.is_waiting() { None } else { self.search() }
    }

    /// Returns whether [`Framer::next_frame`] has nothing to return until more bytes arrive. A caller that checks
    /// this first spends only a few instructions on most bytes.
    #[inline]
    pub fn is_waiting(&self) -> bool {
        self.buffer.len() < self.needed
    }

    /// Returns the number of bytes that must arrive until [`Framer::next_frame`] can return something.
    #[inline]
    pub fn missing(&self) -> usize {
        self.needed.saturating_sub(self.buffer.len())
    }

    /// Returns the number of candidates with a wrong checksum.
    pub fn bad_checksums(&self) -> u32 {
        self.bad_checksums
    }

    /// Returns the number of skipped bytes, which belonged to no intact frame.
    pub fn skipped(&self) -> u32 {
        self.skipped
    }

    fn search(&mut self) -> Option<&[u8]> {
        self.release();
        let mut start = 0;
        let found = loop {
            let bytes = self.buffer.get(start..).unwrap_or_default();
            let Some(header) = bytes.get(..P::HEADER) else {
                self.needed = P::HEADER;
                break None;
            };
            if let Some(length) = P::length(header).filter(|length| *length <= N) {
                match bytes.get(..length) {
                    None => {
                        self.needed = length;
                        break None;
                    }
                    Some(frame) if P::check(frame) => break Some(length),
                    Some(_) => self.bad_checksums = self.bad_checksums.saturating_add(1),
                }
            }
            start += 1;
        };
        self.skip(start);
        self.used = found?;
        self.needed = self.used + P::HEADER;
        self.buffer.get(..self.used)
    }

    fn release(&mut self) {
        self.drop_front(self.used);
        self.needed = self.needed.saturating_sub(self.used);
        self.used = 0;
    }

    fn skip(&mut self, count: usize) {
        self.drop_front(count);
        self.skipped = self.skipped.saturating_add(count as u32);
    }

    fn drop_front(&mut self, count: usize) {
        let count = count.min(self.buffer.len());
        let left = self.buffer.len() - count;
        // Usually either everything or nothing is dropped.
        if count > 0 && left > 0 {
            self.buffer.copy_within(count.., 0);
        }
        self.buffer.truncate(left);
    }
}
