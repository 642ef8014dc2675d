//! Serial lines: a handler at the register's end, queues, a port at the other.
#![allow(unsafe_code, reason = "the interrupt mask; the block says why it is sound")]

use crate::board::SENDING;
use crate::queue::Queue;
use crate::usart::Usart;
use core::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use cortex_m::peripheral::NVIC;
use embedded_io::{ErrorKind, ErrorType, Read, ReadReady, Write, WriteReady};

/// Polls before a flush gives up: about ten byte times at 115200.
const FLUSH_POLLS: u32 = 100_000;
/// Bytes that a handler takes from or gives the line in one turn. A real one has one and takes two
/// at most; the emulated one has what the host has sent, takes all and never asks for more.
const BURST: usize = SENDING;

/// What a line has done wrong since the start. The handler alone counts.
pub struct Faults {
    lost: AtomicU32,
    held: AtomicU32,
    /// A byte waits in the register, and the handler has been switched off.
    holding: AtomicBool,
}

impl Faults {
    /// Nothing yet.
    pub const fn new() -> Self {
        Self { lost: AtomicU32::new(0), held: AtomicU32::new(0), holding: AtomicBool::new(false) }
    }
}

fn count(counter: &AtomicU32) {
    counter.store(counter.load(Ordering::Relaxed).saturating_add(1), Ordering::Relaxed);
}

/// What the handler has of a line.
pub struct Handler<const N: usize> {
    usart: Usart,
    received: &'static Queue<u8, N>,
    sending: &'static Queue<u8, SENDING>,
    faults: &'static Faults,
}

impl<const N: usize> Handler<N> {
    /// Moves bytes both ways; waits for nothing.
    pub fn serve(&mut self) {
        self.take();
        self.give();
    }

    fn take(&mut self) {
        for _ in 0..BURST {
            let status = self.usart.status();
            if !status.received {
                return;
            }
            if self.received.is_full() {
                // It stays in the register until there is room: the line is held up, or reports
                // an overrun. Masked in the NVIC: the emulated USART keeps its interrupt raised
                // whatever its own enable bit says.
                NVIC::mask(self.usart.interrupt);
                if !self.faults.holding.swap(true, Ordering::Relaxed) {
                    count(&self.faults.held);
                }
                return;
            }
            if status.damaged {
                count(&self.faults.lost);
            }
            let _ = self.received.push(self.usart.read());
        }
        // More may wait. A real line would interrupt again by itself.
        NVIC::pend(self.usart.interrupt);
    }

    fn give(&mut self) {
        for _ in 0..BURST {
            if !self.usart.status().room {
                return;
            }
            let Some(byte) = self.sending.pop() else { break };
            self.usart.write(byte);
        }
        if self.sending.is_empty() {
            self.usart.wants_room(false);
        }
    }
}

/// A port that waits for nothing: what is not ready is an error (`TimedOut`).
pub struct Port<const N: usize> {
    usart: Usart,
    received: &'static Queue<u8, N>,
    sending: &'static Queue<u8, SENDING>,
    faults: &'static Faults,
}

/// Both ends of a line.
pub fn line<const N: usize>(
    usart: Usart,
    received: &'static Queue<u8, N>,
    sending: &'static Queue<u8, SENDING>,
    faults: &'static Faults,
) -> (Handler<N>, Port<N>) {
    (Handler { usart, received, sending, faults }, Port { usart, received, sending, faults })
}

impl<const N: usize> Port<N> {
    /// The next received byte.
    pub fn receive(&mut self) -> Option<u8> {
        let byte = self.received.pop()?;
        // There is room again: let the line go on.
        if self.faults.holding.swap(false, Ordering::Relaxed) {
            self.wake();
        }
        Some(byte)
    }

    /// Bytes that came damaged, or when there was no room for them.
    pub fn lost(&self) -> u32 {
        self.faults.lost.load(Ordering::Relaxed)
    }

    /// Bytes that had to wait in the line's register because there was no room for them.
    pub fn held(&self) -> u32 {
        self.faults.held.load(Ordering::Relaxed)
    }

    /// Has the handler run. Pended by hand: the emulated line raises no interrupt when it can send, nor
    /// a second time for a byte that has come while the one before was read.
    fn wake(&self) {
        // SAFETY: the handler shares nothing but the queues, and nobody masks an interrupt to
        // keep it from them.
        unsafe { NVIC::unmask(self.usart.interrupt) };
        NVIC::pend(self.usart.interrupt);
    }

    /// Has the handler send what waits. Also where the line is held: what a flooded line has to say
    /// must get out, or nobody takes what waits.
    fn kick(&self) {
        self.usart.wants_room(true);
        self.wake();
    }
}

impl<const N: usize> ErrorType for Port<N> {
    type Error = ErrorKind;
}

impl<const N: usize> ReadReady for Port<N> {
    fn read_ready(&mut self) -> Result<bool, ErrorKind> {
        Ok(!self.received.is_empty())
    }
}

impl<const N: usize> Read for Port<N> {
    fn read(&mut self, bytes: &mut [u8]) -> Result<usize, ErrorKind> {
        let Some(first) = bytes.first_mut() else { return Ok(0) };
        *first = self.receive().ok_or(ErrorKind::TimedOut)?;
        Ok(1)
    }
}

impl<const N: usize> WriteReady for Port<N> {
    fn write_ready(&mut self) -> Result<bool, ErrorKind> {
        if !self.sending.is_empty() {
            self.kick();
        }
        Ok(!self.sending.is_full())
    }
}

impl<const N: usize> Write for Port<N> {
    fn write(&mut self, bytes: &[u8]) -> Result<usize, ErrorKind> {
        let taken = bytes.iter().take_while(|byte| self.sending.push(**byte)).count();
        if taken == 0 && !bytes.is_empty() {
            return Err(ErrorKind::TimedOut);
        }
        self.kick();
        Ok(taken)
    }

    fn flush(&mut self) -> Result<(), ErrorKind> {
        let sent = |_| self.sending.is_empty() && self.usart.status().sent;
        if (0..FLUSH_POLLS).any(sent) { Ok(()) } else { Err(ErrorKind::TimedOut) }
    }
}
