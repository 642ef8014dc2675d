//! bxCAN (RM0090 32) at 125, 250, 500 and 1000 kbit/s.
//!
//! Nothing here waits except for the start of initialisation mode, with a limit. A frame that a mailbox could not
//! send within [`STALE_MS`] is aborted, so no stale values are sent when the bus recovers. After bus-off the
//! controller is restarted at growing intervals, so that a broken node does not disturb the bus all the time. From the
//! restart to the return BOFF stays set, for 128 x 11 recessive bits: that is neither bus-off anew nor being on the bus.
#![allow(unsafe_code, reason = "raw register values; each block says why it is sound")]

use super::{pac, timer, wait_until};
use core::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use embedded_can::{ExtendedId, Frame as _, Id, StandardId};
use gyronet::can::DataFrame;
use gyronet::can::bus_off::{FIRST_US, LAST_US};
use gyronet::service::event::CanFault;

/// Clock of the controller: APB1 while the chip runs on its crystal. On the internal oscillator, which may be 8 % wrong,
/// the controller stays off: nodes of a CAN bus may differ by 1.5 % at most.
const CLOCK_HZ: u32 = 42_000_000;
/// The bit rates, of which the clock is a whole number of quanta: 42 MHz / 24, 12, 6, 3 / (1 + 11 + 2).
#[allow(dead_code, reason = "bringup keeps the default")]
pub const BIT_RATES: [u32; 4] = [125_000, 250_000, 500_000, 1_000_000];
const DEFAULT_BIT_RATE: u32 = 500_000;
/// Age at which a frame that waits for the bus is dropped, ms.
pub const STALE_MS: u32 = 20;
/// Quanta before and after the sample point, besides the one that synchronises: sampled at 12 of 14, 85.7 %.
const SEGMENTS: [u8; 2] = [11, 2];
const QUANTA: u32 = 1 + SEGMENTS[0] as u32 + SEGMENTS[1] as u32;
const _: () = {
    let mut rates: &[u32] = &BIT_RATES;
    while let [rate, rest @ ..] = rates {
        assert!(CLOCK_HZ.is_multiple_of(QUANTA * *rate), "every bit has a whole number of clocks");
        rates = rest;
    }
};
/// Polls before a change of mode times out; the controller needs a frame's time at most.
const POLLS: u32 = 10_000;
const MAILBOXES: usize = 3;
/// Bits of TSR: RQCP, TXOK and ABRQ of mailbox 0 (the others are 8 and 16 bits higher), and TME of mailbox 0 (the
/// others follow).
const REQUEST_COMPLETED: u32 = 1;
const TRANSMITTED: u32 = 1 << 1;
const ABORT: u32 = 1 << 7;
const EMPTY: u32 = 1 << 26;
/// Half the time between two polls, us: a restart is at most this far from its time.
const HALF_POLL_US: u32 = 500;

/// Number of frames that left a mailbox unsent. Only the transmit interrupt counts.
static ABORTED: AtomicU32 = AtomicU32::new(0);
/// True once another node has acknowledged a frame.
static ACKNOWLEDGED: AtomicBool = AtomicBool::new(false);
/// The time of a bus-off that the sending half has not seen yet, us; 0 without one.
static OFF_AT: AtomicU32 = AtomicU32::new(0);

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Mode {
    /// The controller sends and acknowledges as a node.
    Normal,
    /// The controller receives only its own frames; the pin stays recessive.
    Loopback,
}

/// The state of error confinement (ISO 11898-1).
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd)]
pub enum State {
    /// Both error counters are below 96.
    Active,
    /// An error counter has reached 96.
    Warning,
    /// An error counter has passed 127: the controller no longer destroys frames.
    Passive,
    /// The controller has taken itself off the bus.
    Off,
}

/// The state of the recovery from bus-off (RM0090 32.7.6).
#[derive(Debug, Clone, Copy)]
enum Recovery {
    /// The controller has been on the bus since a time, ms.
    On { since: u32 },
    /// The controller is in initialisation mode until a time, us.
    Waits { until: u32 },
    /// The controller counts 128 x 11 recessive bits.
    Counts,
}

pub struct Can {
    registers: pac::CAN1,
    /// The time at which each mailbox got its frame, ms.
    requested: [u32; MAILBOXES],
    recovery: Recovery,
    /// From a bus-off to a restart, us: see [`FIRST_US`].
    interval: u32,
}

impl Can {
    /// Initialises the controller, which takes part in the bus from [`Can::join`] on and receives what
    /// [`Can::receive_only`] names.
    ///
    /// # Errors
    /// The change of mode that the controller does not confirm.
    pub fn start(can: pac::CAN1, mode: Mode) -> Result<Self, CanFault> {
        // The controller sleeps after a reset, and must be woken before initialisation (RM0090 32.4).
        can.mcr().modify(|_, w| w.sleep().clear_bit().inrq().set_bit());
        if !wait_until(POLLS, || can.msr().read().slak().bit_is_clear()) {
            return Err(CanFault::Sleeping);
        }
        if !wait_until(POLLS, || can.msr().read().inak().bit_is_set()) {
            return Err(CanFault::NotInitialising);
        }
        let [before, after] = SEGMENTS;
        let loopback = mode == Mode::Loopback;
        // SAFETY: fields hold the value less one (RM0090 32.9.2).
        can.btr().write(|w| unsafe {
            w.brp()
                .bits(prescaler(DEFAULT_BIT_RATE) - 1)
                .ts1()
                .bits(before - 1)
                .ts2()
                .bits(after - 1)
                .sjw()
                .bits(0);
            w.lbkm().bit(loopback).silm().bit(loopback)
        });
        can.ier().write(|w| w.fmpie0().set_bit().tmeie().set_bit().bofie().set_bit().errie().set_bit());
        // Frames leave in the order of their requests.
        can.mcr().modify(|_, w| w.txfp().set_bit());
        let recovery = Recovery::On { since: 0 };
        Ok(Self { registers: can, requested: [0; MAILBOXES], recovery, interval: FIRST_US as u32 })
    }

    /// Sets the bit rate, one of [`BIT_RATES`]. The controller takes it only before [`Can::join`].
    #[allow(dead_code, reason = "bringup keeps the default")]
    pub fn set_bit_rate(&self, bits_per_second: u32) {
        // SAFETY: the field holds the value less one (RM0090 32.9.2).
        self.registers.btr().modify(|_, w| unsafe { w.brp().bits(prescaler(bits_per_second) - 1) });
    }

    /// Receives the frames that agree with one of up to 14 identifiers in the bits of its mask, and nothing else: a filter
    /// bank for each, and no remote frames.
    pub fn receive_only(&self, filters: impl Iterator<Item = (Id, u32)>) {
        let can = &self.registers;
        can.fmr().modify(|_, w| w.finit().set_bit());
        // SAFETY: one bit for each bank that CAN1 has; `take` keeps to them.
        unsafe {
            can.fa1r().write(|w| w.bits(0));
            let mut banks = 0;
            for (k, (bank, (id, mask))) in can.fb_iter().zip(filters).take(14).enumerate() {
                bank.fr1().write(|w| w.bits(word(id)));
                bank.fr2().write(|w| w.bits(compared(id, mask)));
                banks |= 1 << k;
            }
            can.fm1r().write(|w| w.bits(0));
            can.fs1r().write(|w| w.bits(banks));
            can.ffa1r().write(|w| w.bits(0));
            can.fa1r().write(|w| w.bits(banks));
        }
        can.fmr().modify(|_, w| w.finit().clear_bit());
    }

    /// Joins the bus. The controller waits for 11 recessive bits by itself. Called once received frames can be taken:
    /// a receive FIFO holds three.
    pub fn join(&self) {
        self.registers.mcr().modify(|_, w| w.inrq().clear_bit());
    }

    pub fn state(&self) -> State {
        let errors = self.registers.esr().read();
        if errors.boff().bit_is_set() || !matches!(self.recovery, Recovery::On { .. }) {
            State::Off
        } else if errors.epvf().bit_is_set() {
            State::Passive
        } else if errors.ewgf().bit_is_set() {
            State::Warning
        } else {
            State::Active
        }
    }

    /// Returns whether the controller is on the bus, and has been for long.
    pub fn is_on(&self) -> bool {
        let is_on = matches!(self.recovery, Recovery::On { .. }) && self.interval == FIRST_US as u32;
        is_on && OFF_AT.load(Ordering::Relaxed) == 0
    }

    /// Aborts frames that have become stale, and restarts the controller after bus-off. Called every
    /// millisecond unless the controller is on the bus, else with each sample, with the time in milliseconds.
    pub fn poll(&mut self, now: u32) {
        if self.is_on() && all_sent() {
            // No frame is stale.
            return;
        }
        let micros = timer::micros() as u32;
        let is_off = self.registers.esr().read().boff().bit_is_set();
        let off_at = Some(OFF_AT.swap(0, Ordering::Relaxed)).filter(|at| *at != 0);
        self.recovery = match (self.recovery, off_at) {
            (Recovery::On { .. } | Recovery::Counts, Some(at)) => {
                self.abort(|_| true);
                // The controller does nothing in this mode; leaving it starts the recovery.
                self.registers.mcr().modify(|_, w| w.inrq().set_bit());
                let until = at.wrapping_add(self.interval);
                self.interval = (2 * self.interval).min(LAST_US as u32);
                Recovery::Waits { until }
            }
            (Recovery::On { since }, None) => {
                if now.wrapping_sub(since) > LAST_US as u32 / 1_000 {
                    self.interval = FIRST_US as u32;
                }
                self.abort(|requested| now.wrapping_sub(requested) > STALE_MS);
                self.recovery
            }
            (Recovery::Waits { until }, _) => {
                let is_due = micros.wrapping_add(HALF_POLL_US).wrapping_sub(until) as i32 >= 0;
                if is_due && self.registers.msr().read().inak().bit_is_set() {
                    self.join();
                    Recovery::Counts
                } else {
                    self.recovery
                }
            }
            (Recovery::Counts, None) if is_off => self.recovery,
            (Recovery::Counts, None) => Recovery::On { since: now },
        };
    }

    fn abort(&self, chosen: impl Fn(u32) -> bool) {
        let pending = !self.registers.tsr().read().bits();
        let bits = |bits: u32, (k, requested): (usize, &u32)| {
            let chosen = pending & EMPTY << k != 0 && chosen(*requested);
            bits | if chosen { ABORT << (8 * k) } else { 0 }
        };
        let bits = self.requested.iter().enumerate().fold(0, bits);
        if bits != 0 {
            // SAFETY: ones request an abort, zeros change nothing (RM0090 32.9.2).
            // reset value: 0x1C00_0000, read-only bits
            self.registers.tsr().write(|w| unsafe { w.bits(bits) });
        }
    }

    /// Writes a frame to a free mailbox; returns whether there was one. `now` is the time in milliseconds.
    pub fn transmit(&mut self, frame: &DataFrame, now: u32) -> bool {
        let status = self.registers.tsr().read().bits();
        let Some(index) = (0..MAILBOXES).find(|k| status & EMPTY << k != 0) else { return false };
        if let Some(requested) = self.requested.get_mut(index) {
            *requested = now;
        }
        let [a, b, c, d, e, f, g, h] = *frame.padded();
        let mailbox = self.registers.tx(index);
        // SAFETY: an empty mailbox; a length up to 8, any data, an identifier, then the request.
        unsafe {
            mailbox.tdtr().write(|w| w.dlc().bits(frame.dlc() as u8));
            mailbox.tdlr().write(|w| w.bits(u32::from_le_bytes([a, b, c, d])));
            mailbox.tdhr().write(|w| w.bits(u32::from_le_bytes([e, f, g, h])));
            mailbox.tir().write(|w| w.bits(word(frame.id())).txrq().set_bit());
        }
        true
    }
}

const fn prescaler(bits_per_second: u32) -> u16 {
    match (CLOCK_HZ / QUANTA).checked_div(bits_per_second) {
        Some(clocks @ 1..=1024) => clocks as u16,
        _ => 1024,
    }
}

/// Returns an identifier in the layout of mailboxes and filters (RM0090 32.9.3).
fn word(id: Id) -> u32 {
    match id {
        Id::Standard(id) => u32::from(id.as_raw()) << 21,
        Id::Extended(id) => id.as_raw() << 3 | 1 << 2,
    }
}

/// Returns the mask of a filter: these bits of the identifier, its length, and that it is no remote frame.
fn compared(id: Id, mask: u32) -> u32 {
    let bits = match id {
        Id::Standard(_) => mask << 21,
        Id::Extended(_) => mask << 3,
    };
    bits | 1 << 2 | 1 << 1
}

pub fn aborted() -> u32 {
    ABORTED.load(Ordering::Relaxed)
}

#[allow(dead_code, reason = "bringup has no bus")]
pub fn is_acknowledged() -> bool {
    ACKNOWLEDGED.load(Ordering::Relaxed)
}

#[inline]
pub fn all_sent() -> bool {
    // SAFETY: the register is only read.
    let status = unsafe { &*pac::CAN1::ptr() }.tsr().read().bits();
    !status & (EMPTY | EMPTY << 1 | EMPTY << 2) == 0
}

/// Handles the transmit interrupt: clears it and counts frames that were aborted.
pub fn transmitted() {
    // SAFETY: the completion flags belong to this handler.
    let can = unsafe { &*pac::CAN1::ptr() };
    let status = can.tsr().read().bits();
    let mut completed = 0;
    for k in 0..MAILBOXES {
        if status & REQUEST_COMPLETED << (8 * k) != 0 {
            completed |= REQUEST_COMPLETED << (8 * k);
            if status & TRANSMITTED << (8 * k) == 0 {
                ABORTED.store(ABORTED.load(Ordering::Relaxed).saturating_add(1), Ordering::Relaxed);
            } else {
                ACKNOWLEDGED.store(true, Ordering::Relaxed);
            }
        }
    }
    // SAFETY: a one in RQCP clears the flags of its mailbox and the interrupt.
    // reset value: 0x1C00_0000, read-only bits
    can.tsr().write(|w| unsafe { w.bits(completed) });
}

pub fn went_off() {
    OFF_AT.store(timer::micros() as u32 | 1, Ordering::Relaxed);
    // SAFETY: the flag belongs to this handler.
    let can = unsafe { &*pac::CAN1::ptr() };
    // A one clears the flag, zeros change nothing.
    // reset value: 0x0000_0C02, read-only bits
    can.msr().write(|w| w.erri().set_bit());
}

#[derive(Debug)]
pub struct Received {
    /// The frame; `None` for a remote frame.
    pub frame: Option<DataFrame>,
    /// True where at least one frame was lost before it.
    pub lost: bool,
}

/// Takes the oldest received frame. Only the receive interrupt calls this.
pub fn receive() -> Option<Received> {
    // SAFETY: the sending half touches none of these registers after `Can::start`.
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
    let length = mailbox.rdtr().read().dlc().bits();
    let data = (u64::from(words[1]) << 32 | u64::from(words[0])).to_le_bytes();
    let bytes = data.get(..usize::from(length.min(8))).unwrap_or_default();
    let frame = id.filter(|_| head.rtr().bit_is_clear()).and_then(|id| DataFrame::new(id, bytes));
    // Written without reading: ones clear the flags, and FOVR is cleared only if it was seen above.
    can.rfr(0).write(|w| w.fovr().bit(lost).rfom().set_bit());
    Some(Received { frame, lost })
}
