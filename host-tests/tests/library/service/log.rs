//! The log keeps the latest events and counts those that it has dropped.

use super::{IDENTITY, LEVEL, bare, info, observe, sample};
use gyronet::health::{Faults, Status};
use gyronet::sample::Standstill;
use gyronet::service::event::{ClockFault, Crash, CrashKind, EventKind, ResetCause, SensorFault};

#[test]
fn sensor_that_does_not_answer_is_noted_once() {
    let mut board = bare();
    let absent = SensorFault::Identity(0xFF);
    for result in [Err(absent), Err(absent), Err(SensorFault::Reset), Err(absent), Ok(()), Ok(())] {
        board.sensor(result);
        assert_eq!(info(&mut board).sensor, result.err());
    }
    let page = board.events(2);
    let kinds: Vec<EventKind> = page.events.iter().map(|event| event.kind).collect();
    let failed = [Some(absent), Some(SensorFault::Reset), Some(absent), None, None];
    assert_eq!(kinds, failed.map(EventKind::Sensor));
}

#[test]
fn the_log_is_bounded_and_reports_what_is_lost() {
    let mut board = bare();
    let first = board.events(0);
    let kinds: Vec<EventKind> = first.events.iter().map(|event| event.kind).collect();
    let crash = IDENTITY.crash.expect("there is one");
    assert_eq!(kinds, [EventKind::Started(ResetCause::Software), EventKind::Crashed(crash)]);
    for k in 0..100 {
        let status = if k % 2 == 0 { Status::Ready } else { Status::Degraded };
        let state = (status, Faults::NONE);
        observe(&mut board, k, Some(&sample(k.into(), LEVEL, 0.0)), state, Standstill::Still);
    }
    let (mut after, mut events, mut lost) = (2, 0, 0);
    loop {
        let page = board.events(after);
        lost += page.lost;
        events += page.events.len() as u32;
        let Some(last) = page.events.last() else { break };
        after = last.number;
    }
    assert_eq!((events, lost, after), (32, 68, 102));
}

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
