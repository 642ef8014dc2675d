//! The assembler splits a byte stream into lines of bounded length, each ended by CR.

use heapless::Vec;

/// Longest line that is accepted from a host, without its CR.
pub const MAX_HOST_LINE: usize = 32;

/// The error for a line longer than [`MAX_HOST_LINE`]; the line is discarded.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("line has more than {MAX_HOST_LINE} characters")]
pub struct TooLong;

#[derive(Debug, Clone, Default)]
pub struct LineAssembler {
    line: Vec<u8, MAX_HOST_LINE>,
    too_long: bool,
    /// True if the line was returned; the next character begins a new one.
    done: bool,
}

impl LineAssembler {
    pub const fn new() -> Self {
        Self { line: Vec::new(), too_long: false, done: false }
    }

    /// Takes a character; returns a line that it completes, without CR. LF is ignored, for the sake of terminals.
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
