//! A DMA stream (RM0090 10) between a peripheral's data register and bytes in SRAM, in direct mode.
//!
//! The streams raise no interrupt: their owners poll how far they are. The DMA can access SRAM, but not CCM (RM0090
//! 2.3.1). No stream of DMA2 serves a peripheral of the AHB: together with APB2's, it could corrupt data (ES0182,
//! "DMA2 data corruption when managing AHB and APB2 peripherals in a concurrent way").
#![allow(unsafe_code, reason = "registers by address; each block says why it is sound")]

use super::pac::dma2::{RegisterBlock, ST};
use core::sync::atomic::{Ordering, compiler_fence};

/// One of the eight streams of a controller, and the channel that its requests come from (RM0090 tables 42 and 43).
#[derive(Debug, Clone, Copy)]
pub struct Stream {
    controller: *const RegisterBlock,
    registers: *const ST,
    number: usize,
    channel: u8,
}

// SAFETY: an address that is always mapped. A stream has one owner, and of the registers that streams share, the
// flags are cleared by writing ones.
unsafe impl Send for Stream {}

impl Stream {
    /// Flags of a stream in its part of the status registers: all, and transfer complete.
    const FLAGS: u32 = 0x3D;
    const COMPLETE: u32 = 1 << 5;

    /// Returns the handle of a stream, 0 to 7, with a channel, 0 to 7, of a controller of the chip.
    pub const fn new(controller: *const RegisterBlock, number: usize, channel: u8) -> Self {
        // Registers of a stream follow those of the controller (RM0090 10.5.11).
        let registers = controller.wrapping_byte_add(0x10 + 0x18 * (number % 8)).cast();
        Self { controller, registers, number, channel }
    }

    fn controller(&self) -> &RegisterBlock {
        // SAFETY: `new` computed the address of this stream's registers.
        unsafe { &*self.controller }
    }

    fn stream(&self) -> &ST {
        // SAFETY: `new` computed the address of this stream's registers.
        unsafe { &*self.registers }
    }

    /// Returns the offset of the stream's flags in a status register, bits.
    fn shift(&self) -> u32 {
        [0, 6, 16, 22][self.number % 4]
    }

    /// Starts to write every byte that the register receives to `len` bytes of memory, in circular mode.
    ///
    /// # Safety
    /// The register is one that the channel's peripheral receives with, and nothing else writes the memory from now on.
    pub unsafe fn receive(&self, register: *const u32, memory: *mut u8, len: u16) {
        // SAFETY: the caller's.
        unsafe { self.prepare(register, memory, len) };
        self.stream().cr().write(|w| {
            w.chsel().set(self.channel).pl().high().minc().incremented().circ().enabled();
            w.dir().peripheral_to_memory().en().enabled()
        });
    }

    /// Starts to write `len` bytes of memory to the register. The stream must have ended.
    ///
    /// # Safety
    /// The register is one that the channel's peripheral sends with, and nothing writes the memory until the stream
    /// has ended.
    pub unsafe fn send(&self, register: *const u32, memory: *const u8, len: u16) {
        // SAFETY: the caller's.
        unsafe { self.prepare(register, memory.cast_mut(), len) };
        self.stream().cr().write(|w| {
            w.chsel().set(self.channel).minc().incremented();
            w.dir().memory_to_peripheral().en().enabled()
        });
    }

    /// Sets both addresses and the count of a stream that has ended, and clears its old flags (RM0090 10.3.17).
    unsafe fn prepare(&self, register: *const u32, memory: *mut u8, len: u16) {
        self.clear(Self::FLAGS);
        let stream = self.stream();
        // SAFETY: the caller's; any count is valid.
        unsafe {
            stream.par().write(|w| w.bits(register as u32));
            stream.m0ar().write(|w| w.bits(memory as u32));
            stream.ndtr().write(|w| w.bits(len.into()));
        }
        // The processor's writes to the memory must complete before the stream starts.
        compiler_fence(Ordering::SeqCst);
        cortex_m::asm::dmb();
    }

    #[inline(always)]
    pub fn remaining(&self) -> usize {
        let left = self.stream().ndtr().read().bits() as u16;
        compiler_fence(Ordering::SeqCst);
        left.into()
    }

    #[inline(always)]
    pub fn is_running(&self) -> bool {
        self.stream().cr().read().en().is_enabled()
    }

    /// Returns whether the end was reached since the last call that returned true.
    #[inline(always)]
    pub fn take_complete(&self) -> bool {
        let dma = self.controller();
        let flags = if self.number < 4 { dma.lisr().read().bits() } else { dma.hisr().read().bits() };
        let complete = flags >> self.shift() & Self::COMPLETE != 0;
        if complete {
            self.clear(Self::COMPLETE);
        }
        complete
    }

    #[inline(always)]
    fn clear(&self, flags: u32) {
        let (dma, bits) = (self.controller(), flags << self.shift());
        // SAFETY: ones clear flags of this stream, zeros do nothing (RM0090 10.5.3).
        unsafe {
            if self.number < 4 {
                dma.lifcr().write(|w| w.bits(bits));
            } else {
                dma.hifcr().write(|w| w.bits(bits));
            }
        }
    }
}
