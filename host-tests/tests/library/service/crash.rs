//! Crashes and faults of the clock in words.

use super::IDENTITY;
use gyronet::service::event::{ClockFault, Crash, CrashKind};

#[test]
fn a_crash_is_told_with_its_place() {
    let crash = IDENTITY.crash.expect("there is one");
    let mut panic = Crash { kind: CrashKind::Panic, place: 12, count: 3, ..crash };
    panic.file[..11].copy_from_slice(b"src/main.rs");
    assert_eq!(panic.to_string(), "panic in line 12 of src/main.rs, 3 since power-on");
    let place = "hard fault at 0x08001234, called from 0x08000101, CFSR ";
    for (status, rest) in [
        (1 << 9, "0x00000200"),
        (1 << 7, "0x00000080, address 0x20000004"),
        (1 << 15, "0x00008000, address 0x20000004"),
    ] {
        let fault = Crash { link: 0x0800_0101, status, address: 0x2000_0004, ..crash };
        assert_eq!(fault.to_string(), format!("{place}{rest}, 1 since power-on"));
    }
}

#[test]
fn a_clock_s_fault_is_told_in_words() {
    let text = |khz| ClockFault::CrystalFrequency { khz }.to_string();
    assert_eq!(text(25_012), "the crystal has 25.012 MHz");
    assert_eq!(text(0), "the crystal's frequency could not be measured");
}
