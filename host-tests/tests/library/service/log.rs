//! The log keeps the latest events and counts those that it has dropped.

use super::{IDENTITY, LEVEL, bare, info, observe, sample};
use gyronet::health::{Faults, Status};
use gyronet::sample::Standstill;
use gyronet::service::event::{EventKind, ResetCause, SensorFault};

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
