//! Frames out of a byte stream that may begin, break and garble anywhere.
//!
//! A header alone is no synchronisation: its bytes may occur in a payload. Only header and
//! checksum together are. So when a candidate fails its check, the search goes on one byte
//! after its start, inside the bytes already received: an intact frame behind a false header
//! is found, and nothing but damaged frames is lost. At most one frame is held.

use heapless::Vec;

/// What the bytes received so far can be.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Candidate {
    /// No frame begins here.
    No,
    /// Perhaps a frame; more bytes must say.
    Incomplete,
    /// A frame of this many bytes, if its checksum fits.
    Frame(usize),
}

/// What a framed protocol must say of itself.
pub trait Protocol {
    /// Looks at the first bytes of what might be a frame.
    fn candidate(bytes: &[u8]) -> Candidate;
    /// Checks a whole frame's checksum.
    fn check(frame: &[u8]) -> bool;
}

/// Finds the frames of a protocol, each at most `N` bytes long.
#[derive(Debug, Clone, Default)]
pub struct Framer<P, const N: usize> {
    buffer: Vec<u8, N>,
    /// Bytes of `buffer` that belonged to the frame handed out last.
    used: usize,
    bad_checksums: u32,
    skipped: u32,
    protocol: core::marker::PhantomData<P>,
}

impl<P: Protocol, const N: usize> Framer<P, N> {
    /// Nothing received yet.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            buffer: Vec::new(),
            used: 0,
            bad_checksums: 0,
            skipped: 0,
            protocol: core::marker::PhantomData,
        }
    }

    /// Takes one byte. Call [`Framer::next_frame`] until `None` before the next one.
    pub fn push(&mut self, byte: u8) {
        self.release();
        if self.buffer.push(byte).is_err() {
            // Only when the caller left frames waiting: the oldest byte gives way, counted.
            self.skip();
            let _ = self.buffer.push(byte);
        }
    }

    /// The next intact frame, if one is complete.
    pub fn next_frame(&mut self) -> Option<&[u8]> {
        self.release();
        loop {
            if self.buffer.is_empty() {
                return None;
            }
            match P::candidate(&self.buffer) {
                Candidate::Incomplete => return None,
                Candidate::Frame(len) if len <= N => {
                    let frame = self.buffer.get(..len)?;
                    if P::check(frame) {
                        self.used = len;
                        return self.buffer.get(..len);
                    }
                    self.bad_checksums = self.bad_checksums.saturating_add(1);
                    self.skip();
                }
                Candidate::No | Candidate::Frame(_) => self.skip(),
            }
        }
    }

    /// Candidates whose checksum did not fit.
    #[must_use]
    pub fn bad_checksums(&self) -> u32 {
        self.bad_checksums
    }

    /// Bytes that belonged to no intact frame.
    #[must_use]
    pub fn skipped(&self) -> u32 {
        self.skipped
    }

    /// Drops the frame that was handed out.
    fn release(&mut self) {
        self.drop_front(self.used);
        self.used = 0;
    }

    fn skip(&mut self) {
        self.drop_front(1);
        self.skipped = self.skipped.saturating_add(1);
    }

    fn drop_front(&mut self, count: usize) {
        if count == 0 {
            // At nearly every byte: moving the buffer onto itself would cost its length.
            return;
        }
        let count = count.min(self.buffer.len());
        let left = self.buffer.len() - count;
        self.buffer.copy_within(count.., 0);
        self.buffer.truncate(left);
    }
}
