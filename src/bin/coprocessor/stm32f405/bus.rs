//! bxCAN (RM0090 32) at 500 kbit/s, on its registers.
//!
//! Nothing here waits but for the acknowledgement of initialisation mode, with a limit. When
//! the bus is off the controller comes back by itself after 128 times 11 recessive bits (ABOM);
//! until then frames wait in their queue, where old ones give way.
#![allow(unsafe_code, reason = "raw register values; each block says why it is sound")]

use crate::received::{self, Received};
use embedded_can::{ExtendedId, Frame as _, Id, StandardId, nb::Can};
use gyronet::can::DataFrame;
use gyronet::can::wheel::WheelSettings;
use stm32f4::stm32f405::{self as pac, interrupt};

/// Polls before the controller is taken for missing; it answers within a frame's time.
const POLLS: u32 = 10_000;
/// What the segments below give.
pub const BITS_PER_SECOND: u32 = 500_000;
/// 42 MHz / 6 / (1 + 11 + 2) = 500 kbit/s, sampled at 86 %.
const PRESCALER: u16 = 6;
const SEGMENTS: [u8; 2] = [11, 2];
const MAILBOXES: usize = 3;

/// The sending half.
pub struct Bus(pac::CAN1);

impl Bus {
    /// Brings the controller up; `None` where there is none.
    pub fn start(can: pac::CAN1, wheels: Option<&WheelSettings>) -> Option<Self> {
        can.mcr().write(|w| w.inrq().set_bit());
        (0..POLLS).any(|_| can.msr().read().inak().bit_is_set()).then_some(())?;
        let [before, after] = SEGMENTS;
        // SAFETY: fields hold the value less one (RM0090 32.9.2).
        can.btr().write(|w| unsafe {
            w.brp().bits(PRESCALER - 1).ts1().bits(before - 1).ts2().bits(after - 1).sjw().bits(0)
        });
        filters(&can, wheels);
        can.ier().write(|w| w.fmpie0().set_bit());
        // Oldest frame first; bus-off ends by itself. The controller joins the bus when it has
        // seen it idle; there is nothing to wait for.
        can.mcr().write(|w| w.abom().set_bit().txfp().set_bit());
        Some(Self(can))
    }

    /// Whether the controller has taken itself off the bus.
    pub fn off(&self) -> bool {
        self.0.esr().read().boff().bit_is_set()
    }
}

/// Wheel frames pass, one bank each (a list of one identifier, twice); nothing else does.
fn filters(can: &pac::CAN1, wheels: Option<&WheelSettings>) {
    let ids = || wheels.into_iter().flat_map(|wheels| wheels.frames.iter().flatten()).map(|frame| frame.id);
    let banks = (1 << ids().count()) - 1;
    can.fmr().modify(|_, w| w.finit().set_bit());
    // SAFETY: one bit for each bank of the 14 that CAN1 has; WheelSettings has four at most.
    unsafe {
        can.fa1r().write(|w| w.bits(0));
        can.fm1r().write(|w| w.bits(banks));
        can.fs1r().write(|w| w.bits(banks));
        can.ffa1r().write(|w| w.bits(0));
        for (bank, id) in can.fb_iter().zip(ids()) {
            bank.fr1().write(|w| w.bits(word(id)));
            bank.fr2().write(|w| w.bits(word(id)));
        }
        can.fa1r().write(|w| w.bits(banks));
    }
    can.fmr().modify(|_, w| w.finit().clear_bit());
}

/// An identifier as mailboxes and filters hold it (RM0090 32.9.3).
fn word(id: Id) -> u32 {
    match id {
        Id::Standard(id) => u32::from(id.as_raw()) << 21,
        Id::Extended(id) => id.as_raw() << 3 | 1 << 2,
    }
}

impl Can for Bus {
    type Frame = DataFrame;
    type Error = embedded_can::ErrorKind;

    fn transmit(&mut self, frame: &DataFrame) -> nb::Result<Option<DataFrame>, Self::Error> {
        let status = self.0.tsr().read();
        let free = [status.tme0().bit_is_set(), status.tme1().bit_is_set(), status.tme2().bit_is_set()];
        let Some(index) = free.iter().position(|free| *free) else { return Err(nb::Error::WouldBlock) };
        let mut data = [0; 8];
        for (byte, from) in data.iter_mut().zip(frame.data()) {
            *byte = *from;
        }
        let [a, b, c, d, e, f, g, h] = data;
        let mailbox = self.0.tx(index % MAILBOXES);
        // SAFETY: an empty mailbox; length up to 8, any data, an identifier, then the request.
        unsafe {
            mailbox.tdtr().write(|w| w.dlc().bits(frame.data().len() as u8));
            mailbox.tdlr().write(|w| w.bits(u32::from_le_bytes([a, b, c, d])));
            mailbox.tdhr().write(|w| w.bits(u32::from_le_bytes([e, f, g, h])));
            mailbox.tir().write(|w| w.bits(word(frame.id())).txrq().set_bit());
        }
        Ok(None)
    }

    /// The handler receives.
    fn receive(&mut self) -> nb::Result<DataFrame, Self::Error> {
        Err(nb::Error::WouldBlock)
    }
}

#[interrupt]
fn CAN1_RX0() {
    received::take(receive);
}

/// The oldest frame that has come.
fn receive() -> Option<Received> {
    // SAFETY: the sending half touches none of these registers after `Bus::start`.
    let can = unsafe { &*pac::CAN1::ptr() };
    let state = can.rfr(0).read();
    if state.fmp().bits() == 0 {
        return None;
    }
    let (mailbox, lost) = (can.rx(0), state.fovr().bit_is_set());
    let head = mailbox.rir().read();
    let id = match head.ide().bit_is_set() {
        true => ExtendedId::new(head.bits() >> 3).map(Id::Extended),
        false => StandardId::new((head.bits() >> 21) as u16).map(Id::Standard),
    };
    let words = [mailbox.rdlr().read().bits(), mailbox.rdhr().read().bits()];
    let length = mailbox.rdtr().read().dlc().bits().into();
    let id = id.filter(|_| head.rtr().bit_is_clear());
    // Written as a whole: the other bits are cleared by ones, and only those that were read.
    can.rfr(0).write(|w| w.fovr().bit(lost).rfom().set_bit());
    Some(Received::new(id, words, length, lost))
}
