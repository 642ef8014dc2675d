//! An ICM-42688-P, a BMI088 or an ASM330LHH on SPI1, from the stored configuration to the frames on CAN.

use crate::common::{self, MS, SECOND, SLCAN, START, frames, raw};
use crate::service;
use gyronet::can::DataFrame;
use gyronet::can::slcan::parse_stamped;
use gyronet::can::yaw::Quality;
use gyronet::service::event::SensorFault;
use gyronet::service::message::AllCounters;
use gyronet::store::{Configuration, ImuPart, Learned};
use gyronet_host_tests::board::Board;
use gyronet_host_tests::stored::Stored;
use gyronet_host_tests::wire::wheels;
use serde_json::json;
use std::time::Duration;

const RATE: u16 = 0x1A0;
/// The axis of yaw, as the model numbers them.
const Z: u32 = 2;
/// Acceleration of a level part, g.
const LEVEL: [f64; 3] = [0.0, 0.0, 1.0];
/// Events that a driver in order does not cause.
pub const FAULTS: [&str; 14] = [
    "slow_pin",
    "spi_unreadable",
    "mode_fault",
    "overrun",
    "deselected_in_transfer",
    "disabled_in_transfer",
    "changed_in_transfer",
    "sensor_in_reset",
    "sensor_reserved",
    "sensor_write_too_early",
    "sensor_not_spi",
    "sensor_self_test",
    "fifo_partial_read",
    "iwdg_expired",
];

/// A part and what its data sheet says of it.
struct Fitted {
    part: ImuPart,
    model: &'static str,
    /// Bandwidth in hertz to which the image sets its gyro.
    bandwidth: f64,
    /// Deviation of a rate by noise, deg/s, six sigma; share of it with which readings still differ at rest.
    noise: [f64; 2],
    /// Time that its bring-up takes, and its first with a self-test.
    up: [Duration; 2],
    /// Milliseconds by which a step of 10 ms may be late: it is sent with the sample that completes it.
    late: i64,
}

const ICM42688: Fitted = Fitted {
    part: ImuPart::Icm42688,
    model: "Icm42688",
    // A sixteenth of 400 Hz (DS-000347, 5.5).
    bandwidth: 25.0,
    noise: [0.1, 1.0],
    up: [Duration::from_millis(60); 2],
    late: 0,
};

const BMI088: Fitted = Fitted {
    part: ImuPart::Bmi088,
    model: "Bmi088",
    bandwidth: 23.0,
    noise: [0.3, 0.1],
    up: [Duration::from_millis(160), Duration::from_millis(300)],
    late: 0,
};

const ASM330LHH: Fitted = Fitted {
    part: ImuPart::Asm330lhh,
    model: "Asm330lhh",
    bandwidth: 23.1,
    noise: [0.1, 1.0],
    up: [Duration::from_millis(130), Duration::from_millis(380)],
    // A sample comes every 4.8 ms.
    late: 4,
};

/// Makes a test of each function and part, such as `bmi088::NAME`.
macro_rules! for_each_part {
    ($($name:ident)*) => {
        mod icm42688 {
            $(#[test] fn $name() { super::$name(&super::ICM42688) })*
        }
        mod bmi088 {
            $(#[test] fn $name() { super::$name(&super::BMI088) })*
        }
        mod asm330lhh {
            $(#[test] fn $name() { super::$name(&super::ASM330LHH) })*
        }
    };
}

for_each_part! {
    samples_come_at_their_rate_and_on_the_grid
    vibration_above_the_bandwidth_does_not_become_a_turn
    part_that_falls_silent_comes_back
    yaw_is_right_though_the_parts_oscillator_is_one_percent_off
    what_a_standstill_has_shown_corrects_the_next_start_before_it_stands
}

/// A board whose stored configuration names the part; without power.
fn equipped(fitted: &Fitted, configuration: Configuration) -> Option<Board> {
    let mut board = common::unpowered()?;
    board.configure("SPI1.part", fitted.model);
    Stored::default().record(&Configuration { imu: fitted.part, ..configuration }).write_to(&mut board);
    Some(board)
}

fn start(board: &mut Board, fitted: &Fitted) {
    board.power_on();
    board.run(START + fitted.up[1]);
}

/// Rates in deg/s, `None` where there is none, with the time of their frame.
fn rates(board: &mut Board) -> Vec<(Duration, Option<f64>)> {
    let rates = common::rates(&board.can_frames());
    rates.iter().map(|(time, rate)| (*time, rate.deg_per_sec())).collect()
}

fn assert_driven_well(board: &mut Board) {
    let events = board.events();
    let fault = events.iter().find(|event| FAULTS.contains(&event.kind.as_str()));
    assert_eq!(fault, None);
}

/// Runs for whole seconds and checks that each step became a message set and that the time stamps are 10 ms apart, but for what
/// a step may be late. Gives the number of steps in each second.
fn on_the_grid(board: &mut Board, late: i64, seconds: usize) -> Vec<usize> {
    // Time stamps of the samples, ms, modulo a minute.
    board.send(SLCAN, b"Z1\rO\r");
    board.run(30 * MS);
    let _ = (board.sent(SLCAN), board.can_frames());
    let (mut text, mut stamps) = (Vec::new(), Vec::new());
    let per_second = (0..seconds)
        .map(|_| {
            board.run(SECOND);
            text.extend(board.sent(SLCAN));
            rates(board).len()
        })
        .collect();
    for line in text.split(|byte| *byte == b'\r') {
        if let Ok((frame, stamp)) = parse_stamped::<DataFrame>(line)
            && raw(&frame) == RATE
        {
            stamps.push(i64::from(stamp));
        }
    }
    assert!(stamps.len() >= seconds * 99, "{} stamps", stamps.len());
    // By the board's clock, which is read a moment after the part's.
    let steps: Vec<_> = stamps.windows(2).map(|pair| (pair[1] - pair[0]).rem_euclid(60_000)).collect();
    for (k, step) in steps.iter().enumerate() {
        assert!((9..=11 + late).contains(step), "{step} ms after step {k}");
    }
    assert!((steps.iter().sum::<i64>() - 10 * steps.len() as i64).abs() <= 1 + late, "{steps:?}");
    per_second
}

/// Each sample of a part in order is a message set, on the grid, and nothing is counted that should not be.
fn samples_come_at_their_rate_and_on_the_grid(fitted: &Fitted) {
    let Some(mut board) = equipped(fitted, Configuration::DEFAULT) else { return };
    start(&mut board, fitted);
    assert_eq!(service::info(&mut board).sensor, None);
    let per_second = on_the_grid(&mut board, fitted.late, 4);
    assert!(per_second.iter().all(|samples| (99..=101).contains(samples)), "{per_second:?}");
    let AllCounters { pipeline, watch, inputs, .. } = common::counters(&mut board);
    assert_eq!([pipeline.missing, pipeline.misplaced, pipeline.clock_jumps, inputs.imu_errors], [0; 4]);
    assert_eq!([watch.silences, watch.stuck, watch.clock_off], [0; 3]);
    assert_driven_well(&mut board);
}

fn vibration_above_the_bandwidth_does_not_become_a_turn(fitted: &Fitted) {
    /// Amplitude of both tones, deg/s.
    const AMPLITUDE: f64 = 5.0;
    let Some(mut board) = equipped(fitted, Configuration::DEFAULT) else { return };
    board.configure("SPI1.imu_noise", fitted.noise[1]);
    start(&mut board, fitted);
    let set = board.events().into_iter().filter(|event| event.kind == "sensor_bandwidth");
    let set: Vec<_> = set.filter_map(|event| event.number("hz")).collect();
    assert_eq!(set, [fitted.bandwidth]);
    let mut swing = |hz: f64| {
        board.configure("SPI1.imu_tones", json!([[Z, hz, AMPLITUDE]]));
        board.run(30 * MS);
        let _ = board.can_frames();
        board.run(700 * MS);
        let rates = rates(&mut board).into_iter().filter_map(|(_, rate)| rate);
        rates.fold(0.0, |most: f64, rate| most.max(rate.abs()))
    };
    // 80 Hz would fold to 20 Hz.
    let (folded, slow) = (swing(80.0), swing(3.0));
    println!("{AMPLITUDE} deg/s at 80 Hz become {folded:.3} deg/s, at 3 Hz {slow:.3} deg/s");
    assert!((slow - AMPLITUDE).abs() < 0.02 * AMPLITUDE, "{slow}");
    // A filter of the third order (25 Hz); one of the second (23 Hz) and the mean of two samples 5 ms apart.
    assert!(folded < 0.04 * AMPLITUDE, "{folded}");
    assert_driven_well(&mut board);
}

fn part_that_falls_silent_comes_back(fitted: &Fitted) {
    let Some(mut board) = equipped(fitted, Configuration::DEFAULT) else { return };
    board.configure("SPI1.imu_rates_dps", json!([0.0, 0.0, 10.0]));
    start(&mut board, fitted);
    board.run(SECOND / 2);
    let known = |rates: &[(Duration, Option<f64>)]| rates.iter().filter(|(_, rate)| rate.is_some()).count();
    assert!(known(&rates(&mut board)) > 40);
    board.configure("SPI1.fitted", false);
    let silent = board.counts().time;
    board.run(SECOND / 2);
    let without = rates(&mut board);
    let first = without.iter().find(|(_, rate)| rate.is_none()).expect("silence is reported").0;
    println!("silence is reported after {:?}", first - silent);
    assert!(first - silent < 45 * MS, "{:?}", first - silent);
    assert!(known(&without) <= 2, "no rate is made up");
    assert!(without.len() >= 44, "{} message sets", without.len());
    assert!(service::info(&mut board).sensor.is_some());
    board.configure("SPI1.fitted", true);
    let since = board.counts().time;
    // It is looked for every second; its time stamps begin at zero again, and go on from the newest one before.
    board.run(2 * SECOND);
    let back = rates(&mut board);
    let first = back.iter().find(|(_, rate)| rate.is_some()).expect("it comes back").0;
    println!("the first rate comes {:?} after the part", first - since);
    assert!(first - since < SECOND + fitted.up[0] + 40 * MS, "{:?}", first - since);
    let turning = back.iter().rev().take(5).map(|(_, rate)| rate.expect("a rate"));
    turning.for_each(|rate| assert!((rate - 10.0).abs() < 0.2, "{rate} deg/s"));
    assert_eq!(service::info(&mut board).sensor, None);
    // It answers and measures nothing.
    board.configure("SPI1.imu_stopped", true);
    board.run(SECOND / 2);
    assert_eq!(known(&rates(&mut board).split_off(10)), 0);
    board.run(SECOND * 3 / 2 + fitted.up[0] + 40 * MS);
    assert!(rates(&mut board).iter().rev().take(5).all(|(_, rate)| rate.is_some()));
    let AllCounters { pipeline, watch, .. } = common::counters(&mut board);
    assert_eq!(watch.silences, 2);
    assert_eq!(pipeline.misplaced, 0, "every sample has a place on the grid");
}

/// Another part, and parts whose self-test fails.
#[test]
fn fault_at_the_start_is_named_gives_no_rate_and_is_tried_again() {
    const OTHER: u8 = 0x42;
    let identity =
        |name: &'static str, own: u8| (name, json!(OTHER), json!(own), SensorFault::Identity(OTHER));
    let self_test = |name: &'static str| (name, json!(false), json!(true), SensorFault::SelfTest);
    for (fitted, (setting, bad, good, fault)) in [
        (&ICM42688, identity("SPI1.imu_who_am_i", 0x47)),
        (&BMI088, identity("SPI1.imu_acc_who_am_i", 0x1E)),
        (&ASM330LHH, identity("SPI1.imu_who_am_i", 0x6B)),
        (&BMI088, self_test("SPI1.imu_self_test")),
        (&BMI088, self_test("SPI1.imu_acc_self_test")),
        (&BMI088, self_test("SPI1.imu_drive")),
        (&ASM330LHH, self_test("SPI1.imu_self_test")),
        (&ASM330LHH, self_test("SPI1.imu_acc_self_test")),
    ] {
        let Some(mut board) = equipped(fitted, Configuration::DEFAULT) else { return };
        board.configure(setting, bad);
        start(&mut board, fitted);
        assert_eq!(service::info(&mut board).sensor, Some(fault), "{} {setting}", fitted.model);
        // Silence is reported from two seconds on; it is tried again every second.
        board.run(SECOND * 5 / 2);
        let silent = rates(&mut board);
        assert!(silent.len() > 30 && silent.iter().all(|(_, rate)| rate.is_none()), "{silent:?}");
        board.configure(setting, good);
        board.run(SECOND + fitted.up[1] + 140 * MS);
        assert_eq!(service::info(&mut board).sensor, None);
        assert!(rates(&mut board).iter().any(|(_, rate)| rate.is_some()));
        assert_driven_well(&mut board);
    }
}

fn yaw_is_right_though_the_parts_oscillator_is_one_percent_off(fitted: &Fitted) {
    /// Deg/s, and seconds of it.
    const RATE: f64 = 30.0;
    const LASTS: f64 = 4.0;
    /// Seconds after the start at which the turn begins: the ratio of the clocks is known after ten.
    const BEGINS: f64 = 12.0;
    // Without corrections by the network: what is integrated is the part's rate less its static bias.
    let mut configuration = Configuration::DEFAULT;
    configuration.compensate.model = false;
    let Some(mut board) = equipped(fitted, configuration) else { return };
    let row = |seconds: f64, rate: f64| json!([seconds * 1e6, [0.0, 0.0, rate], LEVEL]);
    let turn = [
        row(BEGINS - 0.1, 0.0),
        row(BEGINS + 0.1, RATE),
        row(BEGINS + LASTS - 0.1, RATE),
        row(BEGINS + LASTS + 0.1, 0.0),
    ];
    board.configure("SPI1.imu_motion", json!(turn));
    board.configure("SPI1.imu_oscillator_error_percent", 1.0);
    if fitted.part == ImuPart::Bmi088 {
        board.configure("SPI1.imu_acc_oscillator_error_percent", -1.0);
    }
    board.power_on();
    board.run(Duration::from_secs_f64(BEGINS) - SECOND / 2);
    let _ = board.can_frames();
    board.run(Duration::from_secs_f64(LASTS) + SECOND);
    let codes: Vec<i32> = common::angles(&frames(&board.can_frames())).map(|angle| angle.yaw).collect();
    let steps = codes.windows(2).map(|pair| i64::from(pair[1].wrapping_sub(pair[0])));
    let (turned, expected) = (steps.sum::<i64>() as f64 * 360.0 / 4_294_967_296.0, RATE * LASTS);
    let per_second = codes.len() as f64 / (LASTS + 1.0);
    println!("{turned:.4} deg of {expected}, {per_second} samples a second");
    assert!((100.5..=101.5).contains(&per_second), "{per_second}");
    assert!((turned / expected - 1.0).abs() < 1e-3, "{turned} deg of {expected}");
    assert_eq!(common::counters(&mut board).watch.clock_off, 0);
    assert_driven_well(&mut board);
}

fn roll(board: &mut Board, seconds: u32, speed: f64) {
    for _ in 0..50 * seconds {
        board.can_send(&wheels(speed));
        board.run(20 * MS);
    }
}

/// The rates of the newest frames, deg/s, and their quality.
fn judged(board: &mut Board) -> Vec<(f64, Quality)> {
    let rates = common::rates(&board.can_frames());
    rates.iter().filter_map(|(_, rate)| Some((rate.deg_per_sec()?, rate.quality))).collect()
}

fn what_a_standstill_has_shown_corrects_the_next_start_before_it_stands(fitted: &Fitted) {
    /// The bias of the part about its three axes, deg/s.
    const BIAS: [f64; 3] = [0.2, -0.1, 0.4];
    let Some(mut board) = equipped(fitted, Configuration::DEFAULT) else { return };
    board.configure("SPI1.imu_rates_dps", json!(BIAS));
    start(&mut board, fitted);
    roll(&mut board, 8, 0.0);
    let learned = service::on_line(&mut board).learned().expect("a response");
    let bias = |learned: &Learned, celsius: f32| {
        let (found, _) = learned.thermal_bias.at(celsius).expect("it was learnt");
        found.map(|rate| rate.rad_per_sec().to_degrees())
    };
    let found = bias(&learned, 25.0);
    println!("{found:.3?} deg/s");
    assert!(found.iter().zip(BIAS).all(|(found, bias)| (found - bias).abs() < 0.01), "{found:?}");

    // It drives off with power on, and turns at 5 deg/s.
    board.power_off();
    board.configure("SPI1.imu_rates_dps", json!([BIAS[0], BIAS[1], BIAS[2] + 5.0]));
    start(&mut board, fitted);
    // The first second shows whether the sensor is where it was.
    roll(&mut board, 1, 30.0);
    let _ = judged(&mut board);
    roll(&mut board, 2, 30.0);
    let rates = judged(&mut board);
    assert!(rates.len() > 150, "{} rates", rates.len());
    for (rate, quality) in &rates {
        let is_right = (rate - 5.0).abs() < fitted.noise[0];
        assert!(is_right && *quality == Quality::Degraded, "{rate} deg/s, {quality:?}");
    }
    let kept = service::on_line(&mut board).learned().expect("a response").thermal_bias;
    assert_eq!(kept, learned.thermal_bias);
    assert_driven_well(&mut board);
}
