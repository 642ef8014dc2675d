//! Courses and speeds from CAN: bytes by the documents, refusals, and the way back.

use embedded_can::{ExtendedId, Frame, Id, StandardId};
use gyronet::can::DataFrame;
use gyronet::can::signal::{BitField, ByteOrder};
use gyronet::heading::described::{HeadingFrame, Quantity};
use gyronet::heading::{Heading, HeadingError, Position, j1939, nmea2000};
use proptest::prelude::*;

fn frame(id: u32, data: &[u8]) -> DataFrame {
    DataFrame::new(ExtendedId::new(id).expect("29 bits"), data).expect("eight bytes")
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
fn nmea_2000_position_by_its_bytes() {
    let mut bytes = [0; 8];
    bytes[..4].copy_from_slice(&485_000_000_i32.to_le_bytes());
    bytes[4..].copy_from_slice(&(-1_220_000_000_i32).to_le_bytes());
    let read = |bytes: [u8; 8]| nmea2000::position(&frame(0x09F8_0123, &bytes)).expect("its group");
    let position = read(bytes).expect("in range").expect("available");
    assert!((position.latitude_deg - 48.5).abs() < 1e-9 && (position.longitude_deg + 122.0).abs() < 1e-9);
    bytes[..4].copy_from_slice(&i32::MAX.to_le_bytes());
    assert_eq!(read(bytes), Ok(None));
    bytes[..4].copy_from_slice(&900_000_001_i32.to_le_bytes());
    assert!(matches!(read(bytes), Err(HeadingError::Range { what: "latitude", .. })));
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
fn a_described_frame_has_what_its_description_says() {
    let id = Id::Standard(StandardId::new(0x321).expect("11 bits"));
    let quantity = |start, bits, factor| {
        let field = BitField::new(start, bits, ByteOrder::Intel, bits == 16).expect("inside the frame");
        let invalid = Some((1_u64 << bits) as u32 - 1);
        Some(Quantity { field, factor, offset: 0.0, invalid })
    };
    let described = HeadingFrame {
        id,
        course: quantity(0, 16, 1e-4),
        course_sigma: quantity(16, 8, 1e-3),
        speed: quantity(24, 12, 0.05),
        speed_sigma: None,
    };
    let read = |bytes: &[u8]| described.heading(&DataFrame::new(id, bytes).expect("eight bytes"));
    // -1.0000 rad, 20 mrad, 400 codes.
    let heading = read(&[0xF0, 0xD8, 20, 0x90, 0x01]).expect("its frame").expect("in range");
    assert!((heading.course.expect("known") - (std::f32::consts::TAU - 1.0)).abs() < 1e-5);
    assert!((heading.course_sigma.expect("known") - 0.02).abs() < 1e-6);
    assert!((heading.speed.expect("known") - 20.0).abs() < 1e-5);
    assert_eq!(heading.speed_sigma, None);
    assert_eq!(read(&[0xFF, 0xFF, 0xFF, 0xFF, 0xFF]).expect("its frame"), Ok(Heading::default()));
    assert_eq!(read(&[0; 4]), Some(Err(HeadingError::Short(4))));
    assert_eq!(described.heading(&frame(0x321, &[0; 8])), None);
}

proptest! {
    #[test]
    fn what_is_sent_is_read(course in 0.0_f32..6.2, speed in 0.0_f32..60.0, latitude in -90.0..90.0, longitude in -180.0..180.0) {
        let heading = Heading { course: Some(course), speed: Some(speed), ..Heading::default() };
        let near = |read: Heading, course_lsb: f32, speed_lsb: f32| {
            (read.course.unwrap() - course).abs() <= 0.51 * course_lsb
                && (read.speed.unwrap() - speed).abs() <= 0.51 * speed_lsb
        };
        let sent: DataFrame = nmea2000::course_speed_frame(&heading, 1, 0x23).unwrap();
        prop_assert!(near(nmea2000::course_speed(&sent).unwrap().unwrap(), 1e-4, 0.01));
        let sent: DataFrame = j1939::direction_speed_frame(&heading, 0x1C).unwrap();
        prop_assert!(near(j1939::direction_speed(&sent).unwrap().unwrap(), 1.4e-4, 1.1e-3));
        let position = Position { latitude_deg: latitude, longitude_deg: longitude };
        let sent: DataFrame = nmea2000::position_frame(&position, 0x23).unwrap();
        let read = nmea2000::position(&sent).unwrap().unwrap().unwrap();
        prop_assert!((read.latitude_deg - latitude).abs() < 1e-7 && (read.longitude_deg - longitude).abs() < 1e-7);
    }
}
