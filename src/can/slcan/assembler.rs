//! The assembler makes lines from bytes, each up to CR and of bounded length.

use heapless::Vec;

/// Longest line that a host has reason to send, without its CR.
pub const MAX_HOST_LINE: usize = 32;

/// A line longer than [`MAX_HOST_LINE`]; none of it was kept.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[error("line of over {MAX_HOST_LINE} characters")]
pub struct TooLong;

/// Collects the characters of one line.
#[derive(Debug, Clone, Default)]
pub struct LineAssembler {
    line: Vec<u8, MAX_HOST_LINE>,
    too_long: bool,
    /// The line was handed out and begins again with the next character.
    done: bool,
}

impl LineAssembler {
    /// Begins before the first character.
    #[must_use]
    pub const fn new() -> Self {
        Self { line: Vec::new(), too_long: false, done: false }
    }

    /// Takes a character; gives the line, without its CR, when it is complete. LF is passed
    /// over, so that a terminal can be used.
    pub fn receive(&mut self, byte: u8) -> Option<Result<&[u8], TooLong>> {
        if core::mem::take(&mut self.done) {
            self.line.clear();
            self.too_long = false;
        }
        match byte {
            b'\r' => {
                self.done = true;
                Some(if self.too_long { Err(TooLong) } else { Ok(&self.line) })
            }
            b'\n' => None,
            _ => {
                self.too_long |= self.line.push(byte).is_err();
                None
            }
        }
    }
}
