//! A USART (RM0090 30), 8 data bits, no parity, 1 stop bit.
#![allow(unsafe_code, reason = "registers by address; each block says why it is sound")]

use super::dma::Stream;
use super::pac::{self, usart1::RegisterBlock};

/// A USART of the chip, and its DMA streams in the order receive, send (RM0090 tables 42 and 43).
#[derive(Debug, Clone, Copy)]
pub struct Usart {
    registers: *const RegisterBlock,
    streams: [Stream; 2],
}

// SAFETY: an address that is always mapped. The interrupt's handler alone reads and writes data; others
// only read the status, or set a bit that the handler clears.
unsafe impl Send for Usart {}

#[derive(Debug, Clone, Copy)]
pub struct Status(u16);

#[allow(dead_code, reason = "coprocessor leaves single bytes to DMA; bringup does not")]
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

    /// Returns whether a byte was received, or lost because it was not read in time.
    pub fn received(self) -> bool {
        self.any(Self::RECEIVED | Self::OVERRUN)
    }

    /// Returns whether the received byte is damaged, or the byte after it was lost.
    pub fn damaged(self) -> bool {
        self.any(Self::PARITY | Self::FRAMING | Self::NOISE | Self::OVERRUN)
    }

    pub fn room(self) -> bool {
        self.any(Self::ROOM)
    }

    pub fn sent(self) -> bool {
        self.any(Self::SENT)
    }
}

impl Usart {
    /// Returns USART1, on APB2.
    pub const fn one() -> Self {
        Self::new(pac::USART1::ptr(), [(pac::DMA2::ptr(), 2, 4), (pac::DMA2::ptr(), 7, 4)])
    }

    /// Returns USART2, on APB1.
    pub const fn two() -> Self {
        Self::new(pac::USART2::ptr(), [(pac::DMA1::ptr(), 5, 4), (pac::DMA1::ptr(), 6, 4)])
    }

    /// Returns USART3, on APB1.
    pub const fn three() -> Self {
        Self::new(pac::USART3::ptr(), [(pac::DMA1::ptr(), 1, 4), (pac::DMA1::ptr(), 3, 4)])
    }

    /// Returns UART4, on APB1, which has the registers of a USART without those for synchronous mode.
    pub const fn four() -> Self {
        Self::new(pac::UART4::ptr().cast(), [(pac::DMA1::ptr(), 2, 4), (pac::DMA1::ptr(), 4, 4)])
    }

    /// Returns USART6, on APB2.
    pub const fn six() -> Self {
        Self::new(pac::USART6::ptr(), [(pac::DMA2::ptr(), 1, 5), (pac::DMA2::ptr(), 6, 5)])
    }

    /// Returns a USART; its streams are controller, number and channel.
    const fn new(
        registers: *const RegisterBlock,
        [receiver, sender]: [(*const pac::dma2::RegisterBlock, usize, u8); 2],
    ) -> Self {
        let streams =
            [Stream::new(receiver.0, receiver.1, receiver.2), Stream::new(sender.0, sender.1, sender.2)];
        Self { registers, streams }
    }

    fn registers(&self) -> &RegisterBlock {
        // SAFETY: see above.
        unsafe { &*self.registers }
    }

    /// Starts both directions at the bit rate nearest to `baud`.
    pub fn start(&self, clock_hz: u32, baud: u32) {
        let divider = (clock_hz + baud / 2).checked_div(baud).unwrap_or_default();
        // SAFETY: any 16-bit value is a valid divider (RM0090 30.3.4).
        self.registers().brr().write(|w| unsafe { w.bits(divider as u16) });
        self.registers().cr1().write(|w| w.ue().enabled().te().enabled().re().enabled());
    }

    /// Enables DMA requests for both directions, and the interrupt for every damaged byte (RM0090 30.3.13).
    pub fn request_dma(&self) {
        self.registers().cr3().write(|w| w.dmar().enabled().dmat().enabled().eie().enabled());
    }

    /// Lets DMA write every received byte to `len` bytes of memory, in circular mode.
    ///
    /// # Safety
    /// Nothing else writes the memory from now on.
    pub unsafe fn receive_to(&self, memory: *mut u8, len: u16) {
        // SAFETY: the stream is this USART's; the rest is the caller's.
        unsafe { self.streams[0].receive(self.data(), memory, len) };
    }

    /// Lets DMA send `len` bytes of memory. [`Usart::is_sending`] must have returned false.
    ///
    /// # Safety
    /// Nothing writes the memory until [`Usart::is_sending`] returns false.
    pub unsafe fn send_from(&self, memory: *const u8, len: u16) {
        // Clears TC, or the last byte's end is not detected (RM0090 30.3.13). Zeros clear flags, ones do nothing.
        // SAFETY: see above; the stream is this USART's, and the rest is the caller's.
        unsafe {
            self.registers().sr().write(|w| w.bits(!Status::SENT)); // reset value: 0x00C0, every bit is written
            self.streams[1].send(self.data(), memory, len);
        }
    }

    /// Returns whether DMA still has to read bytes of [`Usart::send_from`].
    pub fn is_sending(&self) -> bool {
        self.streams[1].is_running()
    }

    fn data(&self) -> *const u32 {
        core::ptr::from_ref(self.registers().dr()).cast()
    }

    pub fn receiver(&self) -> Stream {
        self.streams[0]
    }

    /// Reads the status. Reading the data register after it clears the errors (RM0090 30.6.1).
    #[inline]
    pub fn status(&self) -> Status {
        Status(self.registers().sr().read().bits())
    }

    #[inline]
    pub fn read(&self) -> u8 {
        self.registers().dr().read().bits() as u8
    }

    /// There must be room.
    #[allow(dead_code, reason = "coprocessor sends by DMA alone")]
    #[inline]
    pub fn write(&self, byte: u8) {
        // SAFETY: the data register takes any byte.
        self.registers().dr().write(|w| unsafe { w.bits(byte.into()) });
    }
}
