//! Courses and speeds from CAN: bytes by the documents, and refusals.

use gyronet::can::DataFrame;
use gyronet::can::signal::{BitField, ByteOrder};
use gyronet::heading::{
    Heading, HeadingError, HeadingReceiver, HeadingSettings, HeadingSignal, Received, j1939, nmea2000,
};
use gyronet::units::Micros;
use gyronet_host_tests::wire::{data_frame, id11, id29};

fn frame(id: u32, data: &[u8]) -> DataFrame {
    data_frame(id29(id), data)
}

#[test]
fn nmea_2000_course_and_speed_by_their_bytes() {
    // Any sender and priority; 2.0000 rad, 10.00 m/s.
    for id in [0x09F8_0223, 0x19F8_02FE] {
        let read = nmea2000::course_speed(&frame(id, &[7, 0xFC, 0x20, 0x4E, 0xE8, 0x03, 0xFF, 0xFF]));
        let heading = read.expect("its group").expect("in range");
        assert_eq!((heading.course, heading.speed), (Some(2.0), Some(10.0)));
        assert_eq!((heading.course_sigma, heading.speed_sigma), (None, None));
    }
    let read = |bytes: [u8; 8]| nmea2000::course_speed(&frame(0x09F8_0223, &bytes)).expect("its group");
    assert_eq!(read([0, 0xFC, 0xFF, 0xFF, 0xFE, 0xFF, 0, 0]), Ok(Heading::default()));
    assert_eq!(read([0, 0xFD, 0x5C, 0x3D, 0xE8, 0x03, 0, 0]), Err(HeadingError::Reference(1)));
    let fast = HeadingError::Range { what: "speed", value: 150.01 };
    assert_eq!(read([0, 0xFC, 0, 0, 0x99, 0x3A, 0, 0]), Err(fast));
    assert!(matches!(
        read([0, 0xFC, 0x90, 0xF5, 0, 0, 0, 0]),
        Err(HeadingError::Range { what: "course", .. })
    ));
    let short = nmea2000::course_speed(&frame(0x09F8_0223, &[0; 5]));
    assert_eq!(short, Some(Err(HeadingError::Short(5))));
    assert_eq!(nmea2000::course_speed(&frame(0x09F8_0123, &[0; 8])), None);
}

#[test]
fn latitudes_by_their_bytes() {
    let read = |code: i32| {
        let bytes = [code.to_le_bytes(), (-1_220_000_000_i32).to_le_bytes()].concat();
        nmea2000::latitude(&frame(0x09F8_0123, &bytes)).expect("its group").expect("long enough")
    };
    assert!((read(485_000_000).expect("available") - 48.5).abs() < 1e-5);
    assert_eq!(read(i32::MAX), None);
    let read = |code: u32| j1939::latitude(&frame(0x18FE_F31C, &[code.to_le_bytes(), [0; 4]].concat()));
    assert!((read(2_585_000_000).unwrap().unwrap().expect("available") - 48.5).abs() < 1e-5);
    assert_eq!(read(u32::MAX), Some(Ok(None)));
}

#[test]
fn j1939_direction_and_speed_by_its_bytes() {
    // 90 deg are 11,520 codes, 72 km/h 18,432.
    let read = |bytes: [u8; 8]| j1939::direction_speed(&frame(0x18FE_E81C, &bytes)).expect("its group");
    let heading = read([0x00, 0x2D, 0x00, 0x48, 0xFF, 0xFF, 0xFF, 0xFF]).expect("in range");
    assert!((heading.course.expect("known") - std::f32::consts::FRAC_PI_2).abs() < 1e-6);
    assert!((heading.speed.expect("known") - 20.0).abs() < 1e-5);
    // Errors and "not available" are no values.
    assert_eq!(read([0x00, 0xFE, 0xFF, 0xFF, 0, 0, 0, 0]), Ok(Heading::default()));
    assert!(matches!(read([0x80, 0xB4, 0, 0, 0, 0, 0, 0]), Err(HeadingError::Range { what: "course", .. })));
}

#[test]
fn described_values_may_be_in_frames_of_their_own() {
    let signal = |raw, start, bits, factor| {
        let field = BitField::new(start, bits, ByteOrder::Intel, bits == 16).expect("inside the frame");
        Some(HeadingSignal { id: id11(raw), field, factor, offset: 0.0, invalid: Some((1 << bits) - 1) })
    };
    let settings = HeadingSettings {
        course: signal(0x321, 0, 16, 1e-4),
        course_sigma: signal(0x321, 16, 8, 1e-3),
        speed: signal(0x322, 24, 12, 0.05),
        latitude: signal(0x322, 0, 16, 0.01),
        ..HeadingSettings::NONE
    };
    let mut receiver = HeadingReceiver::new(settings, None);
    let mut read =
        |raw, bytes: &[u8], ms: u64| receiver.decode(&data_frame(id11(raw), bytes), Micros(1_000 * ms));
    // 400 codes; a latitude that is not confirmed.
    assert_eq!(read(0x322, &[0, 0, 0, 0x90, 0x01], 0), Some(Ok(Received::NONE)));
    // -1.0000 rad, 20 mrad.
    let heading =
        |read: Option<Result<Received, HeadingError>>| read.expect("its frame").map(|read| read.heading);
    let fresh = heading(read(0x321, &[0xF0, 0xD8, 20], 1_000)).expect("in range").expect("a course");
    assert!((fresh.course.expect("known") - (std::f32::consts::TAU - 1.0)).abs() < 1e-5);
    assert!((fresh.course_sigma.expect("known") - 0.02).abs() < 1e-6);
    assert!((fresh.speed.expect("known") - 20.0).abs() < 1e-5);
    assert_eq!(fresh.speed_sigma, None);
    let stale = heading(read(0x321, &[0xF0, 0xD8, 20], 2_000)).expect("in range").expect("a course");
    assert_eq!(stale.speed, None);
    // Marked as unknown, it is a message all the same.
    let marked = heading(read(0x321, &[0xFF, 0xFF, 20], 2_100)).expect("in range").expect("a message");
    assert_eq!(marked.course, None);
    assert_eq!(heading(read(0x321, &[0; 2], 2_200)), Err(HeadingError::Short(2)));
    assert_eq!(read(0x323, &[0; 8], 2_300), None);
}

#[test]
fn courses_of_one_sender_are_used_until_it_is_silent() {
    let settings = HeadingSettings { nmea2000: true, j1939: true, ..HeadingSettings::NONE };
    let mut receiver = HeadingReceiver::new(settings, None);
    let mut is_used = |id, ms: u64| {
        let frame = frame(id, &[0, 0xFC, 0x20, 0x4E, 0xE8, 0x03, 0xFF, 0xFF]);
        let read = receiver.decode(&frame, Micros(1_000 * ms)).expect("its group").expect("in range");
        read.heading.is_some()
    };
    assert!(is_used(0x09F8_0223, 0) && !is_used(0x09F8_0224, 100) && !is_used(0x18FE_E824, 4_000));
    assert!(is_used(0x18FE_E824, 5_100) && !is_used(0x09F8_0223, 5_200) && is_used(0x09F8_0224, 5_300));
}
