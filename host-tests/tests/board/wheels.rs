//! Wheel frames of another maker: from a settings file to the record in the board's flash, and on the bus.

use crate::common::{self, SAMPLE, START, drive, faults, frames};
use crate::service;
use gyronet::can::DataFrame;
use gyronet::health::Faults;
use gyronet_host_tests::wire::{data_frame, id29};
use gyronet_tools::wheels::WheelFile;

const FRAMES: [u32; 2] = [0x18FE_F1FE, 0x18FE_F2FE];

/// The frame of an axle whose wheels turn at this many thirty-seconds of a metre per second.
fn axle(id: u32, code: u16, counter: u8) -> DataFrame {
    let [low, high] = code.to_le_bytes();
    let mut data = [0, low, high, low, high, 0, counter & 0xF, 0];
    data[7] = data.iter().fold(0, |sum, byte| sum ^ byte);
    data_frame(id29(id), &data)
}

/// Two axles in two frames with 29 bits of identifier, little-endian, 1/32 m/s, with a counter in byte 6 and the exclusive
/// or in byte 7.
fn settings() -> gyronet::can::wheel::WheelSettings {
    let mut text = String::new();
    for (id, axle) in FRAMES.iter().zip(["front", "rear"]) {
        text +=
            &format!("[[frame]]\nid = {id}\nextended = true\nchecksum = {{ kind = \"xor\", byte = 7 }}\n");
        text += "counter = { start_bit = 48, bits = 4, order = \"intel\" }\n";
        for (side, start) in [("left", 8), ("right", 24)] {
            text += &format!("[[frame.signal]]\nwheel = \"{axle}-{side}\"\nstart_bit = {start}\nbits = 13\n");
            text += "order = \"intel\"\nfactor_kmh = 0.1125\noffset_kmh = 0\n";
        }
    }
    WheelFile::parse(&text).and_then(|file| file.settings()).expect("settings")
}

#[test]
fn another_maker_s_frames_are_understood_without_a_new_image() {
    let Some(mut board) = common::started() else { return };
    service::on_line(&mut board).set_wheels(&settings()).expect("they are stored");
    service::on_line(&mut board).restart().expect("a response");
    board.run(START);
    let now = board.counts().time;
    common::send(&mut board, &drive(200), now);
    // They stand for a second, then they turn, each frame with its counter.
    for row in 0..200u16 {
        let code = if row < 100 { 0 } else { 320 };
        for id in FRAMES {
            board.can_send(&axle(id, code, row as u8));
        }
        board.run(SAMPLE);
    }
    let known = faults(&frames(&board.can_frames()));
    let without = known.iter().filter(|faults| faults.contains(Faults::WHEELS)).count();
    let stored = known.iter().filter(|faults| faults.contains(Faults::STORED)).count();
    println!("{} sets, {without} without wheels", known.len());
    assert!(known.len() >= 190 && without < 3 && stored == 0, "{without}, {stored} of {}", known.len());
    let counters = common::counters(&mut board);
    assert_eq!((counters.lines.frames_lost, counters.inputs.wheel_errors), (0, 0));
}
