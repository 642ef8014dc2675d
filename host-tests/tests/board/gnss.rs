//! Courses on the flashed image, from a GNSS receiver on UART4 or from CAN: its frames are the host's with the same courses
//! from CAN. What they teach is in `library::course`.

use crate::common::{self, IMU, MS, SAMPLE, START};
use crate::service;
use gyronet::can::DataFrame;
use gyronet::can::config::{Settings, StatusSettings};
use gyronet::can::status::STATUS_ID;
use gyronet::heading::{Gain, GnssProtocol, GnssSettings, HeadingSettings};
use gyronet::model::{Blob, weights};
use gyronet::store::{Calibration, Configuration, Learned};
use gyronet_host_tests::board::Board;
use gyronet_host_tests::gnss::{Pvt, sentence, sources};
use gyronet_host_tests::replay;
use gyronet_host_tests::stored::Stored;
use gyronet_host_tests::winding::Winding;

const UART4: usize = 4;
const LINE: GnssSettings = GnssSettings { protocol: GnssProtocol::Ubx, baud: 230_400 };
/// Samples from a course to the next.
const STEP: usize = 10;

fn configuration(heading: HeadingSettings) -> Configuration {
    let status = Some(StatusSettings { id: STATUS_ID });
    let can = Settings { status, ..Settings::DEFAULT };
    Configuration { can, heading, ..Configuration::DEFAULT }
}

/// Drives some seconds, the first ones with courses, on the board by its line, or by NMEA 2000 on CAN, and on a host by CAN,
/// both just started; returns the frames of both.
fn drive(
    board: &mut Board,
    host: &mut replay::Board,
    vehicle: &mut Winding,
    [with, without]: [usize; 2],
    is_line: bool,
) -> [Vec<DataFrame>; 2] {
    for step in 0..10 * (with + without) {
        let now = board.counts().time;
        for k in 0..STEP as u32 {
            let sample = replay::message(vehicle.headings.len(), &vehicle.sample());
            board.send_at(IMU, &sample, now + SAMPLE * k);
            host.push(&sample);
        }
        if step < 10 * with && !is_line {
            let course = vehicle.course();
            board.can_send_at(&course, now + SAMPLE * STEP as u32 - 3 * MS);
            host.can(&course);
        } else if step < 10 * with {
            let pvt = vehicle.pvt();
            // It ends 3 ms before the next sample is on its line.
            board.send_at(UART4, &pvt.bytes(), now + SAMPLE * STEP as u32 - 7 * MS);
            pvt.frames().iter().for_each(|frame| host.can(frame));
        }
        board.run(SAMPLE * STEP as u32);
    }
    [common::frames(&board.can_frames()), std::mem::take(&mut host.frames)]
}

fn blob() -> Blob<'static> {
    Blob::new_checked(&weights::DEFAULT.0).expect("it comes with the library")
}

#[test]
fn courses_on_the_bus_are_used_as_on_the_host() {
    let configuration = configuration(HeadingSettings { nmea2000: true, ..HeadingSettings::NONE });
    let Some(mut board) = common::unpowered() else { return };
    Stored::default().record(&configuration).write_to(&mut board);
    board.power_on();
    board.run(START);
    board.can_frames();
    let mut host = replay::Board::new(&configuration, &Learned::NOTHING, blob());
    let [sent, same] = drive(&mut board, &mut host, &mut Winding::new(7), [16, 4], false);
    assert!(sent.len() > common::SET * 1_998 && sent == same[..sent.len()], "{}", sent.len());
    let (.., courses) = service::on_line(&mut board).course().expect("a response");
    let counters = common::counters(&mut board);
    println!("{courses:?}");
    assert!(courses.used > 100, "{courses:?}");
    assert_eq!((counters.lines.frames_lost, counters.inputs.heading_errors), (0, 0));
}

#[test]
fn a_receiver_on_its_line_teaches_what_frames_teach() {
    let Some(mut board) = common::unpowered() else { return };
    board.configure("UART4.baud", LINE.baud);
    let [line, bus] = sources(LINE).map(configuration);
    let of = line.pipeline(&Calibration::NONE, &Learned::NOTHING, blob().crc).gain_of;
    let learned = Learned { gain: Some(Gain { share: 0.007, sigma: 0.001, of }), ..Learned::NOTHING };
    Stored::default().record(&line).record(&learned).write_to(&mut board);
    // The power is cut on the way. The gain of earlier drives is there after it, and the receiver is unplugged later.
    for seconds in [[16, 0], [16, 11]] {
        board.power_cycle(MS, START);
        board.can_frames();
        let mut vehicle = Winding::new(7);
        let mut host = replay::Board::new(&bus, &learned, blob());
        let [sent, same] = drive(&mut board, &mut host, &mut vehicle, seconds, true);
        let samples = 100 * seconds.iter().sum::<usize>();
        println!("{} of {} frames", sent.len(), same.len());
        assert!(sent.len() > common::SET * (samples - 2) && sent == same[..sent.len()], "{}", sent.len());
        let (_, [gain, sigma], courses) = service::on_line(&mut board).course().expect("a response");
        println!("gain {gain} +- {sigma}, {courses:?}");
        assert!(
            (140..=160).contains(&courses.used) && (gain - 0.007).abs() < 0.002 && sigma < 0.002,
            "{gain} {sigma}"
        );
    }
    let silent = |board: &mut Board| {
        let trouble = service::on_line(board).ask(&[0x19, 6, 0xDA, 0x04, 0x87, 1]).expect("a response");
        trouble[4] & 1 == 1
    };
    let counters = common::counters(&mut board);
    assert_eq!((counters.lines.line_errors, counters.inputs.heading_errors), (0, 0));
    assert!(silent(&mut board), "it is unplugged");
    // At another bit rate its bytes are damaged, and damage is no message.
    board.configure("UART4.baud", 38_400);
    board.send(UART4, &Pvt::GOOD.bytes());
    board.run(200 * MS);
    assert!(silent(&mut board) && common::counters(&mut board).lines.line_errors > 10);
    board.configure("UART4.baud", LINE.baud);
    board.send(UART4, &Pvt::GOOD.bytes());
    board.run(200 * MS);
    assert!(!silent(&mut board));
    // RMC: a good one, and a reckoned one, which is counted; then one that the line damages, and the next one.
    let nmea = GnssSettings { protocol: GnssProtocol::Nmea, ..LINE };
    Stored::default().record(&configuration(sources(nmea)[0])).write_to(&mut board);
    board.power_cycle(MS, START);
    let rmc = |mode| {
        sentence(&format!("GNRMC,092633.00,A,4722.61400,N,00832.50200,E,9.438,210.00,170524,,,{mode}"))
    };
    board.send(UART4, &[rmc('A'), rmc('E')].concat());
    board.run(50 * MS);
    board.send(UART4, &rmc('E')[..40]);
    board.run(50 * MS);
    board.configure("UART4.baud", 38_400);
    board.send(UART4, b"x");
    board.run(50 * MS);
    board.configure("UART4.baud", LINE.baud);
    board.send(UART4, &[&rmc('E')[41..], &rmc('E')].concat());
    board.run(50 * MS);
    let (.., courses) = service::on_line(&mut board).course().expect("a response");
    let counters = common::counters(&mut board);
    println!("{courses:?}, {}, {}", counters.lines.line_errors, counters.inputs.heading_errors);
    assert_eq!((courses.refused, counters.inputs.heading_errors), (2, 1));
}
