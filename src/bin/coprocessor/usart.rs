//! A USART, as `serial` uses it. What its registers are called, the part's folder knows.
#![allow(unsafe_code, reason = "registers by address; each block says why it is sound")]

use crate::chip::pac::{Interrupt, usart1::RegisterBlock};

/// Where a line's registers are, and its interrupt.
#[derive(Clone, Copy)]
pub struct Usart {
    /// A USART of this part.
    pub registers: *const RegisterBlock,
    /// Its interrupt.
    pub interrupt: Interrupt,
}

// SAFETY: an address that is always there. The handler alone reads and writes data; others only
// read the status, or set a bit that the handler clears.
unsafe impl Send for Usart {}

/// What a line says of itself.
pub struct Status {
    /// A byte has come, or one was lost before it was taken.
    pub received: bool,
    /// The next byte is damaged, or one before it was lost.
    pub damaged: bool,
    /// The data register takes a byte.
    pub room: bool,
    /// All that was written has left.
    pub sent: bool,
}

impl Usart {
    /// For the part's folder.
    pub fn registers(&self) -> &RegisterBlock {
        // SAFETY: see above.
        unsafe { &*self.registers }
    }

    /// Lets it run at the rate that is nearest to `baud`; 8N1, both ways.
    pub fn start(self, clock_hz: u32, baud: u32) {
        self.set_divider(((clock_hz + baud / 2) / baud) as u16);
        self.registers().cr1().write(|w| w.ue().enabled().te().enabled().re().enabled().rxneie().enabled());
    }

    /// Whether room for a byte raises the interrupt.
    pub fn wants_room(&self, wants: bool) {
        self.registers().cr1().modify(|_, w| w.txeie().bit(wants));
    }
}
