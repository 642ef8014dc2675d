//! Frames of the vehicle bus: wheel speeds, and our own messages as a receiver parses them.

use super::{byte, take};
use crate::wire::{data_frame, id11, id29};
use embedded_can::Id;
use gyronet::can::bosch::Message;
use gyronet::can::e2e::{Checker, DataIdMode, P01, P02, P05, Profile};
use gyronet::can::signal::{BitField, ByteOrder};
use gyronet::can::wheel::{ByteSum, Checksum, WheelFrame, WheelReceiver, WheelSettings, WheelSignal};
use gyronet::can::yaw::{AngleMessage, DetailMessage, RateMessage};
use gyronet::sample::Standstill;
use gyronet::units::{Duration, Micros, WheelSpeed};

const ID: Id = id11(0xAA);
const OTHER: Id = id29(0x18FE_BF0B);
const PROFILES: [Profile; 4] = [
    Profile::P01(P01 { data_id: 0x123, mode: DataIdMode::Both }),
    Profile::P02(P02 { data_ids: [7; 16] }),
    Profile::P05(P05 { data_id: 0x1234 }),
    Profile::P01(P01 { data_id: 0x123, mode: DataIdMode::Nibble }),
];

/// Two signed wheel speeds from byte 3 on, with a counter in byte 7's upper half.
fn two_wheels(checksum: Checksum) -> WheelSettings {
    let field = |start, len, signed| {
        BitField::new(start, len, ByteOrder::Intel, signed).expect("a field inside the frame")
    };
    let signal = |start| {
        let invalid = [Some(0x8000), None, None];
        let signal = WheelSignal::new(0, field(start, 16, true), WheelSignal::per_bit_kmh(0.036));
        Some(WheelSignal { invalid, pulses: start == 40, ..signal })
    };
    let counter = Some(field(60, 4, false).into());
    WheelSettings {
        frames: [Some(WheelFrame { id: ID, counter, checksum }), None, None, None],
        signals: [None, None, signal(24), signal(40)],
        timeout: Duration(50_000),
        still_speed: WheelSpeed(655),
        still_for: Duration(200_000),
    }
}

/// Receives wheel frames. The first byte selects the settings; each frame is a byte of time, a byte of kind (which
/// identifier, how long, whether its protection is valid) and eight bytes. No report of the wheels may be older than
/// its limit or contradict the speeds.
pub fn wheels(mut data: &[u8]) {
    let choice = byte(&mut data);
    let sum = |start| ByteSum::new(BitField::new(start, 8, ByteOrder::Intel, false).expect("a byte").into());
    let checksum = match choice % 8 {
        0 => Checksum::J1850 { at: 0 },
        1 => Checksum::Sum(ByteSum { xor: true, ..sum(8) }),
        2 => Checksum::Sum(ByteSum { with_id: true, nibbles: true, ..sum(16) }),
        3..=6 => Checksum::E2e(PROFILES[usize::from(choice % 8 - 3)]),
        _ => Checksum::None,
    };
    let settings = if choice & 0x80 == 0 { two_wheels(checksum) } else { WheelSettings::TOYOTA };
    let mut receiver = WheelReceiver::new(settings).expect("valid settings");
    let mut now = 0;
    while !data.is_empty() {
        now += u64::from(byte(&mut data)) * 1_000;
        let kind = byte(&mut data);
        let mut content = [0; 8];
        let given = take(&mut data, 8);
        content[..given.len()].copy_from_slice(given);
        if let (Checksum::E2e(profile), true) = (checksum, kind & 0x10 != 0) {
            let counter = u16::from(kind >> 5) % profile.counters();
            profile.protect(&mut content, counter as u8).expect("eight bytes and a valid counter");
        }
        let id = if kind & 0x0F == 0x0F { OTHER } else { ID };
        let len = if kind & 0x0F < 8 { usize::from(kind & 0x0F) + 1 } else { 8 };
        let frame = data_frame(id, &content[..len]);
        let judged = receiver.decode(&frame, Micros(now));
        assert_eq!(judged.is_none(), id == OTHER);
        let known = receiver.poll(Micros(now));
        if let Some(Ok(judged)) = judged {
            assert_eq!(known, Some(judged));
        }
        let Some(sample) = known else { continue };
        let slow =
            |speed: Option<WheelSpeed>| speed.is_none_or(|speed| speed.0.abs() <= settings.still_speed.0);
        assert!(sample.standstill != Standstill::Still || sample.speeds.into_iter().all(slow));
        let mut later = receiver;
        assert_eq!(later.poll(Micros(now + settings.timeout.0 + 1)).map(|late| late.speeds), Some([None; 4]));
    }
}

/// Parses blocks of eight bytes and a last short one as every message type, and with the checks of every profile; the
/// first three bytes select a signal's bit field in the block. A parsed message must be emitted as the same bytes.
pub fn messages(mut data: &[u8]) {
    let (start, len, kind) = (byte(&mut data), byte(&mut data), byte(&mut data));
    let order = if kind & 1 == 0 { ByteOrder::Intel } else { ByteOrder::Motorola };
    let field = BitField::new(start, len, order, kind & 2 != 0);
    let mut checkers = PROFILES.map(|profile| Checker::new(profile, kind >> 2));
    for block in data.chunks(8) {
        if let Ok(field) = field
            && let (Some(raw), Some(value)) = (field.raw(block), field.value(block))
        {
            let modulus = 1_i64 << field.bits();
            assert!(i64::from(raw) < modulus && value.rem_euclid(modulus) == i64::from(raw));
        }
        for (checker, profile) in checkers.iter_mut().zip(PROFILES) {
            let _ = checker.check(block);
            let mut own = block.to_vec();
            if profile.protect(&mut own, 1).is_ok() {
                assert_eq!(profile.check(&own), Ok(1));
                let _ = checker.check(&own);
            }
        }
        let behind = |bytes: [u8; 8]| bytes[3..] == block[3..];
        if let Ok(message) = Message::parse(block) {
            assert_eq!(message.emit(), block);
        }
        if let Ok(message) = RateMessage::parse(block) {
            // The three bits above quality are not used yet.
            assert_eq!(message.emit()[3..7], block[3..7]);
            assert!(message.deg_per_sec().is_none_or(f64::is_finite));
        }
        assert!(AngleMessage::parse(block).map_or(true, |message| behind(message.emit())));
        assert!(DetailMessage::parse(block).map_or(true, |message| behind(message.emit())));
    }
}
