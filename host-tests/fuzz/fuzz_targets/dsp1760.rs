//! Any bytes: as a stream to the parser and to the dialogue, as a message, and as a message whose checksum is made to fit.
#![no_main]

use gyronet::sensor::crc::CRC_32_MPEG_2;
use gyronet::sensor::dsp1760::command::{Command, Reply};
use gyronet::sensor::dsp1760::dialogue::Dialogue;
use gyronet::sensor::dsp1760::message::Message;
use gyronet::sensor::dsp1760::{Dsp1760, Dsp1760Config};
use gyronet::sensor::serial::Dialogue as _;
use gyronet::units::Micros;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|data: &[u8]| {
    let mut part = Dsp1760::new(Dsp1760Config::DEFAULT);
    let mut dialogue = Dialogue::new(Dsp1760Config::DEFAULT);
    for (now, byte) in (0..).zip(data) {
        part.push(*byte);
        while part.next_sample().is_some() {}
        dialogue.push(*byte);
        let _ = dialogue.poll(Micros(now * 10_000));
    }
    let _ = (Command::parse(data), Reply::parse(data));
    let mut frame = data.to_vec();
    frame.extend(CRC_32_MPEG_2.checksum(data).to_be_bytes());
    for frame in [data, &frame] {
        if let Ok(message) = Message::parse(frame) {
            let again = Message::parse(&message.emit()).expect("a message of its own");
            // By their bytes: NaN is not equal to itself.
            assert_eq!(again.emit(), message.emit());
        }
    }
});
