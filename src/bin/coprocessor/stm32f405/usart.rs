//! A USART's registers (RM0090 30).
#![allow(unsafe_code, reason = "raw register values; each block says why it is sound")]

use crate::usart::{Status, Usart};

impl Usart {
    pub fn set_divider(&self, divider: u16) {
        // SAFETY: any 16-bit value is a valid divider (RM0090 30.3.4).
        self.registers().brr().write(|w| unsafe { w.bits(divider) });
    }

    /// Before `read`: that clears the errors (RM0090 30.6.1).
    pub fn status(&self) -> Status {
        let status = self.registers().sr().read();
        let lost = status.ore().bit_is_set();
        Status {
            received: status.rxne().bit_is_set() || lost,
            damaged: lost || status.fe().bit_is_set() || status.nf().bit_is_set(),
            room: status.txe().bit_is_set(),
            sent: status.tc().bit_is_set(),
        }
    }

    /// The byte that has come.
    pub fn read(&self) -> u8 {
        self.registers().dr().read().dr().bits() as u8
    }

    /// Sends a byte, when there is room.
    pub fn write(&self, byte: u8) {
        // SAFETY: the data register takes any byte.
        self.registers().dr().write(|w| unsafe { w.bits(byte.into()) });
    }
}
