//! The slow status message of a coprocessor: once a second where it is configured, and no more than the board knows.

use embedded_can::Frame;
use gyronet::can::DataFrame;
use gyronet::can::config::{self, Settings, StatusSettings};
use gyronet::can::e2e::{Checker, DataIdMode, P01, Profile, Verdict as Received};
use gyronet::can::status::{Evidence, Knowledge, STATUS_ID, SlowStatus, Verdict, emit};
use gyronet::mounting::GyroMap;
use gyronet::pipeline::{Pipeline, PipelineConfig};
use gyronet::sample::{ImuSample, PERIOD_US};
use gyronet::units::Micros;
use gyronet::{Config, Coprocessor};
use gyronet_host_tests::noise::Noise;
use gyronet_host_tests::sent::Sent;
use gyronet_host_tests::synthetic::{noisy, rate, turning};
use gyronet_host_tests::wire::{id11, wheels};
use gyronet_tools::drive::wheel_frames::receiver;

fn coprocessor(status: Option<StatusSettings>, wheels: bool) -> Coprocessor {
    let can = config::Config::new(Settings { status, ..Settings::DEFAULT }).expect("checked");
    let wheels = wheels.then(receiver);
    Coprocessor::new(Config { can, wheels, ..Config::DEFAULT })
}

fn parked(tick: u64, noise: &mut Noise) -> ImuSample {
    noisy(ImuSample { angular_rate: [rate(0.001); 3], ..turning(tick, rate(0.0)) }, [0.001, 0.02], noise)
}

/// Feeds samples of a car at rest, with a wheel frame of this speed, km/h, before each where one is given.
fn run(coprocessor: &mut Coprocessor, ticks: std::ops::Range<u64>, speed: Option<f64>) -> Vec<DataFrame> {
    let (mut noise, mut sent) = (Noise::new(7), Sent::default());
    for tick in ticks {
        let now = Micros((tick + 1) * PERIOD_US);
        if let Some(speed) = speed {
            coprocessor.can(&wheels(speed), now).expect("a wheel frame");
        }
        coprocessor.imu(parked(tick, &mut noise), now, &mut sent).expect("in time");
    }
    statuses(&sent)
}

fn statuses(sent: &Sent) -> Vec<DataFrame> {
    sent.frames.iter().map(|sent| sent.frame).filter(|frame| frame.id() == id11(STATUS_ID)).collect()
}

/// The frame says this; the doubt of the yaw, which it alone says, is known when the yaw has begun.
fn assert_says(frame: &DataFrame, status: SlowStatus) {
    let doubt = Some(doubt(frame)).filter(|doubt| *doubt != u32::from(u16::MAX));
    assert_eq!(doubt.is_some(), status.gaps.is_some());
    let status = SlowStatus { doubt, ..status };
    assert_eq!(frame.data()[3..], emit(&status)[3..], "not {status:?}");
}

/// The expected error of the angle turned in the last minute, 0.01 deg.
fn doubt(frame: &DataFrame) -> u32 {
    let [.., low, high] = *frame.data() else { panic!("eight bytes") };
    u16::from_le_bytes([low, high]).into()
}

#[test]
fn it_is_sent_once_a_second_and_protected_where_it_is_configured() {
    assert!(run(&mut coprocessor(None, false), 0..500, None).is_empty());
    let frames = run(&mut coprocessor(Some(StatusSettings { id: STATUS_ID }), false), 0..500, None);
    assert_eq!(frames.len(), 5);
    let mut checker = Checker::new(Profile::P01(P01 { data_id: STATUS_ID, mode: DataIdMode::Both }), 1);
    for (number, frame) in (0u8..).zip(&frames) {
        let verdict = checker.check(frame.data()).expect("whole");
        assert!(number == 0 || verdict == Received::Ok, "{number}: {verdict:?}");
        assert_eq!(frame.data()[2], number);
        let mut damaged = frame.data().to_vec();
        damaged[5] ^= 1;
        assert!(checker.check(&damaged).is_err());
    }
}

#[test]
fn it_says_what_the_board_knows() {
    let mut board = coprocessor(Some(StatusSettings { id: STATUS_ID }), false);
    let nothing = SlowStatus::default();
    let frames = run(&mut board, 0..901, None);
    assert_says(&frames[0], nothing);
    // After static initialisation, without wheels: the quiet sensor shows that the car stands.
    let known = SlowStatus { bias: Knowledge::Coarse, mounting: Knowledge::Coarse, gaps: Some(0), ..nothing };
    let still = SlowStatus { verdict: Verdict::Standing, evidence: Evidence::Inertial, ..known };
    assert_says(frames.last().expect("the newest"), still);
    // Samples are missing twice; the sensor is found moved.
    run(&mut board, 910..920, None);
    board.mount_moved();
    let frames = run(&mut board, 925..1_900, None);
    let moved = SlowStatus { gaps: Some(2), mounting: Knowledge::Refused, ..still };
    assert_says(frames.last().expect("the newest"), moved);
}

#[test]
fn a_silence_is_a_doubt_while_it_lasts_and_for_a_minute() {
    let mut board = coprocessor(Some(StatusSettings { id: STATUS_ID }), false);
    let before = doubt(run(&mut board, 0..1_000, None).last().expect("the newest"));
    // 7 s at a bias that nothing confirms, 5e-3 rad/s.
    assert!(before < 220, "{before}: 2.2 deg");
    let mut sent = Sent::default();
    for millisecond in 0..4_000 {
        board.poll(Micros(10_010_000 + millisecond * 1_000), &mut sent).expect("time goes on");
    }
    let found: Vec<u32> = statuses(&sent).iter().map(doubt).collect();
    // In 4 s a vehicle's rate walks by 0.2 x 4^1.5 / 3^0.5 rad: 53 deg.
    assert!(found.is_sorted() && (2_500..5_500).contains(found.last().expect("statuses")), "{found:?}");
    // The grid begins again with the first sample.
    let sample = parked(1_400, &mut Noise::new(8));
    assert!(board.imu(sample, Micros(14_010_000), &mut ()).is_err());
    let frames = run(&mut board, 1_401..1_500, None);
    assert!(doubt(frames.last().expect("the newest")) >= *found.last().expect("not empty"));
    let frames = run(&mut board, 1_500..8_100, None);
    assert!(doubt(frames.last().expect("the newest")) < 2_000, "over, but for that bias");
}

#[test]
fn wheels_decide_where_they_are_known() {
    let mut board = coprocessor(Some(StatusSettings { id: STATUS_ID }), true);
    let frames = run(&mut board, 0..501, Some(0.0));
    let stands = SlowStatus {
        verdict: Verdict::Standing,
        evidence: Evidence::Wheels,
        bias: Knowledge::Coarse,
        mounting: Knowledge::Coarse,
        gaps: Some(0),
        ..SlowStatus::default()
    };
    assert_says(frames.last().expect("the newest"), stands);
    let frames = run(&mut board, 501..701, Some(7.2));
    // Whoever drives off stood on ground that does not turn.
    let stands = SlowStatus { bias: Knowledge::Fine, ..stands };
    assert_says(frames.last().expect("the newest"), SlowStatus { verdict: Verdict::Moving, ..stands });
    // Wheels are silent, as in a parked car whose brakes sleep: the sensor's quiet shows it.
    let frames = run(&mut board, 701..1201, None);
    let silent = SlowStatus { evidence: Evidence::Inertial, ..stands };
    assert_says(frames.last().expect("the newest"), silent);
}

#[test]
fn what_calibration_and_earlier_drives_have_shown_is_known_before_the_first_standstill() {
    use Knowledge::{Coarse, Fine, Unknown};
    let gyro_map =
        GyroMap::from_elements([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.002]]).expect("a unit's");
    let default = PipelineConfig::DEFAULT;
    for (config, gain, mounting) in [
        (default, Unknown, Unknown),
        (PipelineConfig { gyro_map, ..default }, Fine, Unknown),
        (PipelineConfig { levelling: false, ..default }, Unknown, Coarse),
        (PipelineConfig { levelling: false, forward: Fine, ..default }, Unknown, Fine),
    ] {
        let status = Pipeline::new(config).status(None);
        assert_eq!((status.bias, status.gain, status.mounting), (Unknown, gain, mounting));
    }
}
