//! Any bytes: as a stream to an MTi and to the dialogue, and as the data of a message.
#![no_main]

use gyronet::sensor::xsens::dialogue::Dialogue;
use gyronet::sensor::xsens::precision::Precision;
use gyronet::sensor::xsens::{MtData2, Mti, xbus};
use gyronet::units::Micros;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|data: &[u8]| {
    let mut mti = Mti::new();
    let mut dialogue = Dialogue::new();
    for (now, byte) in (0..).zip(data) {
        mti.push(*byte);
        while mti.next_sample().is_some() {}
        dialogue.push(*byte);
        let _ = dialogue.poll(Micros(now * 10_000));
    }
    if let Ok(message) = MtData2::parse(data) {
        // What was read is written and read as the same; NaN is not equal to itself.
        let frame = message.emit_as(Precision::Double);
        let (_, again) = xbus::parse(&frame).expect("a frame of its own");
        let again = MtData2::parse(again).expect("a message of its own");
        assert_eq!(again.emit_as(Precision::Double), frame);
    }
});
