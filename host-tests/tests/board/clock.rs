//! The clock on the virtual board: a crystal that is missing, wrong, or stops.

use crate::common::{self, SAMPLE, SECOND, SET, SLCAN, START, boot, drive, frames, host, resets, unpowered};
use crate::service;
use gyronet::service::crash::CrashKind;
use gyronet::service::event::{CanFault, ClockFault, ResetCause};
use gyronet_host_tests::board::Board;
use serde_json::Value;
use std::time::Duration;

const CRYSTAL: &str = "RCC.crystal_hz";
/// The start takes longer at 16 MHz: the networks' weights are checked.
const SLOW_START: Duration = Duration::from_secs(2);

fn with_crystal(hz: Value) -> Option<Board> {
    let mut board = unpowered()?;
    board.configure(CRYSTAL, hz);
    board.configure("USART2.baud", 500_000);
    board.power_on();
    Some(board)
}

#[test]
fn no_crystal_and_then_one() {
    let Some(mut board) = with_crystal(Value::Null) else { return };
    let samples = drive(100);
    common::send(&mut board, &samples, SLOW_START);
    board.send_at(SLCAN, b"O\r", SLOW_START - SAMPLE);
    board.run(SLOW_START + SECOND);
    let lines = board.sent(SLCAN).split(|byte| *byte == b'\r').filter(|line| line.starts_with(b"t")).count();
    assert!(lines >= 99 * SET, "{lines} SLCAN lines at 500000 baud");
    assert_eq!(board.can_frames().len(), 0, "16 MHz is not exact enough for CAN");
    let identity = service::info(&mut board).identity;
    assert_eq!((identity.clock_hz, identity.clock_fault), (16_000_000, Some(ClockFault::NoCrystal)));
    assert_eq!(identity.can_fault, Some(CanFault::Clock));
    // The board finds it by itself.
    board.configure(CRYSTAL, 25_000_000);
    board.configure("USART2.baud", 921_600);
    board.run(3 * SECOND);
    assert_eq!(resets(&mut board).iter().filter(|(_, cause)| cause == "software").count(), 1);
    let identity = service::info(&mut board).identity;
    assert_eq!((identity.clock_hz, identity.clock_fault, identity.can_fault), (168_000_000, None, None));
}

/// PRFTEN in FLASH_ACR, by the revision in DBGMCU_IDCODE: A has the device number of the STM32F2.
#[test]
fn revision_a_runs_without_prefetch() {
    for (idcode, prefetch) in [(0x100F_6413_u32, 1), (0x1001_6413, 1), (0x1000_6411, 0), (0x1000_6413, 0)] {
        let Some(mut board) = unpowered() else { return };
        board.configure("DBGMCU.idcode", idcode);
        board.trace("FLASH", true);
        board.power_on();
        board.run(START);
        let events = board.events();
        let mut accesses =
            events.iter().filter(|event| event.number("address") == Some(f64::from(0x4002_3C00)));
        let last = accesses.rfind(|event| event.text("access") == "write").expect("a latency is set");
        let value = last.number("value").expect("a word") as u32;
        assert_eq!((value & 7, value >> 8 & 1), (5, prefetch), "{idcode:x}: {value:x}");
    }
}

#[test]
fn crystal_of_another_frequency() {
    for (hz, khz) in [(16_000_000, 16_000), (8_000_000, 8_000), (20_000_000, 20_000)] {
        let Some(mut board) = with_crystal(hz.into()) else { return };
        board.run(SLOW_START + SECOND);
        assert_eq!(board.can_frames().len(), 0, "{hz} Hz: no frame at a wrong bit rate");
        let identity = service::info(&mut board).identity;
        let Some(ClockFault::CrystalFrequency { khz: measured }) = identity.clock_fault else {
            panic!("{hz} Hz: {:?}", identity.clock_fault)
        };
        assert!(measured.abs_diff(khz) < khz / 50, "{measured} kHz, not {khz}");
        let resets = resets(&mut board);
        assert_eq!(resets.len(), 1, "it is not tried again: {resets:?}");
    }
}

#[test]
fn internal_oscillator_at_the_ends_of_its_tolerance() {
    for percent in [-8.0, 4.5] {
        let Some(mut board) = unpowered() else { return };
        board.configure("RCC.hsi_error_percent", percent);
        board.power_on();
        board.run(START);
        assert_eq!(service::info(&mut board).identity.clock_fault, None, "{percent} %");
    }
}

#[test]
fn crystal_that_stops() {
    let Some(mut board) = boot() else { return };
    let samples = drive(50);
    common::send(&mut board, &samples, START);
    board.run(START + SAMPLE * 50);
    let sent = frames(&board.can_frames());
    assert!(sent[..] == host(&samples)[..sent.len()] && sent.len() >= 49 * SET);
    board.configure("RCC.crystal_stop", true);
    board.run(SLOW_START);
    assert_eq!(board.can_frames().len(), 0, "no frame at a wrong bit rate");
    let identity = service::info(&mut board).identity;
    assert_eq!(identity.crash.map(|crash| (crash.kind, crash.count)), Some((CrashKind::CrystalStopped, 1)));
    assert_eq!((identity.reset, identity.clock_fault), (ResetCause::Software, Some(ClockFault::NoCrystal)));
}

#[test]
fn bootloader_that_leaves_the_pll_on() {
    let Some(mut board) = common::started() else { return };
    common::fall_asleep(&mut board);
    // A jump to the image's start without a reset: everything is still as the image has left it.
    let (reset, _) = board.symbol("Reset");
    board.set_register("primask", 1);
    board.set_register("sp", 0x2000_8000);
    board.set_register("pc", reset);
    board.run(START);
    let samples = drive(20);
    let now = board.run(Duration::ZERO);
    common::send(&mut board, &samples, now);
    board.run(SAMPLE * 20);
    let identity = service::info(&mut board).identity;
    assert_eq!((identity.clock_hz, identity.clock_fault, identity.can_fault), (168_000_000, None, None));
    assert!(board.can_frames().len() >= 19 * SET);
    assert_eq!(resets(&mut board).len(), 1, "power-on alone");
}
