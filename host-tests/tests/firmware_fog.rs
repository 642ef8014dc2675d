//! The image with everything connected, in QEMU: 30 s of a real drive from an MTi, a fibre-optic
//! gyro that is simulated from the reference, wheel frames over SLCAN. GyroNet and FoGNet both
//! run, and every frame equals the host's.

use embedded_can::{Frame, Id, StandardId};
use gyronet::can::yaw::{FOG_IDS, Quality, RateMessage, Source};
use gyronet::can::{DataFrame, slcan};
use gyronet::sensor::dsp1760::message::{Extra, Message, Validity};
use gyronet::service::{Reply, Request};
use gyronet_host_tests::recordings::{self, Row};
use gyronet_host_tests::{image, qemu, replay};
use gyronet_tools::device::{Device, line::Line};
use std::time::{Duration, Instant};

const LIMIT: Duration = Duration::from_secs(60);
const IMU: usize = 1;
const SLCAN: usize = 2;
const FOG: usize = 3;
const SERVICE: usize = 6;
/// 30 s.
const SAMPLES: usize = 3_000;
/// Messages of the gyro in 10 ms.
const MESSAGES: usize = 10;
/// Frames of one sample of the MTi.
const SET: usize = 6;
/// How TX1 begins when the sensor is silent: no rate, failed.
const SILENT: &[u8] = b"t1748008020FF0080";
/// Samples from one wheel frame to the next.
const WHEELS: usize = 2;

/// What the gyro sends in the 10 ms that end with a row: a tenth of its turn each. It begins with the
/// message that ends with the first row, so that a set of ours always comes with the last message.
fn fog(number: usize, row: &Row) -> Vec<u8> {
    let message = |part: usize| {
        let sequence = ((number * MESSAGES + part) % 128) as u8;
        let angle = (row.reference * 0.01 / MESSAGES as f64) as f32;
        Message {
            rotation: [0.0, 0.0, angle],
            acceleration: [0.0; 3],
            extra: Extra::Temperature(25),
            validity: Validity::ALL,
            sequence,
        }
    };
    let first = if number == 0 { MESSAGES - 1 } else { 0 };
    (first..MESSAGES).flat_map(|part| message(part).emit().to_vec()).collect()
}

/// All wheels at a speed, km/h.
fn wheels(speed: f64) -> DataFrame {
    let code = ((speed + 67.67) * 100.0).round() as u16;
    let id = StandardId::new(0xAA).expect("11 bits");
    DataFrame::new(id, &[code.to_be_bytes(); 4].concat()).expect("eight bytes")
}

/// What comes over a line.
enum Input {
    Wheels(DataFrame),
    Imu(Vec<u8>),
    Fog(Vec<u8>),
}

impl Input {
    fn push(&self, host: &mut replay::Board) {
        match self {
            Self::Wheels(frame) => host.wheel(frame),
            Self::Imu(bytes) => host.push(bytes),
            Self::Fog(bytes) => host.push_fog(bytes),
        }
    }

    fn line(&self) -> (usize, Vec<u8>) {
        match self {
            Self::Wheels(frame) => (SLCAN, slcan::emit(frame).expect("a data frame").to_vec()),
            Self::Imu(bytes) => (IMU, bytes.clone()),
            Self::Fog(bytes) => (FOG, bytes.clone()),
        }
    }
}

/// Frames among lines; the answers to the wheel frames left out.
fn frames(lines: &[Vec<u8>]) -> Vec<Vec<u8>> {
    lines.iter().filter(|line| line.starts_with(b"t")).cloned().collect()
}

#[test]
fn board_with_everything_connected() {
    const NAME: &str = "board_with_everything_connected";
    let Some(path) = recordings::trial(NAME, 11) else { return };
    let Some(elf) = image::coprocessor(NAME, env!("CARGO_TARGET_TMPDIR")) else { return };
    let rows = recordings::rows(&path);
    let mut board = qemu::Board::boot(&elf, SERVICE, &[]);
    let mut host = replay::Board::new();
    let (start, mut answers) = (Instant::now(), 0);
    let mut inputs = Vec::new();
    for (number, row) in rows.iter().take(SAMPLES).enumerate() {
        if number.is_multiple_of(WHEELS) {
            inputs.push(Input::Wheels(wheels(if number < 600 { 0.0 } else { 20.0 })));
        }
        inputs.push(Input::Imu(replay::message(number, row).emit().to_vec()));
        inputs.push(Input::Fog(fog(number, row)));
    }
    for input in &inputs {
        input.push(&mut host);
        let (usart, bytes) = input.line();
        board.send(usart, &bytes, LIMIT);
        answers += usize::from(usart == SLCAN);
        // One after the other, each when the board has taken the one before: which comes first is
        // part of what both must make the same of.
        let awaited = host.lines.len() + answers;
        board.await_sent(SLCAN, LIMIT, |sent| {
            let lines = sent.split_inclusive(|byte| *byte == b'\r');
            let (all, silent) = lines.fold((0, 0), |(all, silent), line| {
                (all + usize::from(line.ends_with(b"\r")), silent + usize::from(line.starts_with(SILENT)))
            });
            all >= awaited + silent * SET
        });
    }
    let sent = frames(&board.lines(SLCAN, b'\r', 0, LIMIT));
    println!("{NAME}: {} frames in {:.1?}", sent.len(), start.elapsed());
    let mut host = replay::Board::following(sent.clone());
    inputs.iter().for_each(|input| input.push(&mut host));
    for (number, (line, expected)) in sent.iter().zip(&host.lines).enumerate() {
        let text = |line: &[u8]| line.escape_ascii().to_string();
        assert_eq!(text(line), text(expected), "frame {number}");
    }
    assert!(sent.len() >= host.lines.len(), "{} of {}", sent.len(), host.lines.len());
    println!("{NAME}: {} sets because the host was busy", host.followed);
    assert!(host.followed < SAMPLES as u64 / 10);
    // Both networks have run.
    let rate = |ids: u16| {
        let id = Id::Standard(StandardId::new(ids).expect("11 bits"));
        let frames = sent.iter().map(|line| slcan::parse::<DataFrame>(line).expect("a frame"));
        let rates = frames.filter(move |frame| frame.id() == id);
        rates.map(|frame| RateMessage::parse(frame.data()).expect("a rate")).collect::<Vec<_>>()
    };
    let of = |rates: &[RateMessage], source| {
        rates.iter().filter(|rate| rate.source == source && rate.quality == Quality::Good).count()
    };
    let (own, fog) = (rate(0x1A0), rate(FOG_IDS[0]));
    let (gyronet, fognet) = (of(&own, Source::GyroNet), of(&fog, Source::FogNet));
    println!(
        "{NAME}: {} sets, {gyronet} by GyroNet; {} of the gyro, {fognet} by FoGNet",
        own.len(),
        fog.len()
    );
    assert!(gyronet >= SAMPLES - 330 && fognet >= SAMPLES - 600, "{gyronet} {fognet}");
    // And nobody was late, nothing was dropped. (The 10 ms of the gyro come at once, not at 921600
    // bit/s: that its line is held meanwhile says nothing.)
    let port = board.serve(SERVICE).to_string();
    let mut device = Device::new(Line::open(&port).expect("the harness listens"), &port);
    let Ok(Reply::Counters(counters)) = device.ask(&Request::Counters) else { panic!("no counters") };
    println!("{NAME}: {counters:?}");
    assert_eq!(counters.fog, *host.fog());
    assert_eq!((counters.pipeline.late, counters.fog.late, counters.lines.overruns), (0, 0, 0));
    assert_eq!((counters.lines.unsent, counters.lines.line_errors), (0, 0));
    assert_eq!((counters.lines.sensor_errors, counters.lines.fog_errors), (0, 0));
}
