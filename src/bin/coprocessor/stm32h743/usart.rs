//! A USART's registers (RM0433 48); its FIFO is off.
#![allow(unsafe_code, reason = "raw register values; each block says why it is sound")]

use crate::usart::{Status, Usart};

impl Usart {
    pub fn set_divider(&self, divider: u16) {
        // SAFETY: any value of 16 and more is a valid divider (RM0433 48.5.7).
        self.registers().brr().write(|w| unsafe { w.brr().bits(divider) });
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
}
