//! Pins (RM0090 8): alternate functions, outputs, pull-ups.
#![allow(unsafe_code, reason = "register values and ports by number; each block says why it is sound")]

use super::pac;

/// Alternate functions (DS8626 table 9).
pub const USART_1_TO_3: u8 = 7;
pub const UART_4_AND_6: u8 = 8;
pub const CAN_1: u8 = 9;
pub const SPI_1: u8 = 5;

/// A pin of the ports A to E.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Pin {
    port: Port,
    number: u8,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Port {
    A,
    B,
    C,
    D,
    E,
}

/// The speed of a pin's edges (OSPEEDR).
#[derive(Debug, Clone, Copy)]
pub enum Speed {
    /// Up to 2 MHz.
    Low = 0b00,
    /// Up to 50 MHz.
    Fast = 0b10,
}

impl Pin {
    /// Returns a pin, by the letter of its port and its number.
    ///
    /// # Panics
    /// If there is no such port or pin, when the image is compiled.
    pub const fn new(port: char, number: u8) -> Self {
        assert!(number < 16, "a port has 16 pins");
        let port = match port {
            'A' => Port::A,
            'B' => Port::B,
            'C' => Port::C,
            'D' => Port::D,
            'E' => Port::E,
            _ => panic!("only ports A to E are clocked"),
        };
        Self { port, number }
    }

    fn registers(self) -> &'static pac::gpiob::RegisterBlock {
        let port: *const pac::gpiob::RegisterBlock = match self.port {
            Port::A => pac::GPIOA::ptr().cast(),
            Port::B => pac::GPIOB::ptr(),
            Port::C => pac::GPIOC::ptr().cast(),
            Port::D => pac::GPIOD::ptr().cast(),
            Port::E => pac::GPIOE::ptr().cast(),
        };
        // SAFETY: all ports have the same registers (RM0090 8.4.11) and are always mapped. BSRR is set
        // without reading; everything else is written before interrupts are on.
        unsafe { &*port }
    }

    /// Returns `old` with the pin's field of `width` bits replaced.
    fn field(self, old: u32, width: u8, value: u32) -> u32 {
        let shift = (self.number * width) % 32;
        let mask = (1 << width) - 1;
        old & !(mask << shift) | (value & mask) << shift
    }

    pub fn alternate(self, function: u8, speed: Speed) {
        let port = self.registers();
        // SAFETY: each field takes any value of its width.
        unsafe {
            if self.number < 8 {
                port.afrl().modify(|r, w| w.bits(self.field(r.bits(), 4, function.into())));
            } else {
                port.afrh().modify(|r, w| w.bits(self.field(r.bits(), 4, function.into())));
            }
            port.ospeedr().modify(|r, w| w.bits(self.field(r.bits(), 2, speed as u32)));
            port.moder().modify(|r, w| w.bits(self.field(r.bits(), 2, 0b10)));
        }
    }

    /// Enables the pull-up, so that an open input reads as high.
    pub fn pull_up(self) {
        // SAFETY: the field takes any value of its width.
        self.registers().pupdr().modify(|r, w| unsafe { w.bits(self.field(r.bits(), 2, 0b01)) });
    }

    pub fn output(self, high: bool) {
        self.set(high);
        // SAFETY: the field takes any value of its width.
        self.registers().moder().modify(|r, w| unsafe { w.bits(self.field(r.bits(), 2, 0b01)) });
    }

    pub fn set(self, high: bool) {
        let bit = 1 << self.number;
        // SAFETY: ones set or reset their pin, zeros change nothing (RM0090 8.4.7).
        self.registers().bsrr().write(|w| unsafe { w.bits(if high { bit } else { bit << 16 }) });
    }
}
