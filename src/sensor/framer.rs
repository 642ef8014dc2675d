//! The framer finds frames in a byte stream that may begin, break and be damaged anywhere.
//!
//! A header alone does not synchronise, because its bytes may occur in a payload; only header and checksum together do.
//! So when a candidate fails its check, the search continues one byte after its start, inside the bytes already
//! received: an intact frame behind a false header is found, and nothing but damaged frames is lost. At most one frame
//! is held.

use heapless::Vec;

/// Describes a framed protocol.
pub trait Protocol {
    /// The first bytes of a frame, this many, tell whether one begins and how long it is.
    const HEADER: usize;
    /// Returns the length of the frame that begins with these [`Protocol::HEADER`] bytes, at least their own;
    /// `None` when none does.
    fn length(header: &[u8]) -> Option<usize>;
    /// Checks a whole frame's checksum.
    fn check(frame: &[u8]) -> bool;
}

/// Finds the frames of a protocol, each at most `N` bytes long.
#[derive(Debug, Clone, Default)]
pub struct Framer<P, const N: usize> {
    buffer: Vec<u8, N>,
    /// Bytes of `buffer` that belonged to the frame handed out last.
    used: usize,
    /// With fewer bytes in `buffer` than this there is nothing new to find: a header is examined once, not at every
    /// byte. 0 while a frame is handed out.
    needed: usize,
    bad_checksums: u32,
    skipped: u32,
    protocol: core::marker::PhantomData<P>,
}

impl<P: Protocol, const N: usize> Framer<P, N> {
    /// Begins before the first byte.
    #[must_use]
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

    /// Takes one byte. Call [`Framer::next_frame`] until `None` before the next one.
    #[inline]
    pub fn receive(&mut self, byte: u8) {
        if self.used > 0 {
            self.release();
        }
        if self.buffer.push(byte).is_err() {
            // The buffer is full only when the caller left frames waiting: the oldest byte is dropped and counted.
            self.skip(1);
            self.needed = 0;
            let _ = self.buffer.push(byte);
        }
    }

    /// Takes the bytes that are needed before there is something to find, at most those given, and returns their number:
    /// a frame costs two calls instead of one for each byte. Call [`Framer::next_frame`] until `None` before the next
    /// ones.
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

    /// Returns whether [`Framer::next_frame`] has nothing to return before more bytes come. A caller that checks this
    /// first spends only a few instructions on most bytes.
    #[inline]
    #[must_use]
    pub fn is_waiting(&self) -> bool {
        self.buffer.len() < self.needed
    }

    /// Returns the number of candidates whose checksum did not fit.
    #[must_use]
    pub fn bad_checksums(&self) -> u32 {
        self.bad_checksums
    }

    /// Returns the number of bytes that belonged to no intact frame.
    #[must_use]
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
        self.needed = 0;
        self.buffer.get(..self.used)
    }

    /// Drops the frame that was handed out.
    fn release(&mut self) {
        self.drop_front(self.used);
        self.used = 0;
        self.needed = 0;
    }

    fn skip(&mut self, count: usize) {
        self.drop_front(count);
        self.skipped = self.skipped.saturating_add(count as u32);
    }

    fn drop_front(&mut self, count: usize) {
        let count = count.min(self.buffer.len());
        let left = self.buffer.len() - count;
        // Nearly always everything is dropped, or nothing.
        if count > 0 && left > 0 {
            self.buffer.copy_within(count.., 0);
        }
        self.buffer.truncate(left);
    }
}
