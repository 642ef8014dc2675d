//! Registers of the STM32F405 (RM0090) that this image touches.
#![allow(unsafe_code, reason = "raw register values and the interrupt mask; each block says why it is sound")]

use crate::crash;
use crate::flash::Flash;
use core::cell::RefCell;
use cortex_m::interrupt::{Mutex, free};
use embedded_io::{ErrorKind, ErrorType, Read, ReadReady, Write, WriteReady};
use gyronet::service::event::ResetCause;
use gyronet::service::message::Identity;
use heapless::Deque;
use stm32f4::stm32f405::{self as pac, Interrupt, NVIC, interrupt, usart1::RegisterBlock};

/// Reset clock over baud rate, rounded (RM0090 30.3.4): 16 MHz / 115200.
const BRR_115200: u16 = 139;
/// 16 MHz / 921600 is 17.36: 2.1 % fast, where half a bit in ten is lost at 5 %.
const BRR_921600: u16 = 17;
/// Polls before a flush gives up: about ten byte times at 115200.
const FLUSH_POLLS: u32 = 10_000;
/// Bytes of a part that may wait: four windows' worth of computing time at 100 samples a second.
const IMU_QUEUE: usize = 2048;
/// Bytes of a host that may wait: a window's worth of wheel frames.
const SLCAN_QUEUE: usize = 512;
/// Bytes of the service line that may wait: a frame, and then the line is held.
const SERVICE_QUEUE: usize = 512;

static IMU: Mutex<RefCell<Deque<u8, IMU_QUEUE>>> = Mutex::new(RefCell::new(Deque::new()));
static SLCAN: Mutex<RefCell<Deque<u8, SLCAN_QUEUE>>> = Mutex::new(RefCell::new(Deque::new()));
static SERVICE: Mutex<RefCell<Deque<u8, SERVICE_QUEUE>>> = Mutex::new(RefCell::new(Deque::new()));

/// The serial lines, and what the part says of itself.
pub struct Board {
    /// USART1.
    pub imu: Serial<IMU_QUEUE>,
    /// USART2.
    pub slcan: Serial<SLCAN_QUEUE>,
    /// USART6.
    pub service: Serial<SERVICE_QUEUE>,
    /// Known since the start.
    pub identity: Identity,
    /// Its flash controller, where there is one.
    pub flash: Option<Flash>,
}

impl Board {
    /// Takes the peripherals and starts the lines; `None` when they were taken before.
    pub fn new() -> Option<Self> {
        let p = pac::Peripherals::take()?;
        p.RCC.ahb1enr().modify(|_, w| w.gpioaen().enabled().gpiocen().enabled());
        p.RCC.apb1enr().modify(|_, w| w.usart2en().enabled());
        p.RCC.apb2enr().modify(|_, w| w.usart1en().enabled().usart6en().enabled());
        p.GPIOA.moder().modify(|_, w| w.moder2().alternate().moder3().alternate().moder10().alternate());
        p.GPIOA.afrl().modify(|_, w| w.afrl2().af7().afrl3().af7());
        p.GPIOA.afrh().modify(|_, w| w.afrh10().af7());
        p.GPIOC.moder().modify(|_, w| w.moder6().alternate().moder7().alternate());
        p.GPIOC.afrl().modify(|_, w| w.afrl6().af8().afrl7().af8());
        // SAFETY: any 16-bit value is a valid divider; these are the stated baud rates.
        p.USART1.brr().write(|w| unsafe { w.bits(BRR_115200) });
        // SAFETY: as above.
        p.USART2.brr().write(|w| unsafe { w.bits(BRR_921600) });
        // SAFETY: as above.
        p.USART6.brr().write(|w| unsafe { w.bits(BRR_115200) });
        p.USART1.cr1().write(|w| w.ue().enabled().re().enabled().rxneie().enabled());
        p.USART2.cr1().write(|w| w.ue().enabled().te().enabled().re().enabled().rxneie().enabled());
        p.USART6.cr1().write(|w| w.ue().enabled().te().enabled().re().enabled().rxneie().enabled());
        for interrupt in [Interrupt::USART1, Interrupt::USART2, Interrupt::USART6] {
            // SAFETY: the handlers are defined below and share nothing outside their mutexes.
            unsafe { NVIC::unmask(interrupt) };
        }
        Some(Self {
            imu: Serial { registers: pac::USART1::ptr(), received: &IMU, interrupt: Interrupt::USART1 },
            slcan: Serial { registers: pac::USART2::ptr(), received: &SLCAN, interrupt: Interrupt::USART2 },
            service: Serial {
                registers: pac::USART6::ptr(),
                received: &SERVICE,
                interrupt: Interrupt::USART6,
            },
            identity: identity(&p.RCC, &p.DBGMCU),
            flash: Flash::probe(p.FLASH),
        })
    }
}

/// One serial line. Nothing here waits: what is not ready is an error (`TimedOut`).
pub struct Serial<const N: usize> {
    registers: *const RegisterBlock,
    received: &'static Mutex<RefCell<Deque<u8, N>>>,
    interrupt: Interrupt,
}

impl<const N: usize> Serial<N> {
    /// The next received byte.
    pub fn receive(&mut self) -> Option<u8> {
        free(|cs| {
            let byte = self.received.borrow(cs).try_borrow_mut().ok()?.pop_front()?;
            // There is room again: let the line go on.
            // SAFETY: as in `Board::new`; the mask protects no critical section.
            unsafe { NVIC::unmask(self.interrupt) };
            Some(byte)
        })
    }

    fn registers(&self) -> &RegisterBlock {
        // SAFETY: the address of a peripheral that is always there; this is the only writer of
        // the data register, and the handler only reads.
        unsafe { &*self.registers }
    }
}

impl<const N: usize> ErrorType for Serial<N> {
    type Error = ErrorKind;
}

impl<const N: usize> ReadReady for Serial<N> {
    fn read_ready(&mut self) -> Result<bool, ErrorKind> {
        Ok(free(|cs| self.received.borrow(cs).try_borrow().is_ok_and(|queue| !queue.is_empty())))
    }
}

impl<const N: usize> Read for Serial<N> {
    fn read(&mut self, bytes: &mut [u8]) -> Result<usize, ErrorKind> {
        let Some(first) = bytes.first_mut() else { return Ok(0) };
        *first = self.receive().ok_or(ErrorKind::TimedOut)?;
        Ok(1)
    }
}

impl<const N: usize> WriteReady for Serial<N> {
    fn write_ready(&mut self) -> Result<bool, ErrorKind> {
        Ok(self.registers().sr().read().txe().bit_is_set())
    }
}

impl<const N: usize> Write for Serial<N> {
    fn write(&mut self, bytes: &[u8]) -> Result<usize, ErrorKind> {
        let Some(byte) = bytes.first() else { return Ok(0) };
        if !self.write_ready()? {
            return Err(ErrorKind::TimedOut);
        }
        // SAFETY: the data register takes any byte.
        self.registers().dr().write(|w| unsafe { w.bits((*byte).into()) });
        Ok(1)
    }

    fn flush(&mut self) -> Result<(), ErrorKind> {
        let done = |_| self.registers().sr().read().tc().bit_is_set();
        if (0..FLUSH_POLLS).any(done) { Ok(()) } else { Err(ErrorKind::TimedOut) }
    }
}

/// A byte has come. With the queue full it stays in the register and the interrupt is masked
/// until there is room: the line is held up, or the peripheral reports an overrun, and the next
/// frame's checksum and time stamp show the loss. (Masked in the NVIC: the emulated USART keeps
/// its line raised whatever its own enable bit says.)
fn received<const N: usize>(
    registers: *const RegisterBlock,
    queue: &Mutex<RefCell<Deque<u8, N>>>,
    interrupt: Interrupt,
) {
    // SAFETY: as in `Serial::registers`.
    let registers = unsafe { &*registers };
    free(|cs| {
        // Nobody else holds it: everybody does so with interrupts off.
        let Ok(mut queue) = queue.borrow(cs).try_borrow_mut() else { return };
        if queue.is_full() {
            NVIC::mask(interrupt);
        } else {
            // Status before data: an overrun would else keep the interrupt raised.
            let _ = registers.sr().read();
            let _ = queue.push_back(registers.dr().read().dr().bits() as u8);
        }
    });
}

#[interrupt]
fn USART1() {
    received(pac::USART1::ptr(), &IMU, Interrupt::USART1);
}

#[interrupt]
fn USART2() {
    received(pac::USART2::ptr(), &SLCAN, Interrupt::USART2);
}

#[interrupt]
fn USART6() {
    received(pac::USART6::ptr(), &SERVICE, Interrupt::USART6);
}

/// The reset clock; nothing has changed it yet.
const CLOCK_HZ: u32 = 16_000_000;

fn identity(rcc: &pac::RCC, dbgmcu: &pac::DBGMCU) -> Identity {
    let id = dbgmcu.idcode().read().bits();
    let number = |text: &str| text.bytes().fold(0, |number: u8, digit| number * 10 + (digit - b'0'));
    let firmware = [
        number(env!("CARGO_PKG_VERSION_MAJOR")),
        number(env!("CARGO_PKG_VERSION_MINOR")),
        number(env!("CARGO_PKG_VERSION_PATCH")),
    ];
    Identity {
        firmware,
        device_id: (id != 0).then_some(id),
        clock_hz: CLOCK_HZ,
        reset: reset_cause(rcc),
        crash: crash::take(),
    }
}

/// Reads the reset flags and clears them for the next time. The pin's is set by every reset, and
/// a brown-out's by power-on, so the most telling one comes first.
fn reset_cause(rcc: &pac::RCC) -> ResetCause {
    let flags = rcc.csr().read();
    let causes = [
        (flags.wdgrstf().bit_is_set() || flags.wwdgrstf().bit_is_set(), ResetCause::Watchdog),
        (flags.sftrstf().bit_is_set(), ResetCause::Software),
        (flags.lpwrrstf().bit_is_set(), ResetCause::LowPower),
        (flags.porrstf().bit_is_set(), ResetCause::PowerOn),
        (flags.borrstf().bit_is_set(), ResetCause::BrownOut),
        (flags.padrstf().bit_is_set(), ResetCause::Pin),
    ];
    rcc.csr().modify(|_, w| w.rmvf().set_bit());
    causes.into_iter().find_map(|(set, cause)| set.then_some(cause)).unwrap_or(ResetCause::Unknown)
}
