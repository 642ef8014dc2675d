//! `examples/nucleo` with `can.yaw.fd`: one CAN FD frame carries what three classic ones do, and a classic bus is left alone.

use crate::common::{MS, SAMPLE, SET, drive, host, id, logged, read_log, send, times};
use crate::nucleo::boot;
use crate::service::on_bus;
use embedded_can::{Frame, Id};
use gyronet::can::DataFrame;
use gyronet::can::config::YawSettings;
use gyronet::can::fd::FD_ID;
use gyronet::service::event::CanFault;
use gyronet::store::Configuration;
use gyronet_host_tests::board::{Board, Own};
use std::time::Duration;

const YAW_IDS: [u16; 3] = [0x1A0, 0x1A1, 0x1A2];

/// A board that has stored that it sends CAN FD, and has just been switched on.
fn with_fd() -> Option<Board> {
    let mut board = boot(&[])?;
    board.run(200 * MS);
    let mut configuration = Configuration::DEFAULT;
    configuration.can.yaw = configuration.can.yaw.map(|yaw| YawSettings { fd: Some(FD_ID), ..yaw });
    on_bus(&mut board).set_configuration(&configuration).expect("there is no sensor");
    board.power_cycle(MS, Duration::ZERO);
    let _ = board.own_frames();
    Some(board)
}

fn parted(sent: &[Own]) -> Vec<DataFrame> {
    let frame = |id, data: &[u8]| DataFrame::new(id, data).expect("eight bytes");
    let parts = |own: &Own| match own.is_fast {
        true => {
            YAW_IDS.map(id).into_iter().zip(own.data.chunks(8)).map(|(id, data)| frame(id, data)).collect()
        }
        false => vec![frame(id(own.id as u16), &own.data)],
    };
    sent.iter().flat_map(parts).collect()
}

/// cantools reads both with the product's file.
fn decoded(made: &[DataFrame], sent: &[Own]) {
    let mut log = String::new();
    let frames = sent.iter().filter(|own| own.is_fast);
    for (set, own) in made.chunks(SET).zip(frames.clone()) {
        for frame in set.iter().filter(|frame| YAW_IDS.map(id).contains(&frame.id())) {
            let Id::Standard(id) = frame.id() else { panic!("11 bits") };
            log += &logged(Duration::ZERO, id.as_raw(), "#", frame.data());
        }
        log += &logged(Duration::ZERO, FD_ID, "##1", &own.data);
    }
    let Some(text) = read_log("fd_frames.py", &log) else { return };
    assert_eq!(text, format!("{} CAN FD frames", frames.count()));
}

#[test]
#[ignore = "it builds embassy, which takes a minute"]
fn a_nucleo_sends_one_can_fd_frame_with_what_three_carry() {
    const SAMPLES: usize = 450;
    let Some(mut board) = with_fd() else { return };
    let samples = drive(SAMPLES);
    let begin = board.counts().time + 100 * MS;
    send(&mut board, &samples, begin);
    board.run(100 * MS + SAMPLE * SAMPLES as u32);
    let sent = board.own_frames();
    let made = host(&samples);
    assert_eq!(sent.len(), 4 * SAMPLES, "three of Bosch's set, and one");
    assert!(sent.iter().filter(|own| own.is_fast).all(|own| own.id == u32::from(FD_ID)));
    assert!(parted(&sent) == made[..SET * SAMPLES], "in order, and the same");
    decoded(&made, &sent);
    assert_eq!(on_bus(&mut board).counters().expect("a response").lines.unsent, 0);
}

#[test]
#[ignore = "it builds embassy, which takes a minute"]
fn a_nucleo_leaves_a_classic_bus_alone_and_says_why() {
    let Some(mut board) = with_fd() else { return };
    board.configure("FDCAN1.classic", true);
    board.run(Duration::from_secs(7));
    let off = times("bus_off", &board.events());
    println!("off at {off:?}");
    assert_eq!(off.len(), 8);
    let _ = board.own_frames();
    board.run(Duration::from_secs(1));
    let sent = board.own_frames();
    assert!(sent.len() >= 297 && sent.iter().all(|own| !own.is_fast), "{} frames of Bosch's set", sent.len());
    let mut device = on_bus(&mut board);
    assert_eq!(device.info().expect("a response").identity.can_fault, Some(CanFault::Fd));
    let troubles = device.ask(&[0x19, 2, 1]).expect("a response");
    assert!(troubles.windows(3).any(|code| code == [0xDA, 0x01, 0x49]), "{troubles:02x?}");
    // It can be set right over the same bus.
    device.set_configuration(&Configuration::DEFAULT).expect("there is no sensor");
    device.restart().expect("there is no sensor");
    board.run(200 * MS);
    assert_eq!(on_bus(&mut board).info().expect("a response").identity.can_fault, None);
}
