//! FDCAN (RM0433 56) at 500 kbit/s with classic frames, on its registers and its message memory.
//!
//! Nothing here waits but for the acknowledgement of initialisation mode, with a limit. A bus
//! that is off leaves the controller in that mode: `transmit` then asks it to join again, which
//! takes 129 times 11 recessive bits; until then frames wait in their queue, where old ones give
//! way.
#![allow(unsafe_code, reason = "raw register values and the message memory; each block says why it is sound")]

use crate::received::{self, Received};
use embedded_can::{ExtendedId, Frame as _, Id, StandardId, nb::Can};
use gyronet::can::DataFrame;
use gyronet::can::wheel::WheelSettings;
use stm32h7::stm32h743v::{self as pac, interrupt};

/// Polls before the controller is taken for missing.
const POLLS: u32 = 10_000;
/// What the segments below give.
pub const BITS_PER_SECOND: u32 = 500_000;
/// 25 MHz (the crystal) / 1 / (1 + 42 + 7) = 500 kbit/s, sampled at 86 %.
const SEGMENTS: [u8; 2] = [42, 7];

/// The message memory of both controllers, 2,560 words (RM0433 56.3.3). The first one uses what
/// stands here; offsets are in words.
const MEMORY: *mut u32 = 0x4000_AC00 as *mut u32;
/// One word for each identifier of 11 bits.
const STANDARD: usize = 0;
/// Two words for each identifier of 29 bits.
const EXTENDED: usize = 8;
/// Frames of two words of head and eight bytes.
const RECEIVED: usize = 32;
const SENDING: usize = 96;
const FRAME_WORDS: usize = 4;
/// Frames that may wait to be taken, and to be sent.
const DEPTH: usize = 16;
/// A filter's element: into FIFO 0, when the identifier is one of two (RM0433 56.3.19).
const DUAL_INTO_FIFO_0: u32 = 1 << 30 | 1 << 27;

const EXTENDED_FRAME: u32 = 1 << 30;
const REMOTE_FRAME: u32 = 1 << 29;

fn word(at: usize) -> *mut u32 {
    // SAFETY: all offsets of this file end below 200 of 2,560 words.
    unsafe { MEMORY.add(at) }
}

fn put(at: usize, value: u32) {
    // SAFETY: memory of the controller that is always there, whole words. Filters are written
    // before it runs, a frame to be sent in a place that it does not hold.
    unsafe { word(at).write_volatile(value) }
}

fn get(at: usize) -> u32 {
    // SAFETY: as above; a received frame stays until it is acknowledged.
    unsafe { word(at).read_volatile() }
}

/// The sending half.
pub struct Bus(pac::FDCAN1);

impl Bus {
    /// Brings the controller up; `None` where there is none.
    pub fn start(can: pac::FDCAN1, wheels: Option<&WheelSettings>) -> Option<Self> {
        can.cccr().modify(|_, w| w.init().set_bit());
        (0..POLLS).any(|_| can.cccr().read().init().bit_is_set()).then_some(())?;
        // Classic frames; repeated until acknowledged, as a bus wants it.
        can.cccr().modify(|_, w| w.cce().set_bit().fdoe().clear_bit().bse().clear_bit().dar().clear_bit());
        let [before, after] = SEGMENTS;
        // SAFETY: fields hold the value less one (RM0433 56.5.7).
        can.nbtp().write(|w| unsafe {
            w.nbrp().bits(0).ntseg1().bits(before - 1).ntseg2().bits(after - 1).nsjw().bits(after - 1)
        });
        filters(&can, wheels);
        // SAFETY: places and sizes within the message memory; elements of eight bytes.
        unsafe {
            can.rxf0c().write(|w| w.f0sa().bits(RECEIVED as u16).f0s().bits(DEPTH as u8));
            can.rxesc().write(|w| w.bits(0));
            can.txbc().write(|w| w.tbsa().bits(SENDING as u16).tfqs().bits(DEPTH as u8));
            can.txesc().write(|w| w.bits(0));
        }
        can.ie().write(|w| w.rf0ne().set_bit());
        can.ile().write(|w| w.eint0().set_bit());
        // It joins the bus when it has seen it idle; there is nothing to wait for.
        can.cccr().modify(|_, w| w.init().clear_bit());
        Some(Self(can))
    }

    /// Whether the controller has taken itself off the bus.
    pub fn off(&self) -> bool {
        self.0.psr().read().bo().bit_is_set()
    }
}

/// Wheel frames pass, an element each; nothing else does.
fn filters(can: &pac::FDCAN1, wheels: Option<&WheelSettings>) {
    let (mut standard, mut extended) = (0, 0);
    for frame in wheels.into_iter().flat_map(|wheels| wheels.frames.iter().flatten()) {
        match frame.id {
            Id::Standard(id) => {
                let id = u32::from(id.as_raw());
                put(STANDARD + usize::from(standard), DUAL_INTO_FIFO_0 | id << 16 | id);
                standard += 1;
            }
            Id::Extended(id) => {
                let at = EXTENDED + 2 * usize::from(extended);
                put(at, 1 << 29 | id.as_raw());
                put(at + 1, 1 << 30 | id.as_raw());
                extended += 1;
            }
        }
    }
    // SAFETY: places within the message memory, four elements at most (WheelSettings); what
    // matches none is refused, remote frames too (RM0433 56.5.16).
    unsafe {
        can.sidfc().write(|w| w.flssa().bits(STANDARD as u16).lss().bits(standard));
        can.xidfc().write(|w| w.flesa().bits(EXTENDED as u16).lse().bits(extended));
        can.gfc().write(|w| w.bits(0b10_1011));
    }
}

/// An identifier as the message memory holds it (RM0433 56.3.15).
fn head(id: Id) -> u32 {
    match id {
        Id::Standard(id) => u32::from(id.as_raw()) << 18,
        Id::Extended(id) => id.as_raw() | EXTENDED_FRAME,
    }
}

impl Can for Bus {
    type Frame = DataFrame;
    type Error = embedded_can::ErrorKind;

    fn transmit(&mut self, frame: &DataFrame) -> nb::Result<Option<DataFrame>, Self::Error> {
        if self.off() {
            self.0.cccr().modify(|_, w| w.init().clear_bit());
        }
        let status = self.0.txfqs().read();
        if status.tfqf().bit_is_set() {
            return Err(nb::Error::WouldBlock);
        }
        let place = status.tfqpi().bits() & (DEPTH as u8 - 1);
        let mut data = [0; 8];
        for (byte, from) in data.iter_mut().zip(frame.data()) {
            *byte = *from;
        }
        let [a, b, c, d, e, f, g, h] = data;
        let at = SENDING + FRAME_WORDS * usize::from(place);
        put(at, head(frame.id()));
        put(at + 1, (frame.data().len() as u32) << 16);
        put(at + 2, u32::from_le_bytes([a, b, c, d]));
        put(at + 3, u32::from_le_bytes([e, f, g, h]));
        // SAFETY: the request for one place, which is free.
        self.0.txbar().write(|w| unsafe { w.bits(1 << place) });
        Ok(None)
    }

    /// The handler receives.
    fn receive(&mut self) -> nb::Result<DataFrame, Self::Error> {
        Err(nb::Error::WouldBlock)
    }
}

#[interrupt]
fn FDCAN1_IT0() {
    received::take(receive);
}

/// The oldest frame that has come.
fn receive() -> Option<Received> {
    // SAFETY: the sending half touches none of these registers after `Bus::start`.
    let can = unsafe { &*pac::FDCAN1::ptr() };
    // Flags are cleared by ones; before the FIFO is looked at, so that no frame is missed.
    let lost = can.ir().read().rf0l().bit_is_set();
    can.ir().write(|w| w.rf0n().set_bit().rf0l().bit(lost));
    let state = can.rxf0s().read();
    if state.f0fl().bits() == 0 {
        return None;
    }
    let place = state.f0gi().bits() & (DEPTH as u8 - 1);
    let at = RECEIVED + FRAME_WORDS * usize::from(place);
    let (first, second) = (get(at), get(at + 1));
    let id = match first & EXTENDED_FRAME != 0 {
        true => ExtendedId::new(first & 0x1FFF_FFFF).map(Id::Extended),
        false => StandardId::new((first >> 18 & 0x7FF) as u16).map(Id::Standard),
    };
    let id = id.filter(|_| first & REMOTE_FRAME == 0);
    let received = Received::new(id, [get(at + 2), get(at + 3)], second >> 16 & 0xF, lost);
    // SAFETY: the place that was just read.
    can.rxf0a().write(|w| unsafe { w.f0ai().bits(place) });
    Some(received)
}
