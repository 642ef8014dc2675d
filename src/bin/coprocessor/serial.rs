//! Serial lines: DMA moves bytes between the USART and two rings, and a task uses the other ends of the rings through
//! a port.
//!
//! On reception a stream writes the ring in circular mode, and the tick counts the bytes. Between two ticks the stream
//! writes less than a lap, so its position gives the number of bytes. If a tick was late, or position and flag show a
//! whole lap, a lap is added: the reader then finds more bytes than the ring can hold, and drops them all as lost.
#![allow(unsafe_code, reason = "memory that DMA reads and writes; each block says why it is sound")]

use crate::ring::Ring;
use crate::stm32f405::dma::Stream;
use crate::stm32f405::usart::Usart;
use core::sync::atomic::{AtomicU32, AtomicUsize, Ordering};
use embedded_io::{ErrorKind, ErrorType, Read, ReadReady, Write, WriteReady};

/// Received bytes that can wait for a task: more than a sensor sends in the 20 ms that the task may wait for an
/// estimate, and 4 ms of a line at 921600 baud.
pub const RECEIVED: usize = 512;
/// At most this many bytes wait to be sent on a line.
pub const SENDING: usize = 128;
/// Bytes that DMA may write between two ticks: 92 arrive at 921600 baud.
const AHEAD: usize = 128;
const _: () = assert!(RECEIVED >= 2 * AHEAD, "the stream must not overtake the reader unseen");
/// Polls before a flush gives up: about ten byte times at 115200.
const FLUSH_POLLS: u32 = 100_000;

const BITS: u32 = 10;
const US_PER_S: u32 = 1_000_000;

/// Static buffers and counters of a line.
pub struct Memory {
    received: Ring<u8, RECEIVED>,
    sending: Ring<u8, SENDING>,
    /// Damaged bytes since the start. Only the interrupt counts.
    damaged: AtomicU32,
    /// Received bytes with which the reader has something to do.
    wanted: AtomicUsize,
}

impl Memory {
    /// Creates empty buffers.
    ///
    /// # Safety
    /// Only one line uses the memory, and each end of its rings belongs to one task.
    pub const unsafe fn new() -> Self {
        // SAFETY: the caller's.
        let (received, sending) = unsafe { (Ring::new(), Ring::new()) };
        Self { received, sending, damaged: AtomicU32::new(0), wanted: AtomicUsize::new(1) }
    }
}

/// A task's end of a line. Reads and writes never wait: if nothing is ready they return an error (`TimedOut`).
pub struct Port {
    usart: Usart,
    memory: &'static Memory,
    /// False where the board has no such line: nothing is received, and what is sent is dropped.
    fitted: bool,
    /// Bytes that DMA is sending.
    under_way: usize,
    /// Received bytes that were overwritten before they were read.
    overwritten: u32,
}

/// The ends of a line: the interrupt's, the tick's where the board has the line, and a task's.
pub type Ends = (Handler, Option<Reception>, Port);

/// Starts a line whose ends have not been used yet; without rates (clock and baud) the board has none.
pub fn start(usart: Usart, memory: &'static Memory, rates: Option<(u32, u32)>) -> Ends {
    let Memory { received, damaged, .. } = memory;
    let reception = rates.map(|(clock_hz, baud)| {
        // SAFETY: the ring's writing end is the DMA's alone.
        unsafe { usart.receive_to(received.as_mut_ptr(), RECEIVED as u16) };
        usart.request_dma();
        usart.start(clock_hz, baud);
        Reception::new(usart.receiver(), memory, baud)
    });
    let port = Port { usart, memory, fitted: rates.is_some(), under_way: 0, overwritten: 0 };
    (Handler { usart, damaged }, reception, port)
}

/// The interrupt handler's end of a line: counts the bytes that arrived damaged.
pub struct Handler {
    usart: Usart,
    damaged: &'static AtomicU32,
}

impl Handler {
    /// Serves the line's interrupt without waiting.
    #[inline(always)]
    pub fn serve(&mut self) {
        if self.usart.status().damaged() {
            let damaged = self.damaged.load(Ordering::Relaxed).saturating_add(1);
            self.damaged.store(damaged, Ordering::Relaxed);
            // Clears the errors (RM0090 30.6.1). The DMA has taken the byte.
            let _ = self.usart.read();
        }
    }
}

/// Counts the bytes that a stream writes to a ring.
pub struct Reception {
    stream: Stream,
    memory: &'static Memory,
    /// Index of the next byte in the ring.
    place: usize,
    /// Time that the stream takes for a lap, us.
    lap_us: u32,
}

impl Reception {
    /// Returns a reception that counts from the ring's first byte, where the stream begins.
    pub fn new(stream: Stream, memory: &'static Memory, baud: u32) -> Self {
        let lap_us = (RECEIVED as u32 * BITS).saturating_mul(US_PER_S / 100) / (baud / 100).max(1);
        Self { stream, memory, place: 0, lap_us }
    }

    /// Counts the bytes received in `elapsed` us since the last count; returns whether they give the reader something to do. Called at least twice
    /// a lap; the reader must not run meanwhile.
    #[inline(always)]
    pub fn count(&mut self, elapsed: u32) -> bool {
        let late = elapsed >= self.lap_us;
        if !late && RECEIVED - self.place == self.stream.remaining() {
            // Less than a lap has passed, so no byte has come.
            return false;
        }
        self.advance(late)
    }

    #[inline(never)]
    #[unsafe(link_section = ".ram_code.advance")]
    fn advance(&mut self, late: bool) -> bool {
        let around = self.stream.take_complete();
        let place = RECEIVED - self.stream.remaining().clamp(1, RECEIVED);
        let wrapped = place < self.place;
        if wrapped && !around {
            // The stream wrapped after the flag was read.
            self.stream.take_complete();
        }
        let lapped = around && (late || !wrapped);
        let received = place.wrapping_sub(self.place) % RECEIVED + if lapped { RECEIVED } else { 0 };
        self.memory.received.advance_write(received);
        self.place = place;
        self.memory.received.len() >= self.memory.wanted.load(Ordering::Relaxed)
    }
}

impl Port {
    /// Returns the oldest received bytes, up to the end of the ring's buffer; empty if no byte is waiting.
    #[inline]
    pub fn received(&mut self) -> &[u8] {
        let received = &self.memory.received;
        let waiting = received.len();
        if waiting > RECEIVED - AHEAD {
            // The DMA stream is, or soon will be, overwriting the oldest bytes.
            received.drop_oldest(waiting);
            self.overwritten = self.overwritten.saturating_add(waiting as u32);
        }
        received.oldest()
    }

    #[inline]
    pub fn consume(&mut self, count: usize) {
        self.memory.received.drop_oldest(count);
    }

    /// Lets the reader run when so many bytes wait.
    #[inline]
    pub fn want(&self, count: usize) {
        self.memory.wanted.store(count, Ordering::Relaxed);
    }

    #[inline]
    pub fn waiting(&self) -> usize {
        self.memory.received.len()
    }

    /// Returns whether bytes have been received, or are being sent.
    #[inline]
    pub fn is_busy(&self) -> bool {
        !self.memory.received.is_empty() || !self.memory.sending.is_empty()
    }

    pub fn lost(&self) -> u32 {
        self.memory.damaged.load(Ordering::Relaxed).saturating_add(self.overwritten)
    }

    /// Returns whether the last bit of the last byte is on the line.
    pub fn is_sent(&mut self) -> bool {
        self.advance();
        self.memory.sending.is_empty() && (!self.fitted || self.usart.status().sent())
    }

    /// Starts to send the waiting bytes, if DMA has sent the previous ones. A task that sends calls this in every step.
    pub fn advance(&mut self) {
        let sending = &self.memory.sending;
        if !self.fitted {
            return sending.drop_oldest(sending.len());
        }
        if self.usart.is_sending() {
            return;
        }
        sending.drop_oldest(core::mem::take(&mut self.under_way));
        let bytes = sending.oldest();
        if !bytes.is_empty() {
            self.under_way = bytes.len();
            // SAFETY: the bytes stay in the ring until DMA has read them.
            unsafe { self.usart.send_from(bytes.as_ptr(), bytes.len() as u16) };
        }
    }
}

impl ErrorType for Port {
    type Error = ErrorKind;
}

impl ReadReady for Port {
    fn read_ready(&mut self) -> Result<bool, ErrorKind> {
        Ok(!self.memory.received.is_empty())
    }
}

impl Read for Port {
    fn read(&mut self, bytes: &mut [u8]) -> Result<usize, ErrorKind> {
        let Some(first) = bytes.first_mut() else { return Ok(0) };
        *first = *self.received().first().ok_or(ErrorKind::TimedOut)?;
        self.consume(1);
        Ok(1)
    }
}

impl WriteReady for Port {
    fn write_ready(&mut self) -> Result<bool, ErrorKind> {
        self.advance();
        Ok(!self.memory.sending.is_full())
    }
}

impl Write for Port {
    fn write(&mut self, bytes: &[u8]) -> Result<usize, ErrorKind> {
        let accepted = self.memory.sending.extend(bytes);
        if accepted == 0 && !bytes.is_empty() {
            return Err(ErrorKind::TimedOut);
        }
        self.advance();
        Ok(accepted)
    }

    fn flush(&mut self) -> Result<(), ErrorKind> {
        if (0..FLUSH_POLLS).any(|_| self.is_sent()) { Ok(()) } else { Err(ErrorKind::TimedOut) }
    }
}
