//! Courses on the bus of the flashed image: what it learns from them, and what is left of it after them.

use crate::common::{self, SAMPLE, START};
use crate::service;
use embedded_can::{Frame, Id};
use gyronet::can::DataFrame;
use gyronet::can::config::{Settings, StatusSettings};
use gyronet::can::status::{Knowledge, STATUS_ID};
use gyronet::can::yaw::AngleMessage;
use gyronet::store::Configuration;
use gyronet_host_tests::board::Board;
use gyronet_host_tests::replay;
use gyronet_host_tests::winding::{BIAS, GAIN, Winding};
use std::time::Duration;

const ANGLE: u16 = 0x1A1;

/// The message set of a car with the slow status, and courses by NMEA 2000.
fn configuration() -> Configuration {
    let status = Some(StatusSettings { id: STATUS_ID });
    let mut configuration =
        Configuration { can: Settings { status, ..Settings::DEFAULT }, ..Configuration::DEFAULT };
    configuration.heading.nmea2000 = true;
    configuration
}

fn content(frame: &DataFrame, id: u16) -> Option<&[u8]> {
    matches!(frame.id(), Id::Standard(own) if own.as_raw() == id).then(|| frame.data())
}

/// Drives for some seconds, with two courses in each if there are any, and returns the frames.
fn drive(board: &mut Board, vehicle: &mut Winding, seconds: usize, has_courses: bool) -> Vec<DataFrame> {
    let mut sent = Vec::new();
    for _ in 0..2 * seconds {
        let now = board.counts().time;
        let samples: Vec<Vec<u8>> =
            (0..50).map(|_| replay::message(vehicle.headings.len(), &vehicle.sample())).collect();
        common::send(board, &samples, now);
        if has_courses {
            board.can_send_at(&vehicle.course(), now + 50 * SAMPLE - Duration::from_millis(3));
        }
        board.run(50 * SAMPLE);
        sent.extend(common::frames(&board.can_frames()));
    }
    sent
}

#[test]
fn courses_on_the_bus_teach_the_bias_and_hold_the_heading() {
    let Some(mut board) = common::boot() else { return };
    board.run(START);
    service::on_line(&mut board).set_configuration(&configuration()).expect("it is stored");
    service::on_line(&mut board).restart().expect("a response");
    board.run(START);
    board.can_frames();
    let mut vehicle = Winding::new(7);
    let learning = drive(&mut board, &mut vehicle, 55, true);
    let statuses: Vec<&[u8]> = learning.iter().filter_map(|frame| content(frame, STATUS_ID)).collect();
    let bias = |status: &[u8]| status[3] >> 4 & 7;
    println!("bias by the second {:?}", statuses.iter().map(|status| bias(status)).collect::<Vec<_>>());
    assert_eq!(bias(statuses[1]), Knowledge::Unknown as u8);
    assert_eq!(bias(statuses[statuses.len() - 1]), Knowledge::Fine as u8);

    let from = vehicle.headings.len();
    let held = drive(&mut board, &mut vehicle, 15, false);
    let yaws = held.iter().filter_map(|frame| content(frame, ANGLE));
    let yaws: Vec<f64> = yaws.map(|data| AngleMessage::parse(data).expect("eight bytes").deg()).collect();
    let turned = (vehicle.headings[vehicle.headings.len() - 1] - vehicle.headings[from]).to_degrees();
    let off = (yaws[yaws.len() - 1] - yaws[0] - turned + 180.0).rem_euclid(360.0) - 180.0;
    // The gain takes twenty minutes to learn.
    let by_gain = GAIN * turned;
    println!(
        "{off:.2} deg in 15 s without courses, {by_gain:.2} of it by the gain; {:.2} by the bias alone",
        BIAS.to_degrees() * 15.0
    );
    assert!(yaws.len() > 1_490 && (off - by_gain).abs() < 0.3, "{} sets, {off} deg, {by_gain}", yaws.len());

    // Another vehicle's courses teach nothing; the gain's state and a trouble say that they contradict the gyro.
    let gain = |frames: &[DataFrame]| {
        let last =
            frames.iter().filter_map(|frame| content(frame, STATUS_ID)).next_back().expect("one a second");
        u16::from_le_bytes([last[3], last[4]]) >> 7 & 7
    };
    assert_ne!(gain(&held), Knowledge::Refused as u16);
    let mut other = Winding::new(8);
    for _ in 0..500 {
        other.sample();
    }
    let mut contradicted = Vec::new();
    for second in 0..17 {
        other.headings.push(other.headings[other.headings.len() - 1] + 1.5 + f64::from(second));
        board.can_send(&other.course());
        contradicted = drive(&mut board, &mut vehicle, 1, false);
    }
    let (state, _, courses) = service::on_line(&mut board).course().expect("a response");
    println!("{courses:?}");
    assert_eq!((gain(&contradicted), state), (Knowledge::Refused as u16, 3));
    assert!(courses.refused >= 10 && courses.restarts >= 1, "{courses:?}");
    let trouble = service::on_line(&mut board).ask(&[0x19, 6, 0xDA, 0x04, 0x62, 1]).expect("a response");
    assert_eq!(trouble[..5], [6, 0xDA, 0x04, 0x62, 0x2F], "present, pending and confirmed");
    let counters = common::counters(&mut board);
    assert_eq!((counters.lines.frames_lost, counters.inputs.heading_errors), (0, 0));
}
