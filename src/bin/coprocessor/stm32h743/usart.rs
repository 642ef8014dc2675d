//! A USART's registers (RM0433 48), as `serial` uses them; its FIFO is off.
#![allow(unsafe_code, reason = "registers by address; each block says why it is sound")]

use super::pac::{Interrupt, usart1::RegisterBlock};

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
    fn registers(&self) -> &RegisterBlock {
        // SAFETY: see above.
        unsafe { &*self.registers }
    }

    /// Lets it run at the rate that is nearest to `baud`; 8N1, both ways.
    pub fn start(self, clock_hz: u32, baud: u32) {
        let divider = ((clock_hz + baud / 2) / baud) as u16;
        // SAFETY: any value of 16 and more is a valid divider (RM0433 48.5.7).
        self.registers().brr().write(|w| unsafe { w.brr().bits(divider) });
        self.registers().cr1().write(|w| w.ue().enabled().te().enabled().re().enabled().rxneie().enabled());
    }

    /// Before `read`.
    pub fn status(&self) -> Status {
        let status = self.registers().isr().read();
        let lost = status.ore().bit_is_set();
        Status {
            received: status.rxne().bit_is_set() || lost,
            damaged: lost || status.fe().bit_is_set() || status.nf().bit_is_set(),
            room: status.txe().bit_is_set(),
            sent: status.tc().bit_is_set(),
        }
    }

    /// The byte that has come. Clears the errors that `status` told of.
    pub fn read(&self) -> u8 {
        self.registers().icr().write(|w| w.orecf().clear().fecf().clear().ncf().clear());
        self.registers().rdr().read().rdr().bits() as u8
    }

    /// Sends a byte, when there is room.
    pub fn write(&self, byte: u8) {
        // SAFETY: the data register takes any byte.
        self.registers().tdr().write(|w| unsafe { w.tdr().bits(byte.into()) });
    }

    /// Whether room for a byte raises the interrupt.
    pub fn wants_room(&self, wants: bool) {
        self.registers().cr1().modify(|_, w| w.txeie().bit(wants));
    }
}
