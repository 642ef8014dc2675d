//! Finds frames in a byte stream that may start in the middle of one and contain gaps and corrupt bytes.
//!
//! A header may occur in a payload; only header and checksum together synchronise. When a candidate fails its check,
//! the search continues one byte after its start, inside the bytes received, so only corrupt frames are lost.

use heapless::Vec;

/// A protocol whose frames have a header and a checksum.
pub trait Protocol {
    /// Number of bytes at the start of a frame that identify it and determine its length.
    const HEADER: usize;
    /// Returns the length of a frame, header included, by its [`Protocol::HEADER`] bytes; `None` if they are none.
    fn length(header: &[u8]) -> Option<usize>;
    fn check(frame: &[u8]) -> bool;
}

/// The framer of a protocol whose frames are at most `N` bytes long.
#[derive(Debug, Clone, Default)]
pub struct Framer<P, const N: usize> {
    buffer: Vec<u8, N>,
    /// Number of bytes at the start of `buffer` that belong to the frame returned last.
    used: usize,
    /// Bytes that `buffer` must hold before the next search: a header is examined once, not at every byte.
    needed: usize,
    bad_checksums: u32,
    protocol: core::marker::PhantomData<P>,
}

impl<P: Protocol, const N: usize> Framer<P, N> {
    pub const fn new() -> Self {
        Self { buffer: Vec::new(), used: 0, needed: 0, bad_checksums: 0, protocol: core::marker::PhantomData }
    }

    /// Processes one byte. Call [`Framer::next_frame`] until it returns `None` before passing the next byte.
    #[inline]
    pub fn receive(&mut self, byte: u8) {
        if self.used > 0 {
            self.release();
        }
        if self.buffer.push(byte).is_err() {
            // The buffer is full only if the caller has not fetched all frames.
            self.drop_front(1);
            self.needed = 0;
            let _ = self.buffer.push(byte);
        }
    }

    /// Takes the bytes needed before the next search, two calls a frame instead of one a byte, and returns how many.
    /// Call [`Framer::next_frame`] until `None` before passing the rest.
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

    pub fn next_frame(&mut self) -> Option<&[u8]> {
        if self.is_waiting() { None } else { self.search() }
    }

    /// Returns whether [`Framer::next_frame`] has nothing until more bytes come: a few instructions per byte.
    #[inline]
    pub fn is_waiting(&self) -> bool {
        self.buffer.len() < self.needed
    }

    /// Returns the number of bytes that must arrive until [`Framer::next_frame`] can return something.
    #[inline]
    pub fn missing(&self) -> usize {
        self.needed.saturating_sub(self.buffer.len())
    }

    pub fn bad_checksums(&self) -> u32 {
        self.bad_checksums
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
        self.drop_front(start);
        self.used = found?;
        self.needed = self.used + P::HEADER;
        self.buffer.get(..self.used)
    }

    fn release(&mut self) {
        self.drop_front(self.used);
        self.needed = self.needed.saturating_sub(self.used);
        self.used = 0;
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
