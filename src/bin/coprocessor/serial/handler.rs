//! This module handles a line's interrupt. On the chip, DMA moves the bytes, and the handler counts the damaged ones.
//! In the emulator, which has no DMA, the handler also moves each byte between the USART and the rings.
#![allow(unsafe_code, reason = "the interrupt mask; the block says why it is sound")]

use super::{RECEIVED, SENDING};
use crate::ring::Ring;
use crate::stm32f405::usart::{Status, Usart};
use core::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use cortex_m::peripheral::NVIC;

/// Counts a line's faults since the start. Only the handler counts.
pub struct Faults {
    lost: AtomicU32,
    delayed: AtomicU32,
    /// True while a byte waits in the register and the interrupt is masked.
    holding: AtomicBool,
}

impl Faults {
    /// Creates counters at zero.
    pub const fn new() -> Self {
        Self { lost: AtomicU32::new(0), delayed: AtomicU32::new(0), holding: AtomicBool::new(false) }
    }

    /// Returns the number of bytes that were damaged, or lost while another byte waited in the register.
    pub fn lost(&self) -> u32 {
        self.lost.load(Ordering::Relaxed)
    }

    /// Returns the number of bytes that had to wait in the register.
    pub fn delayed(&self) -> u32 {
        self.delayed.load(Ordering::Relaxed)
    }

    /// Unmasks the interrupt if it was masked, because there is room again.
    pub fn release(&self, usart: &Usart) {
        if self.holding.swap(false, Ordering::Relaxed) {
            raise(usart);
        }
    }
}

/// Runs the handler, even if its interrupt is masked. The emulated line raises no interrupt when it can send, nor a
/// second one for a byte that arrived while the previous one was read.
pub fn raise(usart: &Usart) {
    // SAFETY: the handler shares only the rings, and no code masks an interrupt to protect them.
    unsafe { NVIC::unmask(usart.interrupt) };
    NVIC::pend(usart.interrupt);
}

fn count(counter: &AtomicU32) {
    counter.store(counter.load(Ordering::Relaxed).saturating_add(1), Ordering::Relaxed);
}

/// The interrupt handler's end of a line.
pub struct Handler {
    pub usart: Usart,
    pub received: &'static Ring<u8, RECEIVED>,
    pub sending: &'static Ring<u8, SENDING>,
    pub faults: &'static Faults,
    /// True where the handler moves the bytes.
    pub emulated: bool,
    /// True while room for a byte raises the interrupt.
    pub room_requested: bool,
}

impl Handler {
    /// Serves the line's interrupt without waiting.
    #[inline(always)]
    pub fn serve(&mut self) {
        let status = self.usart.status();
        if self.emulated {
            self.move_bytes(status);
        } else if status.damaged() {
            count(&self.faults.lost);
            // Clears the errors (RM0090 30.6.1). The DMA has taken the byte.
            let _ = self.usart.read();
        }
    }

    /// Moves a byte in each direction, and pends the interrupt for the next one: the emulated USART has all bytes of
    /// the host at once, and raises the interrupt only for the first.
    #[inline(always)]
    fn move_bytes(&mut self, status: Status) {
        let took = status.received() && self.take(status);
        // Send even if a received byte found no room: otherwise a task that waits to send would never make room.
        let gave = status.room() && self.give();
        let wanted = !self.sending.is_empty();
        if wanted != self.room_requested {
            self.room_requested = wanted;
            self.usart.request_room(wanted);
        }
        if took || gave {
            NVIC::pend(self.usart.interrupt);
        }
    }

    /// Takes the received byte; returns whether there was room for it.
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

    /// Leaves the byte in the register until there is room; the line then reports an overrun. The interrupt is masked
    /// in the NVIC, because the emulated USART keeps it raised whatever its own enable bit says.
    #[cold]
    fn hold(&self) {
        NVIC::mask(self.usart.interrupt);
        if !self.faults.holding.swap(true, Ordering::Relaxed) {
            count(&self.faults.delayed);
        }
    }

    /// Writes the next byte to the USART; returns whether there was one.
    #[inline(always)]
    fn give(&mut self) -> bool {
        let byte = self.sending.pop();
        if let Some(byte) = byte {
            self.usart.write(byte);
        }
        byte.is_some()
    }
}
