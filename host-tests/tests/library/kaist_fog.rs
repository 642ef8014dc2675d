//! A real DSP-1760, on a car of KAIST Urban: increments through the part's bytes, the parser, the
//! 100 Hz grid and the CAN messages. Wants the recordings.

use gyronet::align::fog_grid::FogGrid;
use gyronet::can::config::{BoschSettings, Config, E2e, Settings};
use gyronet::can::encoder::CanEncoder;
use gyronet::can::yaw::AngleMessage;
use gyronet::can::{DataFrame, yaw};
use gyronet::sensor::dsp1760::Dsp1760;
use gyronet::sensor::dsp1760::message::{Extra, Message, Validity};
use gyronet::units::{Angle, AngularRate, Micros, Yaw};
use gyronet_host_tests::recordings;
use gyronet_host_tests::require::{self, Need};
use gyronet_host_tests::synthetic;

/// Increments at 100 Hz, rad.
fn increments(test: &str) -> Option<Vec<f64>> {
    let path = recordings::folder().join("kaist_fog/fog_delta_yaw_100hz.csv");
    let found = std::fs::read_to_string(&path).map_err(|error| format!("{}: {error}", path.display()));
    let text = require::wants(test, Need::Data, found)?;
    let increment = |line: &str| line.split(',').nth(1).and_then(|field| field.parse().ok());
    Some(text.lines().skip(1).map(|line| increment(line).expect("a number")).collect())
}

/// Messages of the part at 1 kHz: a tenth of each increment, ten times.
fn bytes(increments: &[f64]) -> impl Iterator<Item = (Micros, Vec<u8>)> {
    increments.iter().enumerate().flat_map(|(row, increment)| {
        (0..10).map(move |k| {
            let number = 10 * row + k;
            let message = Message {
                rotation: [0.0, 0.0, (increment / 10.0) as f32],
                acceleration: [0.0; 3],
                extra: Extra::Temperature(25),
                validity: Validity::GYRO,
                sequence: (number % 128) as u8,
            };
            (Micros(1_000 * (number as u64 + 1)), message.emit().to_vec())
        })
    })
}

/// Returns the angle of each step of the grid, as the board finds it.
fn turns(increments: &[f64]) -> Vec<Angle> {
    let mut part = Dsp1760::new();
    let mut grid = FogGrid::new(false);
    let mut turns = Vec::new();
    for (now, message) in bytes(increments) {
        for byte in message {
            part.receive(byte);
            while let Some(sample) = part.next_sample() {
                grid.add(now, sample.expect("intact")).expect("in time");
            }
        }
        while let Some(step) = grid.next_step(now) {
            let [.., yaw] = step.turn.angle;
            turns.push(yaw.expect("the axis is good"));
        }
    }
    turns
}

/// The yaw on CAN is the plain sum of the increments where every correction is off.
#[test]
fn yaw_is_the_plain_sum() {
    let Some(increments) = increments("yaw_is_the_plain_sum") else { return };
    let turns = turns(&increments);
    // The first increment ends on the grid's first step and is not in it whole.
    assert!(increments.len() - turns.len() <= 1, "{} {}", increments.len(), turns.len());
    let mut settings = Settings::DEFAULT;
    settings.bosch = Some(BoschSettings { tx1_only: true });
    let yaw_settings = settings.yaw.as_mut().expect("on by default");
    let [_, angle_id, _] = yaw_settings.ids;
    assert!(matches!(yaw_settings.e2e, E2e::P01 { .. }));
    let mut encoder = CanEncoder::new(Config::new(settings).expect("valid"));

    let (mut angle, mut sent, mut last_code) = (0i64, 0i64, 0i32);
    let (mut plain, mut worst) = (0.0f64, 0.0f64);
    let mut last_yaw = Yaw::default();
    for (tick, (turn, increment)) in turns.iter().zip(&increments).enumerate() {
        angle += turn.0;
        plain += increment;
        // 2^-44 rad in codes of 2^-27 rad/s x 10 ms.
        let codes = (i128::from(angle) * 100) >> (Angle::FRACTION_BITS - AngularRate::FRACTION_BITS);
        let yaw = Yaw(i64::try_from(codes).expect("far below"));
        let rate = AngularRate(i32::try_from(yaw.0 - last_yaw.0).expect("a car's"));
        last_yaw = yaw;
        for frame in encoder.encode(&synthetic::vehicle(tick as u32, rate, yaw)) {
            if frame_id(&frame) != u32::from(angle_id) {
                continue;
            }
            let message = AngleMessage::parse(embedded_can::Frame::data(&frame)).expect("a yaw message");
            assert_eq!(message.faults, yaw::Faults::NONE);
            sent += i64::from(message.yaw.wrapping_sub(last_code));
            last_code = message.yaw;
        }
        let received = sent as f64 * std::f64::consts::TAU / 4_294_967_296.0;
        worst = worst.max((received - plain).abs());
    }
    println!("{} steps, plain sum {plain:.9} rad, worst difference {worst:.2e} rad", turns.len());
    assert!(worst < 1e-6, "{worst}");
}

fn frame_id(frame: &DataFrame) -> u32 {
    match embedded_can::Frame::id(frame) {
        embedded_can::Id::Standard(id) => u32::from(id.as_raw()),
        embedded_can::Id::Extended(id) => id.as_raw(),
    }
}

/// Standing, the gyro reads the Earth's rate at Daejeon, less its own bias: 0.5 deg/h by its data
/// sheet. A car stands where the gyro's spread over 5 s is that of its noise.
#[test]
fn standing_it_reads_the_earth() {
    let Some(increments) = increments("standing_it_reads_the_earth") else { return };
    const DEG_PER_HOUR: f64 = std::f64::consts::PI / 180.0 / 3600.0;
    let turns: Vec<f64> = turns(&increments).iter().map(|angle| angle.rad()).collect();
    let mut rates = Vec::new();
    for window in turns.chunks_exact(500) {
        let mean = window.iter().sum::<f64>() / 500.0;
        let spread = (window.iter().map(|turn| (turn - mean).powi(2)).sum::<f64>() / 500.0).sqrt();
        // 0.012 deg/sqrt(h) is 3.5e-7 rad in 10 ms; a car with its engine running moves a little.
        if spread < 1e-6 {
            rates.push(mean * 100.0);
        }
    }
    assert!(rates.len() >= 20, "{}", rates.len());
    let mean = rates.iter().sum::<f64>() / rates.len() as f64;
    let earth = 15.041 * 36.37f64.to_radians().sin();
    println!("{} windows: {:.3} deg/h, Earth {earth:.3} deg/h", rates.len(), mean / DEG_PER_HOUR);
    assert!((mean / DEG_PER_HOUR - earth).abs() < 0.5);
}
