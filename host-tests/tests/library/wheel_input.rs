//! Wheel speeds from a vehicle's frames, and standing still decided from them.

use embedded_can::Id;
use gyronet::can::DataFrame;
use gyronet::can::e2e::{DataIdMode, Fault, P01, P05, Profile};
use gyronet::can::signal::{BitField, ByteOrder, OutsideFrame};
use gyronet::can::wheel::{
    ByteSum, Checksum, Code, Parts, WheelConfigError, WheelError, WheelFrame, WheelReceiver, WheelSettings,
    WheelSignal,
};
use gyronet::sample::{Standstill, WheelSample};
use gyronet::units::{Duration, Micros, WheelSpeed};
use gyronet_host_tests::wire::{data_frame, id11, id29};
use proptest::prelude::*;

const MS: u64 = 1000;
const ID: Id = id11(0xAA);
const OTHER: Id = id29(0x18FE_BF0B);

fn intel(start: u8, len: u8) -> BitField {
    BitField::new(start, len, ByteOrder::Intel, false).expect("inside a frame")
}

fn car() -> WheelFrame {
    WheelSettings::TOYOTA.frames[0].expect("one frame")
}

/// Two wheels, little-endian, signed, a counter in byte 6, byte 7 left for a checksum.
fn two_wheels(checksum: Checksum) -> WheelSettings {
    let signal = |start| {
        let field = BitField::new(start, 16, ByteOrder::Intel, true).expect("inside a frame");
        Some(WheelSignal::new(0, field, WheelSignal::per_bit_kmh(0.036)))
    };
    let frame = WheelFrame { id: OTHER, counter: Some(intel(48, 4).into()), checksum };
    WheelSettings { signals: [None, None, signal(16), signal(32)], ..settings(frame) }
}

fn settings(frame: WheelFrame) -> WheelSettings {
    WheelSettings {
        frames: [Some(frame), None, None, None],
        signals: WheelSettings::TOYOTA.signals,
        timeout: Duration(50 * MS),
        still_speed: WheelSpeed(655),
        still_for: Duration(200 * MS),
    }
}

fn at_kmh(kmh: f64) -> DataFrame {
    let [hi, lo] = (((kmh + 67.67) * 100.0).round() as u16).to_be_bytes();
    data_frame(ID, &[hi, lo, hi, lo, hi, lo, hi, lo])
}

fn good(receiver: &mut WheelReceiver, frame: &DataFrame, at: Micros) -> WheelSample {
    receiver.decode(frame, at).expect("a wheel frame").expect("valid")
}

#[test]
fn speeds_are_read_in_metres_per_second() {
    let mut receiver = WheelReceiver::new(settings(car())).expect("checked");
    // 0.01 km/h: 6767 + 3600 for the front right wheel, standstill for the others.
    let sample =
        good(&mut receiver, &data_frame(ID, &[0x28, 0x7F, 0x1A, 0x6F, 0x1A, 0x6F, 0x1A, 0x6F]), Micros(0));
    let [front_left, front_right, ..] = sample.speeds.map(|speed| speed.expect("known").metre_per_sec());
    assert!((front_right - 10.0).abs() < 1e-3, "{front_right}");
    assert!(front_left.abs() < 1e-3, "{front_left}");
    assert_eq!(sample.standstill, Standstill::Moving);
    assert!(receiver.decode(&data_frame(OTHER, &[0; 8]), Micros(0)).is_none(), "not a wheel frame");
}

#[test]
fn standing_still_is_asserted_late_and_dropped_at_once_and_by_silence() {
    let mut receiver = WheelReceiver::new(settings(car())).expect("checked");
    assert_eq!(receiver.poll(Micros(0)), None, "nothing has come");
    let mut now = 0;
    let mut step = |kmh: f64| {
        now += 20 * MS;
        good(&mut receiver, &at_kmh(kmh), Micros(now)).standstill
    };
    assert_eq!(step(5.0), Standstill::Moving);
    for _ in 0..10 {
        assert_eq!(step(0.0), Standstill::Unknown);
    }
    assert_eq!(step(0.0), Standstill::Still);
    assert_eq!(step(-0.03), Standstill::Still);
    assert_eq!(step(0.05), Standstill::Moving);
    (0..10).for_each(|_| assert_eq!(step(0.0), Standstill::Unknown, "it starts again"));
    assert_eq!(step(0.0), Standstill::Still);
    assert_eq!(receiver.poll(Micros(now + 50 * MS)).expect("known").standstill, Standstill::Still);
    let silent = receiver.poll(Micros(now + 51 * MS)).expect("frames have come");
    assert_eq!((silent.standstill, silent.speeds), (Standstill::Unknown, [None; 4]));
    // Also without anyone having asked in between.
    for gap in [400, 9_000] {
        let sample = good(&mut receiver, &at_kmh(0.0), Micros(now + gap * MS));
        assert_eq!(sample.standstill, Standstill::Unknown);
    }
    // A clock that goes backwards does no harm.
    assert_eq!(receiver.poll(Micros(0)).expect("frames have come").standstill, Standstill::Unknown);
}

/// Before any good frame, and after standing.
#[test]
fn a_wheel_that_says_it_is_at_fault_has_no_speed_and_ends_standing() {
    for frames in [0, 20] {
        let mut receiver = WheelReceiver::new(settings(car())).expect("checked");
        (0..frames).for_each(|k| _ = good(&mut receiver, &at_kmh(0.0), Micros(k * 20 * MS)));
        let faulty = data_frame(ID, &[0x9A, 0x6F, 0x1A, 0x6F, 0x1A, 0x6F, 0x1A, 0x6F]);
        for k in frames..frames + 20 {
            let refused = receiver.decode(&faulty, Micros(k * 20 * MS)).expect("a wheel frame");
            assert_eq!(refused, Err(WheelError::Invalid { wheel: 1 }));
        }
        assert!(receiver.is_invalid());
        let now = Micros((frames + 19) * 20 * MS);
        let sample = receiver.poll(now).expect("intact frames have come");
        assert_eq!(sample.standstill, Standstill::Unknown);
        let slow = sample.speeds.map(|speed| speed.map(|speed| speed.0.abs() < 10));
        assert_eq!(slow, [Some(true), None, Some(true), Some(true)]);
        good(&mut receiver, &at_kmh(0.0), now);
        assert!(!receiver.is_invalid());
    }
}

#[test]
fn wrong_checksums_and_counters_are_refused() {
    let j1850 = |data: &[u8]| gyronet::can::bosch::CRC.checksum(&data[..7]);
    let xor = |data: &[u8]| data[..7].iter().fold(0, |sum, byte| sum ^ byte);
    let sum = |data: &[u8]| data[..7].iter().fold(0u8, |sum, byte| sum.wrapping_add(*byte));
    let kinds = [
        (Checksum::J1850 { at: 7 }, j1850 as fn(&[u8]) -> u8),
        (Checksum::Sum(ByteSum { xor: true, ..ByteSum::new(intel(56, 8).into()) }), xor),
        (Checksum::Sum(ByteSum::new(intel(56, 8).into())), sum),
    ];
    for (checksum, compute) in kinds {
        let mut receiver = WheelReceiver::new(two_wheels(checksum)).expect("checked");
        let mut send = |counter: u8, damage: u8| {
            // -100 and 300 bits of 0.01 m/s.
            let mut data = [0x55, 0xAA, 0x9C, 0xFF, 0x2C, 0x01, counter, 0];
            data[7] = compute(&data);
            data[2] ^= damage;
            receiver.decode(&data_frame(OTHER, &data), Micros(0)).expect("a wheel frame")
        };
        let [.., left, right] = send(0, 0).expect("valid").speeds;
        assert!((left.expect("known").metre_per_sec() + 1.0).abs() < 1e-3);
        assert!((right.expect("known").metre_per_sec() - 3.0).abs() < 1e-3);
        assert_eq!(send(1, 1), Err(WheelError::Checksum));
        assert!(send(2, 0).is_ok());
        assert_eq!(send(2, 0), Err(WheelError::Repeated));
        assert!(send(15, 0).is_ok());
        assert!(send(0, 0).is_ok());
        assert_eq!(receiver.lost(), 1 + 12);
        let short = receiver.decode(&data_frame(OTHER, &[0; 3]), Micros(0)).expect("a wheel frame");
        assert_eq!(short, Err(WheelError::Short(3)));
    }
}

/// Frames with the checksums that opendbc's code computes for them.
#[test]
fn sums_of_other_makers_are_checked() {
    let nibble = ByteSum {
        nibbles: true,
        with_id: true,
        negated: true,
        start: 8,
        ..ByteSum::new(intel(56, 4).into())
    };
    let parts = |low, high| Parts { low: intel(low, 2), high: Some(intel(high, 2)) };
    let split = ByteSum { without_counter: true, last: 9, ..ByteSum::new(parts(46, 62)) };
    let with_id = |start| ByteSum { with_id: true, ..ByteSum::new(intel(start, 8).into()) };
    let cases = [
        ("Honda", 0x1D0, nibble, Some(intel(60, 2).into()), 0x1234_5678_9ABC_DE2F_u64, 2),
        ("Subaru", 0x13A, with_id(0), None, 0x9134_5678_9ABC_DE20, 0),
        ("Toyota", 0xAA, ByteSum { with_length: true, ..with_id(56) }, None, 0x1234_5678_9ABC_DEFA, 0),
        ("Hyundai", 0x386, split, Some(parts(14, 30)), 0x12B4_5678_9A7C_DE20, 6),
    ];
    for (maker, id, sum, counter, data, count) in cases {
        let frame = WheelFrame { id: id11(id), counter, checksum: Checksum::Sum(sum) };
        assert_eq!(frame.check(&data.to_be_bytes()), Ok(counter.map(|_| count)), "{maker}");
        // Four bits of a sum of bytes see the lower half of each.
        for bit in (0..64).filter(|bit| !sum.without_counter || bit % 8 < 4) {
            let damaged = (data ^ 1 << bit).to_be_bytes();
            assert_eq!(frame.check(&damaged), Err(WheelError::Checksum), "{maker}, bit {bit}");
        }
    }
}

#[test]
fn codes_ranges_and_directions_are_what_the_settings_say() {
    let code = |start, value| Some(Code { field: intel(start, 2), value });
    let signal = |start| {
        let kmh = |kmh: f64| WheelSpeed((kmh / 3.6 * 65_536.0) as i32);
        Some(WheelSignal {
            invalid: [Some(0xFFFF), Some(0xFFFE), None],
            range: Some([kmh(-20.0), kmh(300.0)]),
            valid_when: code(56, 1),
            reverse_when: code(58, 2),
            ..WheelSignal::new(0, intel(start, 16), WheelSignal::per_bit_kmh(0.01))
        })
    };
    let plain = WheelFrame { id: ID, counter: None, checksum: Checksum::None };
    let signals = [None, None, signal(0), signal(16)];
    let mut receiver = WheelReceiver::new(WheelSettings { signals, ..settings(plain) }).expect("checked");
    let mut read = |raw: u16, says: u8| {
        let [lo, hi] = raw.to_le_bytes();
        let sample = receiver
            .decode(&data_frame(ID, &[lo, hi, lo, hi, 0, 0, 0, says]), Micros(0))
            .expect("a wheel frame");
        sample.ok().map(|sample| (sample.speeds[2].expect("known").metre_per_sec() * 360.0).round() as i32)
    };
    for (raw, says, expected) in [
        (1_000, 0b0001, Some(1_000)),
        (1_000, 0b1001, Some(-1_000)),
        (1_000, 0b0101, Some(1_000)),
        (1_000, 0b0000, None),
        (1_000, 0b0010, None),
        (30_000, 0b0001, Some(30_000)),
        (30_001, 0b0001, None),
        (2_001, 0b1001, None),
        (0xFFFF, 0b0001, None),
        (0xFFFE, 0b0001, None),
    ] {
        assert_eq!(read(raw, says), expected, "{raw} {says:04b}");
    }
}

/// Pulses of 20 mm that wrap after 256, in frames of 10 ms.
#[test]
fn pulses_become_speeds_and_standstill() {
    let metre = 4_294_967_296.0;
    let signal = |start| {
        Some(WheelSignal { pulses: true, ..WheelSignal::new(0, intel(start, 8), (0.02 * metre) as i32) })
    };
    let plain = WheelFrame { id: ID, counter: None, checksum: Checksum::None };
    let settings = WheelSettings { signals: [None, None, signal(0), signal(8)], ..settings(plain) };
    let mut receiver = WheelReceiver::new(settings).expect("checked");
    let mut way = 250.0 * 0.02;
    let mut drive = |speed: f64, from: u64| {
        (from..from + 200)
            .map(|k| {
                way += speed * 0.01;
                let raw = (way / 0.02) as u64 as u8;
                good(&mut receiver, &data_frame(ID, &[raw, raw]), Micros(k * 10 * MS))
            })
            .last()
            .expect("frames")
    };
    assert!((drive(20.0, 0).speeds[2].expect("known").metre_per_sec() - 20.0).abs() < 0.25);
    assert_eq!(drive(0.0, 200).standstill, Standstill::Still);
    assert_eq!(drive(0.3, 400).standstill, Standstill::Moving);
    // A counter that starts again is no speed: 200 pulses in 100 ms are 40 m/s, 255 in 10 ms never happen.
    assert!(drive(-0.0, 600).speeds[2].expect("known").metre_per_sec().abs() < 0.25);
}

#[test]
fn e2e_protected_frames_are_checked() {
    let profile = Profile::P01(P01 { data_id: 0x321, mode: DataIdMode::Nibble });
    let two_wheels = two_wheels(Checksum::E2e(profile));
    let frames = two_wheels.frames.map(|frame| frame.map(|frame| WheelFrame { counter: None, ..frame }));
    let mut receiver = WheelReceiver::new(WheelSettings { frames, ..two_wheels }).expect("checked");
    let mut data = [0; 8];
    profile.protect(&mut data, 3).expect("eight bytes");
    assert!(receiver.decode(&data_frame(OTHER, &data), Micros(0)).expect("a wheel frame").is_ok());
    let again = receiver.decode(&data_frame(OTHER, &data), Micros(0)).expect("a wheel frame");
    assert_eq!(again, Err(WheelError::Repeated));
    data[5] ^= 4;
    let damaged = receiver.decode(&data_frame(OTHER, &data), Micros(0)).expect("a wheel frame");
    assert!(matches!(damaged, Err(WheelError::E2e(Fault::Crc { .. }))));
}

#[test]
fn settings_that_cannot_be_are_refused() {
    let refused = |frame| WheelReceiver::new(settings(frame)).expect_err("refused");
    let [first, second, third, _] = settings(car()).signals;
    let with =
        |signals| WheelReceiver::new(WheelSettings { signals, ..settings(car()) }).expect_err("refused");
    assert_eq!(with([first, None, None, None]), WheelConfigError::Wheels(1));
    assert_eq!(with([first, second, third, None]), WheelConfigError::Wheels(3));
    assert_eq!(with([None; 4]), WheelConfigError::Wheels(0));
    assert_eq!(with([first, first, None, None]), WheelConfigError::Overlap(0xAA));
    for frame in [1, 4] {
        let elsewhere = second.map(|signal| WheelSignal { frame, ..signal });
        assert_eq!(with([first, elsewhere, None, None]), WheelConfigError::Wheel(1));
    }
    let counter = Some(intel(0, 9).into());
    assert_eq!(refused(WheelFrame { counter, ..car() }), WheelConfigError::Counter(9));
    let checksum = Checksum::Sum(ByteSum::new(intel(0, 9).into()));
    assert_eq!(refused(WheelFrame { checksum, ..car() }), WheelConfigError::Counter(9));
    let range = Some([WheelSpeed(1), WheelSpeed(0)]);
    let empty = first.map(|signal| WheelSignal { range, ..signal });
    assert_eq!(with([empty, second, None, None]), WheelConfigError::Range(0));
    let checksum = Checksum::J1850 { at: 8 };
    assert_eq!(refused(WheelFrame { checksum, ..car() }), WheelConfigError::Checksum(8));
    let twice = WheelSettings { frames: [Some(car()), Some(car()), None, None], ..settings(car()) };
    assert_eq!(WheelReceiver::new(twice).err(), Some(WheelConfigError::DuplicateIdentifier(0xAA)));
    // The counter and the protection lie over a speed.
    let counter = Some(intel(8, 4).into());
    assert_eq!(refused(WheelFrame { counter, ..car() }), WheelConfigError::Overlap(0xAA));
    let checksum = Checksum::Sum(ByteSum::new(intel(56, 8).into()));
    assert_eq!(refused(WheelFrame { checksum, ..car() }), WheelConfigError::Overlap(0xAA));
    let checksum = Checksum::E2e(Profile::P01(P01 { data_id: 1, mode: DataIdMode::Both }));
    assert_eq!(refused(WheelFrame { checksum, ..car() }), WheelConfigError::Overlap(0xAA));
    for checksum in [Checksum::E2e(Profile::P05(P05 { data_id: 1 })), Checksum::J1850 { at: 4 }] {
        let mut over = two_wheels(checksum);
        over.frames[0] = over.frames[0].map(|frame| WheelFrame { counter: None, ..frame });
        let error = WheelReceiver::new(over).err();
        assert!(matches!(error, Some(WheelConfigError::Overlap(_))), "{checksum:?}: {error:?}");
    }
    let flat = first.map(|signal| WheelSignal { factor_q16: 0, ..signal });
    assert_eq!(with([flat, second, None, None]), WheelConfigError::Factor(0));
    let endless = WheelSettings { still_for: Duration(10_000_001), ..settings(car()) };
    assert_eq!(WheelReceiver::new(endless).err(), Some(WheelConfigError::Time(10_000_001)));
    for (start, len) in [(0, 0), (0, 33), (64, 1), (63, 2), (255, 1)] {
        let field = BitField::new(start, len, ByteOrder::Intel, false);
        assert_eq!(field, Err(OutsideFrame { start, len }));
    }
}

/// A value by its definition, bit by bit.
fn by_bits(data: [u8; 8], start: u8, len: u8, order: ByteOrder, signed: bool) -> Option<i64> {
    let mut at = i32::from(start);
    let mut bits = Vec::new();
    for _ in 0..len {
        bits.push(data.get(at as usize / 8)? >> (at % 8) & 1);
        at = match order {
            ByteOrder::Intel => at + 1,
            // Down to bit 0, then on with bit 7 of the next byte.
            ByteOrder::Motorola if at % 8 == 0 => at + 15,
            ByteOrder::Motorola => at - 1,
        };
    }
    if order == ByteOrder::Intel {
        bits.reverse();
    }
    let value = bits.iter().fold(0i64, |value, bit| value << 1 | i64::from(*bit));
    let negative = signed && bits[0] == 1;
    Some(if negative { value - (1 << len) } else { value })
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 4096, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn bit_fields_are_what_a_dbc_file_means(
        data in any::<[u8; 8]>(), start in 0..64_u8, len in 1..=32_u8, motorola in any::<bool>(),
        signed in any::<bool>(), cut in 0..=8_usize,
    ) {
        let order = if motorola { ByteOrder::Motorola } else { ByteOrder::Intel };
        match (BitField::new(start, len, order, signed), by_bits(data, start, len, order, signed)) {
            (Ok(field), Some(value)) => {
                prop_assert_eq!(field.value(&data), Some(value));
                // Cut off, it is read only where it is whole.
                let mut rest = data;
                rest[cut..].fill(0xFF);
                prop_assert!(
                    field.value(&data[..cut]).is_none()
                        || field.value(&data[..cut]) == by_bits(rest, start, len, order, signed)
                );
            }
            (Err(_), None) => {}
            (field, value) => prop_assert!(false, "{field:?} {value:?}"),
        }
    }

    #[test]
    fn a_field_s_mask_is_the_bits_that_its_value_depends_on(
        start in 0u8..64, len in 1u8..=32, motorola: bool, signed: bool, data: [u8; 8], bit in 0usize..64
    ) {
        let order = if motorola { ByteOrder::Motorola } else { ByteOrder::Intel };
        let Ok(field) = BitField::new(start, len, order, signed) else { return Ok(()) };
        let mut changed = data;
        changed[bit / 8] ^= 1 << (bit % 8);
        prop_assert_eq!(field.raw(&changed) != field.raw(&data), field.mask() >> bit & 1 == 1);
        let again = BitField::new(field.start(), field.bits(), field.order(), field.is_signed());
        prop_assert_eq!(again, Ok(field));
    }
}
