//! The configuration dialogue with an Xsens MTi: a part that answers, refuses, sleeps, wakes.

use gyronet::sensor::xsens::dialogue::{ATTEMPTS, Action, Dialogue, DialogueError, Step, TIMEOUT, mid};
use gyronet::sensor::xsens::xbus;
use gyronet::units::Micros;

const GO_TO_CONFIG: [u8; 5] = [0xfa, 0xff, 0x30, 0x00, 0xd1];
const GO_TO_CONFIG_ACK: [u8; 5] = [0xfa, 0xff, 0x31, 0x00, 0xd0];
const GO_TO_MEASUREMENT: [u8; 5] = [0xfa, 0xff, 0x10, 0x00, 0xf1];
const GO_TO_MEASUREMENT_ACK: [u8; 5] = [0xfa, 0xff, 0x11, 0x00, 0xf0];
const REQ_DID: [u8; 5] = [0xfa, 0xff, 0x00, 0x00, 0x01];
const WAKE_UP_ACK: [u8; 5] = [0xfa, 0xff, 0x3f, 0x00, 0xc2];
const ERROR_4: [u8; 6] = [0xfa, 0xff, 0x42, 0x01, 0x04, 0xba];
const SET_OUTPUT_CONFIGURATION: [u8; 29] = [
    0xfa, 0xff, 0xc0, 0x18, 0x10, 0x20, 0xff, 0xff, 0x10, 0x60, 0xff, 0xff, 0x40, 0x20, 0x00, 0x64, 0x80,
    0x20, 0x00, 0x64, 0x08, 0x10, 0x00, 0x01, 0xe0, 0x20, 0xff, 0xff, 0xae,
];

fn push(dialogue: &mut Dialogue, bytes: &[u8]) {
    bytes.iter().for_each(|byte| dialogue.receive(*byte));
}

fn frame(mid: u8, data: &[u8]) -> Vec<u8> {
    xbus::emit::<64>(mid, data).expect("short").to_vec()
}

fn sent(dialogue: &mut Dialogue, now: u64) -> Vec<u8> {
    match dialogue.poll(Micros(now)) {
        Ok(Action::Send(bytes)) => bytes.to_vec(),
        other => panic!("{other:?} instead of a frame to send"),
    }
}

/// The acknowledgement of the output configuration with the part's own rates.
fn outputs_ack(acceleration: u16, rate_of_turn: u16) -> Vec<u8> {
    let mut data = SET_OUTPUT_CONFIGURATION[4..28].to_vec();
    data[10..12].copy_from_slice(&acceleration.to_be_bytes());
    data[14..16].copy_from_slice(&rate_of_turn.to_be_bytes());
    frame(mid::SET_OUTPUT_CONFIGURATION + 1, &data)
}

#[test]
fn frames_equal_those_of_the_manual() {
    assert_eq!(Step::GoToConfig.emit()[..], GO_TO_CONFIG);
    assert_eq!(Step::GoToMeasurement.emit()[..], GO_TO_MEASUREMENT);
    assert_eq!(Step::SetOutputConfiguration.emit()[..], SET_OUTPUT_CONFIGURATION);
    assert_eq!(frame(mid::REQ_DID, &[]), REQ_DID);
    assert_eq!(frame(mid::WAKE_UP_ACK, &[]), WAKE_UP_ACK);
    assert_eq!(xbus::parse(&GO_TO_CONFIG_ACK), Some((0x31, &[][..])));
    assert_eq!(xbus::parse(&GO_TO_MEASUREMENT_ACK), Some((0x11, &[][..])));
    assert_eq!(xbus::parse(&ERROR_4), Some((mid::ERROR, &[4][..])));
    assert_eq!(xbus::parse(&ERROR_4[..5]), None);
    assert_eq!(xbus::emit::<300>(0, &[0; 255]), None);
    assert_eq!(xbus::emit::<8>(0, &[0; 4]), None);
}

#[test]
fn a_part_that_answers_is_configured() {
    let mut dialogue = Dialogue::new();
    assert_eq!(sent(&mut dialogue, 0), GO_TO_CONFIG);
    assert_eq!(dialogue.poll(Micros(1)), Ok(Action::Wait));
    // A measurement that was on its way, and a damaged frame.
    push(&mut dialogue, &frame(0x36, &[0x10, 0x20, 2, 0, 1]));
    push(&mut dialogue, &[0xfa, 0xff, 0x31, 0x00, 0xd1]);
    assert_eq!(dialogue.poll(Micros(2)), Ok(Action::Wait));
    push(&mut dialogue, &GO_TO_CONFIG_ACK);
    assert_eq!(sent(&mut dialogue, 3), SET_OUTPUT_CONFIGURATION);
    push(&mut dialogue, &outputs_ack(100, 100));
    assert_eq!(sent(&mut dialogue, 4), GO_TO_MEASUREMENT);
    push(&mut dialogue, &GO_TO_MEASUREMENT_ACK);
    assert_eq!(dialogue.poll(Micros(5)), Ok(Action::Done));
    assert_eq!(dialogue.poll(Micros(u64::MAX)), Ok(Action::Done));
}

#[test]
fn a_silent_part_is_given_up() {
    let mut dialogue = Dialogue::new();
    let mut now = 7;
    for _ in 0..ATTEMPTS {
        assert_eq!(sent(&mut dialogue, now), GO_TO_CONFIG);
        assert_eq!(dialogue.poll(Micros(now + TIMEOUT.0 - 1)), Ok(Action::Wait));
        now += TIMEOUT.0;
    }
    let error = DialogueError::Silent { step: Step::GoToConfig };
    assert_eq!(dialogue.poll(Micros(now)), Err(error));
    push(&mut dialogue, &GO_TO_CONFIG_ACK);
    assert_eq!(dialogue.poll(Micros(now)), Err(error));
    assert_eq!(error.to_string(), "MTi: no answer to GoToConfig after 3 attempts");
}

#[test]
fn a_refusal_is_reported() {
    let mut dialogue = Dialogue::new();
    sent(&mut dialogue, 0);
    push(&mut dialogue, &GO_TO_CONFIG_ACK);
    for now in 1..=u64::from(ATTEMPTS) {
        assert_eq!(sent(&mut dialogue, now), SET_OUTPUT_CONFIGURATION);
        push(&mut dialogue, &ERROR_4);
    }
    let step = Step::SetOutputConfiguration;
    assert_eq!(dialogue.poll(Micros(9)), Err(DialogueError::Refused { step, code: 4 }));
}

#[test]
fn a_part_that_sets_another_rate_is_refused() {
    for (acceleration, rate_of_turn, id, rate) in [(100, 50, 0x8020, 50), (0, 100, 0x4020, 0)] {
        let mut dialogue = Dialogue::new();
        sent(&mut dialogue, 0);
        push(&mut dialogue, &GO_TO_CONFIG_ACK);
        sent(&mut dialogue, 0);
        push(&mut dialogue, &outputs_ack(acceleration, rate_of_turn));
        assert_eq!(dialogue.poll(Micros(0)), Err(DialogueError::Output { id, rate }));
    }
}

#[test]
fn a_part_that_wakes_up_is_configured_again() {
    let mut dialogue = Dialogue::new();
    sent(&mut dialogue, 0);
    push(&mut dialogue, &frame(mid::WAKE_UP, &[]));
    assert_eq!(sent(&mut dialogue, 1), WAKE_UP_ACK);
    assert_eq!(sent(&mut dialogue, 2), SET_OUTPUT_CONFIGURATION);
}

#[test]
fn a_part_that_wakes_up_again_and_again_is_given_up() {
    let mut dialogue = Dialogue::new();
    for now in 0..u64::from(ATTEMPTS) {
        push(&mut dialogue, &frame(mid::WAKE_UP, &[]));
        assert_eq!(sent(&mut dialogue, now), WAKE_UP_ACK);
    }
    push(&mut dialogue, &frame(mid::WAKE_UP, &[]));
    assert_eq!(dialogue.poll(Micros(9)), Err(DialogueError::Restarts));
}
