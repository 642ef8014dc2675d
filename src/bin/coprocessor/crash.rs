//! What is left of a crash: its reason, in RAM that a reset does not clear.
#![allow(unsafe_code, reason = "memory without a value at the start, and exception handlers")]

use core::mem::MaybeUninit;
use core::panic::PanicInfo;
use core::ptr::{addr_of_mut, read_volatile, write_volatile};
use cortex_m::peripheral::SCB;
use cortex_m_rt::{ExceptionFrame, exception};
use gyronet::service::event::{Crash, CrashKind};

/// Says that a record is one. After power-on the RAM holds anything.
const MAGIC: u32 = 0x4752_4E43;

/// Kind (0: none since the last start), place, count, and a check word.
type Words = [u32; 5];

#[unsafe(link_section = ".uninit.crash")]
static mut RECORD: MaybeUninit<Words> = MaybeUninit::uninit();

fn read() -> Option<[u32; 3]> {
    // SAFETY: any bits are words. Nothing else runs: this is before the first interrupt, or the
    // last thing that happens.
    let [magic, kind, place, count, check] = unsafe { read_volatile(addr_of_mut!(RECORD).cast::<Words>()) };
    let good = magic == MAGIC && check == MAGIC ^ kind ^ place.rotate_left(8) ^ count.rotate_left(16);
    good.then_some([kind, place, count])
}

fn write([kind, place, count]: [u32; 3]) {
    let check = MAGIC ^ kind ^ place.rotate_left(8) ^ count.rotate_left(16);
    // SAFETY: as in `read`.
    unsafe { write_volatile(addr_of_mut!(RECORD).cast::<Words>(), [MAGIC, kind, place, count, check]) };
}

/// The crash that led to this start, if one did.
pub fn take() -> Option<Crash> {
    let [kind, place, count] = read()?;
    write([0, 0, count]);
    let kind = match kind {
        0 => return None,
        1 => CrashKind::Panic,
        2 => CrashKind::HardFault,
        other => CrashKind::Unhandled((other >> 2) as u16),
    };
    Some(Crash { kind, place, count })
}

fn crash(kind: u32, place: u32) -> ! {
    let count = read().map_or(0, |[_, _, count]| count);
    write([kind, place, count.saturating_add(1)]);
    SCB::sys_reset()
}

#[panic_handler]
fn panic(info: &PanicInfo<'_>) -> ! {
    crash(1, info.location().map_or(0, core::panic::Location::line))
}

#[exception]
unsafe fn HardFault(frame: &ExceptionFrame) -> ! {
    crash(2, frame.pc())
}

#[exception]
unsafe fn DefaultHandler(number: i16) -> ! {
    // Exceptions 1 to 15 are -15 to -1 here.
    crash(3 | ((i32::from(number) + 16) as u32) << 2, 0)
}
