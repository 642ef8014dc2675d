//! A USART (RM0090 30), 8 data bits, no parity, 1 stop bit.
#![allow(unsafe_code, reason = "registers by address; each block says why it is sound")]

use super::pac::{Interrupt, usart1::RegisterBlock};

/// A USART of the chip and its interrupt.
#[derive(Debug, Clone, Copy)]
pub struct Usart {
    registers: *const RegisterBlock,
    /// Raised when a byte has come, and when there is room for one if that was asked for.
    pub interrupt: Interrupt,
}

// SAFETY: an address that is always mapped. The interrupt's handler alone reads and writes data; others
// only read the status, or set a bit that the handler clears.
unsafe impl Send for Usart {}

/// The status register, read once.
#[derive(Debug, Clone, Copy)]
pub struct Status(u16);

impl Status {
    const PARITY: u16 = 1;
    const FRAMING: u16 = 1 << 1;
    const NOISE: u16 = 1 << 2;
    const OVERRUN: u16 = 1 << 3;
    const RECEIVED: u16 = 1 << 5;
    const SENT: u16 = 1 << 6;
    const ROOM: u16 = 1 << 7;

    fn any(self, flags: u16) -> bool {
        self.0 & flags != 0
    }

    /// Returns whether a byte has come, or one was lost because it was not taken in time.
    pub fn received(self) -> bool {
        self.any(Self::RECEIVED | Self::OVERRUN)
    }

    /// Returns whether the byte that has come is damaged, or one behind it was lost.
    pub fn damaged(self) -> bool {
        self.any(Self::PARITY | Self::FRAMING | Self::NOISE | Self::OVERRUN)
    }

    /// Returns whether the data register takes a byte.
    pub fn room(self) -> bool {
        self.any(Self::ROOM)
    }

    /// Returns whether everything written has left the line.
    pub fn sent(self) -> bool {
        self.any(Self::SENT)
    }
}

impl Usart {
    /// Names a USART by its registers, which must be those of one of the chip's, and its interrupt.
    pub const fn new(registers: *const RegisterBlock, interrupt: Interrupt) -> Self {
        Self { registers, interrupt }
    }

    fn registers(&self) -> &RegisterBlock {
        // SAFETY: see above.
        unsafe { &*self.registers }
    }

    /// Starts both directions at the bit rate nearest to `baud`, and the interrupt of received bytes.
    pub fn start(&self, clock_hz: u32, baud: u32) {
        let divider = (clock_hz + baud / 2).checked_div(baud).unwrap_or_default();
        // SAFETY: any 16-bit value is a valid divider (RM0090 30.3.4).
        self.registers().brr().write(|w| unsafe { w.bits(divider as u16) });
        self.registers().cr1().write(|w| w.ue().enabled().te().enabled().re().enabled().rxneie().enabled());
    }

    /// Reads the status. Reading the data register after it clears the errors (RM0090 30.6.1).
    #[inline]
    pub fn status(&self) -> Status {
        Status(self.registers().sr().read().bits())
    }

    /// Takes the byte that has come.
    #[inline]
    pub fn read(&self) -> u8 {
        self.registers().dr().read().bits() as u8
    }

    /// Sends a byte, when there is room.
    #[inline]
    pub fn write(&self, byte: u8) {
        // SAFETY: the data register takes any byte.
        self.registers().dr().write(|w| unsafe { w.bits(byte.into()) });
    }

    /// Selects whether room for a byte raises the interrupt.
    #[inline]
    pub fn request_room(&self, wanted: bool) {
        self.registers().cr1().modify(|_, w| w.txeie().bit(wanted));
    }
}
