//! A line of a board, which loses bytes, takes what it likes and breaks.

use embedded_io::{ErrorKind, ErrorType, Read, ReadReady, Write, WriteReady};
use std::collections::VecDeque;

#[derive(Debug, Default)]
pub struct Line {
    /// Received bytes; `None` is a byte that the port has lost.
    received: VecDeque<Option<u8>>,
    /// Bytes that it still takes.
    pub room: usize,
    pub broken: bool,
    pub sent: Vec<u8>,
}

impl Line {
    pub fn of_room(room: usize) -> Self {
        Self { room, ..Self::default() }
    }

    pub fn receive(&mut self, bytes: &[u8]) {
        self.received.extend(bytes.iter().copied().map(Some));
    }

    pub fn lose(&mut self) {
        self.received.push_back(None);
    }

    pub fn is_read(&self) -> bool {
        self.received.is_empty()
    }
}

impl ErrorType for Line {
    type Error = ErrorKind;
}

impl ReadReady for Line {
    fn read_ready(&mut self) -> Result<bool, ErrorKind> {
        Ok(!self.received.is_empty())
    }
}

impl Read for Line {
    fn read(&mut self, to: &mut [u8]) -> Result<usize, ErrorKind> {
        if self.received.front() == Some(&None) {
            self.received.pop_front();
            return Err(ErrorKind::Other);
        }
        let mut count = 0;
        while let Some(Some(byte)) = self.received.front()
            && let Some(slot) = to.get_mut(count)
        {
            *slot = *byte;
            self.received.pop_front();
            count += 1;
        }
        assert!(count > 0, "a read that would wait for ever");
        Ok(count)
    }
}

impl WriteReady for Line {
    fn write_ready(&mut self) -> Result<bool, ErrorKind> {
        if self.broken { Err(ErrorKind::BrokenPipe) } else { Ok(self.room > 0) }
    }
}

impl Write for Line {
    fn write(&mut self, bytes: &[u8]) -> Result<usize, ErrorKind> {
        let taken = bytes.len().min(self.room).min(7);
        self.room -= taken;
        self.sent.extend(&bytes[..taken]);
        Ok(taken)
    }

    fn flush(&mut self) -> Result<(), ErrorKind> {
        Ok(())
    }
}
