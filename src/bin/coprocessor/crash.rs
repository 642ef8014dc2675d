//! Keeps the reason for a crash in RAM that a reset does not clear.
//!
//! The HardFault handler first sets the stack pointer to the top of the stack. After an overflow the stack pointer is
//! below the RAM, and the first push of a compiled function would lock up the processor (ARMv7-M, B1.5.15); the
//! watchdog would then reset the chip without a recorded reason.
#![allow(unsafe_code, reason = "memory without a value at the start, and exception handlers")]

use core::arch::naked_asm;
use core::mem::MaybeUninit;
use core::panic::PanicInfo;
use core::ptr::{addr_of_mut, read_volatile, write_volatile};
use cortex_m::peripheral::SCB;
use cortex_m_rt::exception;
use gyronet::service::crash::{Crash, CrashKind, FILE};
use gyronet::service::event::ResetCause;
use gyronet::service::message::FAILED_STARTS;

/// Marks a valid record: after power-on the RAM holds arbitrary bits.
const MAGIC: u32 = 0x4752_4E44;
/// Words of a record: magic, count of crashes, kind (0: none since the last start), place, link, status, address,
/// file, failed starts in a row, check word.
const WORDS: usize = FAILED + 2;
const FAILED: usize = 7 + FILE / 4;
/// Addresses that a stack pointer can hold, and the size of an exception frame in bytes.
const RAM: core::ops::Range<u32> = 0x2000_0000..0x2002_0000;
const FRAME: u32 = 32;

type Words = [u32; WORDS];

#[unsafe(link_section = ".uninit.crash")]
static mut RECORD: MaybeUninit<Words> = MaybeUninit::uninit();

fn check(words: &Words) -> u32 {
    words.iter().take(WORDS - 1).fold(MAGIC, |check, word| check.rotate_left(5) ^ word)
}

fn read() -> Option<Words> {
    // SAFETY: any bits are words. Nothing else uses them: this is before the first interrupt, in idle, or in a handler
    // that ends in a reset.
    let words = unsafe { read_volatile(addr_of_mut!(RECORD).cast::<Words>()) };
    (words[0] == MAGIC && words[WORDS - 1] == check(&words)).then_some(words)
}

fn write(mut words: Words) {
    words[0] = MAGIC;
    words[WORDS - 1] = check(&words);
    // SAFETY: as in `read`.
    unsafe { write_volatile(addr_of_mut!(RECORD).cast::<Words>(), words) };
}

/// Returns the crash that caused this start, if any, and clears it; and the number of starts in a row that have ended in
/// a crash or a reset by the watchdog before [`settled`].
pub fn take(reset: ResetCause) -> (Option<Crash>, u8) {
    let words = read().unwrap_or([0; WORDS]);
    let crash = recorded(&words);
    let has_failed = reset == ResetCause::Watchdog
        || crash.is_some_and(|crash| !matches!(crash.kind, CrashKind::CrystalStopped | CrashKind::SupplyLow));
    let mut rest = [0; WORDS];
    rest[1] = words[1];
    rest[FAILED] = if has_failed { words[FAILED].saturating_add(1) } else { 0 };
    write(rest);
    (crash, rest[FAILED].min(u8::MAX.into()) as u8)
}

/// Notes that the start has not failed. One with the built-in configuration goes on until a tester restarts the board.
pub fn settled() {
    if let Some(mut words) = read().filter(|words| words[FAILED] < u32::from(FAILED_STARTS)) {
        words[FAILED] = 0;
        write(words);
    }
}

fn recorded(words: &Words) -> Option<Crash> {
    let [_, count, kind, place, link, status, address, ..] = *words;
    let kind = match kind {
        0 => return None,
        1 => CrashKind::Panic,
        2 => CrashKind::HardFault,
        3 => CrashKind::CrystalStopped,
        4 => CrashKind::SupplyLow,
        other => CrashKind::Unhandled((other >> 8) as u16),
    };
    let mut file = [0; FILE];
    for (bytes, word) in file.as_chunks_mut::<4>().0.iter_mut().zip(words.iter().skip(7)) {
        *bytes = word.to_le_bytes();
    }
    Some(Crash { kind, place, link, status, address, file, count })
}

fn crash(kind: u32, [place, link, status, address]: [u32; 4], path: &str) -> ! {
    let mut words = [0; WORDS];
    let before = read().unwrap_or(words);
    words[1] = before[1].saturating_add(1);
    words[FAILED] = before[FAILED];
    words[2] = kind;
    words[3] = place;
    words[4] = link;
    words[5] = status;
    words[6] = address;
    let end = path.as_bytes();
    let end = end.get(end.len().saturating_sub(FILE)..).unwrap_or_default();
    for (k, byte) in end.iter().enumerate() {
        if let Some(word) = words.get_mut(7 + k / 4) {
            *word |= u32::from(*byte) << (8 * (k % 4));
        }
    }
    write(words);
    SCB::sys_reset()
}

/// Resets the chip because the supply has fallen; the next start waits until the supply is high enough.
pub fn supply_low() -> ! {
    crash(4, [0; 4], "")
}

#[panic_handler]
fn panic(info: &PanicInfo<'_>) -> ! {
    let (line, file) = info.location().map_or((0, ""), |place| (place.line(), place.file()));
    crash(1, [line, 0, 0, 0], file)
}

/// Handles HardFault: sets the stack pointer to the top of the stack, and passes the old one to [`hard_fault`].
#[unsafe(no_mangle)]
#[unsafe(naked)]
unsafe extern "C" fn HardFault() -> ! {
    naked_asm!(
        "mrs r0, msp",
        "movw r1, #:lower16:_stack_start",
        "movt r1, #:upper16:_stack_start",
        "msr msp, r1",
        "b {handler}",
        handler = sym hard_fault,
    )
}

/// Records the exception frame, if the stack pointer still points into the RAM.
unsafe extern "C" fn hard_fault(stack: u32) -> ! {
    let inside = RAM.contains(&stack) && RAM.end - stack >= FRAME && stack.is_multiple_of(4);
    let word = |k: u32| {
        // SAFETY: inside the RAM, on a word boundary.
        if inside { unsafe { read_volatile((stack + 4 * k) as *const u32) } } else { 0 }
    };
    // SAFETY: the registers are only read.
    let scb = unsafe { &*SCB::PTR };
    let status = scb.cfsr.read();
    // MMARVALID: the address of a memory fault; BFARVALID: of a bus fault.
    let address = if status & 1 << 7 != 0 { scb.mmfar.read() } else { scb.bfar.read() };
    crash(2, [word(6), word(5), status, address], "")
}

/// Handles the NMI, which only the clock security system raises: the crystal has stopped, and the chip runs on the
/// internal oscillator.
#[exception]
unsafe fn NonMaskableInt() -> ! {
    crash(3, [0; 4], "")
}

#[exception]
unsafe fn DefaultHandler(number: i16) -> ! {
    // Exceptions 1 to 15 are -15 to -1 here.
    crash(5 | ((i32::from(number) + 16) as u32) << 8, [0; 4], "")
}
