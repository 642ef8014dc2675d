//! A serial line of the virtual board, for code that reads and writes: reading lets board time pass.

use super::Board;
use std::collections::VecDeque;
use std::io::{Error, ErrorKind, Read, Result, Write};
use std::time::Duration;

/// Board time after which a read gives up when there is no byte.
const WAIT: Duration = Duration::from_millis(50);
/// Board time that a read waits after the first byte, so that it returns more than one.
const REST: Duration = Duration::from_millis(2);

#[derive(Debug)]
pub struct Line<'a> {
    board: &'a mut Board,
    usart: usize,
    unread: VecDeque<u8>,
}

impl<'a> Line<'a> {
    pub(super) fn new(board: &'a mut Board, usart: usize) -> Self {
        Self { board, usart, unread: VecDeque::new() }
    }
}

impl Read for Line<'_> {
    fn read(&mut self, bytes: &mut [u8]) -> Result<usize> {
        if self.unread.is_empty() {
            if self.board.run_until_sent(self.usart, 1, WAIT) {
                self.board.run(REST);
            }
            self.unread.extend(self.board.sent(self.usart));
        }
        if self.unread.is_empty() {
            return Err(Error::from(ErrorKind::TimedOut));
        }
        self.unread.read(bytes)
    }
}

impl gyronet_tools::client::bus::Line for Line<'_> {
    fn now(&mut self) -> Duration {
        self.board.counts().time
    }
}

impl Write for Line<'_> {
    fn write(&mut self, bytes: &[u8]) -> Result<usize> {
        self.board.send(self.usart, bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> Result<()> {
        Ok(())
    }
}
