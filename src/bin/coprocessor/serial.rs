//! Serial lines: an interrupt handler moves bytes between the USART and two rings, and a port gives the
//! other ends of the rings to a task.
#![allow(unsafe_code, reason = "the interrupt mask; the block says why it is sound")]

use crate::ring::Ring;
use crate::stm32f405::usart::{Status, Usart};
use core::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use cortex_m::peripheral::NVIC;
use embedded_io::{ErrorKind, ErrorType, Read, ReadReady, Write, WriteReady};

/// Bytes on their way to a line.
pub const SENDING: usize = 128;
/// Polls before a flush gives up: about ten byte times at 115200.
const FLUSH_POLLS: u32 = 100_000;
/// Counts a line's faults since the start. The handler alone counts.
pub struct Faults {
    lost: AtomicU32,
    held: AtomicU32,
    /// A byte waits in the register, and the handler has been switched off.
    holding: AtomicBool,
}

impl Faults {
    /// Starts at zero.
    pub const fn new() -> Self {
        Self { lost: AtomicU32::new(0), held: AtomicU32::new(0), holding: AtomicBool::new(false) }
    }
}

fn count(counter: &AtomicU32) {
    counter.store(counter.load(Ordering::Relaxed).saturating_add(1), Ordering::Relaxed);
}

/// The interrupt's end of a line.
pub struct Handler<const N: usize> {
    usart: Usart,
    received: &'static Ring<u8, N>,
    sending: &'static Ring<u8, SENDING>,
    faults: &'static Faults,
    /// True while room for a byte raises the interrupt.
    room_requested: bool,
    emulated: bool,
}

impl<const N: usize> Handler<N> {
    /// Moves a byte each way; waits for nothing. The interrupt is raised again for the next one, in the emulator
    /// by hand: its USART has all bytes of the host at once, and raises it for the first.
    #[inline(always)]
    pub fn serve(&mut self) {
        let status = self.usart.status();
        let took = status.received() && self.take(status);
        // Also where there was no room for a byte: a task that waits to send would never make room.
        let gave = status.room() && self.give();
        let wanted = !self.sending.is_empty();
        if wanted != self.room_requested {
            self.room_requested = wanted;
            self.usart.request_room(wanted);
        }
        if self.emulated && (took || gave) {
            NVIC::pend(self.usart.interrupt);
        }
    }

    /// Takes the byte that has come; whether there was room for it.
    #[inline(always)]
    fn take(&mut self, status: Status) -> bool {
        if !self.received.push_with(|| self.usart.read()) {
            self.hold();
            return false;
        }
        if status.damaged() {
            count(&self.faults.lost);
        }
        true
    }

    /// Leaves the byte in the register until there is room; the line then reports an overrun. The interrupt is
    /// masked in the NVIC: the emulated USART keeps it raised whatever its own enable bit says.
    #[cold]
    fn hold(&self) {
        NVIC::mask(self.usart.interrupt);
        if !self.faults.holding.swap(true, Ordering::Relaxed) {
            count(&self.faults.held);
        }
    }

    /// Gives the line the next byte; whether there was one.
    #[inline(always)]
    fn give(&mut self) -> bool {
        let byte = self.sending.pop();
        if let Some(byte) = byte {
            self.usart.write(byte);
        }
        byte.is_some()
    }
}

/// A task's end of a line. It never waits: where nothing is ready it gives an error (`TimedOut`).
pub struct Port<const N: usize> {
    usart: Usart,
    received: &'static Ring<u8, N>,
    sending: &'static Ring<u8, SENDING>,
    faults: &'static Faults,
}

/// Both ends of a line.
pub fn line<const N: usize>(
    usart: Usart,
    received: &'static Ring<u8, N>,
    sending: &'static Ring<u8, SENDING>,
    faults: &'static Faults,
    emulated: bool,
) -> (Handler<N>, Port<N>) {
    (
        Handler { usart, received, sending, faults, room_requested: false, emulated },
        Port { usart, received, sending, faults },
    )
}

impl<const N: usize> Port<N> {
    /// The next received byte.
    pub fn receive(&mut self) -> Option<u8> {
        let byte = self.received.pop()?;
        // There is room again.
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

    /// Runs the handler, even where reception is held up. Pended by hand: the emulated line raises no interrupt when it can send, nor a
    /// second time for a byte that came while the one before was read.
    fn wake(&self) {
        // SAFETY: the handler shares nothing but the rings, and nobody masks an interrupt to
        // keep it from them.
        unsafe { NVIC::unmask(self.usart.interrupt) };
        NVIC::pend(self.usart.interrupt);
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
            self.wake();
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
        self.wake();
        Ok(taken)
    }

    fn flush(&mut self) -> Result<(), ErrorKind> {
        let sent = |_| self.sending.is_empty() && self.usart.status().sent();
        if (0..FLUSH_POLLS).any(sent) { Ok(()) } else { Err(ErrorKind::TimedOut) }
    }
}
