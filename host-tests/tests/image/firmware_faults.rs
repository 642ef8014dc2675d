//! Faults of the sensor, in the emulated image: what the messages report, how soon, and that it ends.
//! Every frame is held against the host's, byte for byte.

use embedded_can::{Frame, Id};
use gyronet::can::bosch::{SignalStatus, TX1_ID, Tx1};
use gyronet::can::yaw::{RATE_NOT_AVAILABLE, RateMessage};
use gyronet::can::{DataFrame, slcan};
use gyronet::health::Quality;
use gyronet::monitor::{HOLD, STUCK_AFTER};
use gyronet_host_tests::noise::Noise;
use gyronet_host_tests::recordings::{self, Row, workspace};
use gyronet_host_tests::{image, qemu, replay};
use std::time::Duration;

const LIMIT: Duration = Duration::from_secs(120);
const IMU: usize = 1;
const SLCAN: usize = 2;
/// A sample makes so many frames.
const SET: usize = 6;
/// The number of samples by which the rate is initialised and corrected by the network.
const READY: usize = 340;
/// MTData2 status: a gyro axis is clipped.
const CLIPPED: u32 = 1 << 11;

fn boot(test: &str) -> Option<qemu::Board> {
    let elf = image::coprocessor(test, env!("CARGO_TARGET_TMPDIR"))?;
    Some(qemu::Board::boot(&elf, SLCAN, &[]))
}

fn rows() -> Vec<Row> {
    recordings::rows(&workspace().join("tools/data/simulated_drive.csv"))
}

fn drive(samples: core::ops::Range<usize>) -> Vec<u8> {
    replay::simulated_drive(samples).concat()
}

/// Returns the status of the rate in each TX1.
fn statuses(lines: &[Vec<u8>]) -> Vec<SignalStatus> {
    let frames = lines.iter().map(|line| slcan::parse::<DataFrame>(line).expect("a frame"));
    let tx1 = frames.filter(|frame| frame.id() == Id::Standard(TX1_ID));
    tx1.map(|frame| Tx1::parse(frame.data()).expect("a good checksum").yaw_rate_status).collect()
}

/// Returns the number of sets without a rate.
fn unusable(lines: &[Vec<u8>]) -> usize {
    statuses(lines).iter().filter(|status| **status == SignalStatus::FAILURE).count()
}

/// The cable is cut after `READY` samples, `garbage` comes over it, and it is back 0.5 s later.
fn cut(test: &str, garbage: &[u8]) {
    let Some(mut board) = boot(test) else { return };
    board.send(IMU, &drive(0..READY), LIMIT);
    board.send(IMU, garbage, LIMIT);
    let _ = board.lines_until(SLCAN, b'\r', LIMIT, |lines| unusable(lines) >= 20);
    board.send(IMU, &drive(READY + 50..READY + 150), LIMIT);
    let all = |lines: &[Vec<u8>]| {
        let silent = unusable(lines);
        lines.len() >= (READY + 100 + silent) * SET
    };
    let lines = board.lines_until(SLCAN, b'\r', LIMIT, all);
    // As many sets without a rate as the board has sent until the cable was back.
    let back = statuses(&lines).iter().rposition(|status| *status == SignalStatus::FAILURE);
    let trailing = statuses(&lines).len() - 1 - back.expect("the sensor was silent");
    let silent = unusable(&lines);
    println!("{test}: {silent} sets without a rate, {trailing} after them");
    let mut host = replay::Board::new();
    host.push(&drive(0..READY));
    host.silence(silent as u64);
    host.push(&drive(READY + 50..READY + 150));
    replay::assert_same(&lines, &host.lines);
    // No number is marked good that is none.
    let sets = &lines[READY * SET..(READY + silent) * SET];
    for line in sets {
        let frame: DataFrame = slcan::parse(line).expect("a frame");
        if let Ok(rate) = RateMessage::parse(frame.data())
            && frame.id() == rate_id()
        {
            assert_eq!((rate.quality, rate.rate), (Quality::Unusable, RATE_NOT_AVAILABLE));
        }
    }
    // And it is good again with the first sample.
    assert!(statuses(&lines)[READY + silent..].iter().all(|status| *status == SignalStatus::OK));
}

fn rate_id() -> Id {
    let yaw = replay::CONFIG.settings().yaw.expect("own messages are configured");
    Id::Standard(embedded_can::StandardId::new(yaw.ids[0]).expect("11 bits"))
}

#[test]
fn a_cut_cable_leaves_no_rate_until_it_is_back() {
    cut("a_cut_cable_leaves_no_rate_until_it_is_back", &[]);
}

#[test]
fn garbage_alone_is_silence() {
    let mut noise = Noise::new(31);
    cut("garbage_alone_is_silence", &(0..2_000).map(|_| noise.byte()).collect::<Vec<u8>>());
}

/// The emulated clock runs on while the host is busy elsewhere, so one of three runs in time will do.
#[test]
fn silence_is_reported_within_30_ms() {
    for _ in 0..3 {
        match silence_in_time() {
            Some(false) => println!("the host was busy, or the image is late"),
            Some(true) | None => return,
        }
    }
    panic!("late three times");
}

/// Returns whether the first set without a rate, and each of the next, came in time; `None` without QEMU.
fn silence_in_time() -> Option<bool> {
    const NAME: &str = "silence_is_reported_within_30_ms";
    let mut board = boot(NAME)?;
    board.send(SLCAN, b"Z1\r", LIMIT);
    let _ = board.lines(SLCAN, b'\r', 1, LIMIT);
    board.send(IMU, &drive(0..READY), LIMIT);
    let stamped = |lines: &[Vec<u8>]| -> Vec<(u16, SignalStatus)> {
        let frames = lines.iter().filter_map(|line| slcan::parse_stamped::<DataFrame>(line).ok());
        let tx1 = frames.filter(|(frame, _)| frame.id() == Id::Standard(TX1_ID));
        tx1.map(|(frame, at)| (at, Tx1::parse(frame.data()).expect("a good checksum").yaw_rate_status))
            .collect()
    };
    let failed = |sets: &[(u16, SignalStatus)]| -> Vec<u16> {
        sets.iter().filter(|(_, status)| *status == SignalStatus::FAILURE).map(|(at, _)| *at).collect()
    };
    let lines = board.lines_until(SLCAN, b'\r', LIMIT, |lines| failed(&stamped(lines)).len() >= 10);
    let sets = stamped(&lines);
    let (last, _) = sets[READY - 1];
    let silent = failed(&sets);
    println!("{NAME}: the last sample at {last} ms, then sets without a rate at {silent:?}");
    assert_eq!(last, (READY as u16 - 1) * 10);
    let first = (25..=30).contains(&(silent[0] - last));
    Some(first && silent.windows(2).all(|pair| (9..=12).contains(&(pair[1] - pair[0]))))
}

#[test]
fn a_stuck_sensor_is_failed_from_the_seventh_equal_sample() {
    let Some(mut board) = boot("a_stuck_sensor_is_failed_from_the_seventh_equal_sample") else { return };
    const STUCK: usize = 40;
    let rows = rows();
    let stuck = (READY..READY + STUCK).flat_map(|number| {
        replay::message(number, &Row { time: rows[number].time, ..rows[READY - 1] }).emit().to_vec()
    });
    let bytes: Vec<u8> = [drive(0..READY), stuck.collect(), drive(READY + STUCK..READY + 100)].concat();
    let expected = replay::lines(&bytes);
    board.send(IMU, &bytes, LIMIT);
    let lines = board.lines(SLCAN, b'\r', expected.len(), LIMIT);
    replay::assert_same(&lines, &expected);
    let first = READY + STUCK_AFTER as usize - 1;
    for (tick, status) in statuses(&expected).iter().enumerate().skip(310) {
        let failed = (first..READY + STUCK).contains(&tick);
        assert_eq!(*status == SignalStatus::FAILURE, failed, "sample {tick}");
    }
}

#[test]
fn a_saturated_sensor_is_failed_until_50_ms_after() {
    let Some(mut board) = boot("a_saturated_sensor_is_failed_until_50_ms_after") else { return };
    const SATURATED: usize = 3;
    let rows = rows();
    let bytes: Vec<u8> = (0..READY + 100)
        .flat_map(|number| {
            let mut message = replay::message(number, &rows[number]);
            if (READY..READY + SATURATED).contains(&number) {
                message.status = Some(CLIPPED);
            }
            message.emit().to_vec()
        })
        .collect();
    let expected = replay::lines(&bytes);
    board.send(IMU, &bytes, LIMIT);
    let lines = board.lines(SLCAN, b'\r', expected.len(), LIMIT);
    replay::assert_same(&lines, &expected);
    for (tick, status) in statuses(&expected).iter().enumerate().skip(310) {
        let failed = (READY..READY + SATURATED + HOLD as usize).contains(&tick);
        assert_eq!(*status == SignalStatus::FAILURE, failed, "sample {tick}");
    }
}
