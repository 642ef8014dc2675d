//! The board learns its sensor's bias by temperature while the wheels stand and where forward is while they turn, keeps
//! both over a restart, and forgets them on request.

use super::uds::{Bench, bench};
use super::{Board, GOOD, LEVEL, fresh, sample, start};
use gyronet::bias::{StaticConfig, ThermalBias};
use gyronet::heading::{CourseCounters, CourseState, Gain, Refusal};
use gyronet::health::slow::Knowledge;
use gyronet::health::{Faults, Status};
use gyronet::mounting::{Forward, Vertical, VerticalEstimator};
use gyronet::sample::{ImuSample, Standstill, Validity, WheelSample};
use gyronet::service::Learner;
use gyronet::standstill::Standing;
use gyronet::store::{Calibration, Configuration, Learned};
use gyronet::uds::isotp::MAX_MESSAGE;
use gyronet::units::{AngularRate, CentiCelsius, SpecificForce, WheelSpeed};
use gyronet_host_tests::flash::Flash;
use gyronet_host_tests::noise::Noise;
use gyronet_host_tests::stored::open;
use gyronet_host_tests::synthetic::judged;

/// Lets the board see seconds of a sensor at rest with this bias and temperature, while the wheels show this.
fn observe(
    board: &mut Board,
    seconds: u64,
    (bias, celsius): (f32, i16),
    force: [f32; 3],
    wheels: Standstill,
) {
    for tick in 0..100 * seconds {
        let temperature = Some(CentiCelsius(celsius * 100));
        let sample = ImuSample { temperature, ..sample(tick, force, bias) };
        super::observe(board, tick as u32, Some(&sample), GOOD, wheels);
    }
}

/// Four seconds, of which three are wanted.
fn stand(board: &mut Board) {
    observe(board, 4, (0.01, 20), LEVEL, Standstill::Still);
}

fn learned(board: &Board, celsius: f32) -> Option<f64> {
    board.learned().thermal_bias.at(celsius).map(|([.., yaw], _)| yaw.rad_per_sec())
}

fn is_near(found: Option<f64>, expected: f64) -> bool {
    found.is_some_and(|found| (found - expected).abs() < 5e-4)
}

#[test]
fn a_standstill_that_the_wheels_prove_is_learnt_from() {
    let (_, mut board) = fresh();
    for wheels in [Standstill::Moving, Standstill::Unknown] {
        observe(&mut board, 10, (0.01, 20), LEVEL, wheels);
    }
    observe(&mut board, 2, (0.01, 20), LEVEL, Standstill::Still);
    assert_eq!(learned(&board, 20.0), None, "three seconds are wanted");
    stand(&mut board);
    assert!(is_near(learned(&board, 20.0), 0.01));
}

#[test]
fn what_was_learnt_is_stored_at_a_stop_used_where_the_configuration_wants_it_and_forgotten() {
    let (flash, mut bench) = bench();
    // Without anything stored yet an erase would be needed, which only a session may ask for.
    assert_eq!(bench.board.set_configuration(&Configuration::DEFAULT), Ok(()));
    // The troubles of this start are stored first.
    bench.expect(&[0x3E, 0], &[0x7E, 0]);
    stand(&mut bench.board);
    moves(&mut bench, Faults::NONE);
    let before = flash.borrow().operations();
    let record = postcard::to_stdvec(bench.board.learned()).expect("memory");
    bench.expect(&[0x22, 0x01, 0x15], &[&[0x62, 0x01, 0x15][..], &record].concat());
    assert_eq!(flash.borrow().operations(), before, "in motion nothing is written");
    observe(&mut bench.board, 1, (0.01, 20), LEVEL, Standstill::Still);
    bench.expect(&[0x3E, 0], &[0x7E, 0]);
    let mut bench = Bench::new(&flash);
    assert!(is_near(learned(&bench.board, 20.0), 0.01));
    let used = |configuration: Configuration, board: &Board| {
        let used = configuration.pipeline(&Calibration::NONE, board.learned(), 0).thermal_bias;
        used.at(20.0).map(|([.., yaw], _)| yaw.rad_per_sec())
    };
    assert!(is_near(used(Configuration::DEFAULT, &bench.board), 0.01));
    let off = Configuration { learn: false, ..Configuration::DEFAULT };
    assert_eq!(used(off, &bench.board), None);
    bench.expect(&[0x10, 3], &[0x50, 3, 0, 50, 0x01, 0xF4]);
    bench.expect(&[0x31, 1, 0x02, 0x05], &[0x71, 1, 0x02, 0x05]);
    assert_eq!([&bench.board, &start(&flash)].map(|board| learned(board, 20.0)), [None; 2]);
    assert_eq!(bench.board.forget_learned(), Ok(()));
    assert_eq!(bench.board.set_configuration(&off), Ok(()));
    let (mut board, before) = (start(&flash), *bench.board.learned());
    observe(&mut board, 4, (0.05, 40), LEVEL, Standstill::Still);
    drive(&mut board, 120, 20.0);
    assert_eq!((*board.learned(), board.forward_deg()), (before, None), "off");
}

/// A drive with the sensor's x axis this far to the left of forward, deg: speed and yaw rate change in waves.
fn driven(seconds: u64, yaw_deg: f64) -> impl Iterator<Item = (ImuSample, WheelSample)> {
    let (sin, cos) = yaw_deg.to_radians().sin_cos();
    let mut noise = Noise::new(3);
    (0..100 * seconds).map(move |tick| {
        let time = 0.01 * tick as f64;
        let (speed, turn) = (15.0 + 5.0 * (0.2 * time).sin(), 0.2 * (0.13 * time).sin());
        let (ahead, left) = ((0.2 * time).cos() + 0.4 * noise.normal(), speed * turn + 0.4 * noise.normal());
        let force = [cos * ahead + sin * left, cos * left - sin * ahead, 9.81].map(|axis| axis as f32);
        let speeds = [Some(WheelSpeed((speed * 65_536.0) as i32)); 4];
        let wheels = WheelSample { speeds, ..WheelSample::without_speeds(Standstill::Moving) };
        (sample(tick, force, turn as f32), wheels)
    })
}

fn drive(board: &mut Board, seconds: u64, yaw_deg: f64) {
    for (sample, wheels) in driven(seconds, yaw_deg) {
        board.observe(Some(&sample), 0, (Status::Ready, Faults::NONE), &wheels, &judged(wheels.standstill));
    }
}

#[test]
fn a_drive_shows_where_forward_is_and_that_the_sensor_was_moved() {
    let (flash, mut bench) = bench();
    assert_eq!(bench.board.set_configuration(&Configuration::DEFAULT), Ok(()));
    bench.expect(&[0x22, 0x01, 0x16], &[0x62, 0x01, 0x16, 0, 0, 0, 0, 0]);
    drive(&mut bench.board, 60, 20.0);
    assert_eq!(bench.board.forward_deg(), None, "where up is only a standstill shows");
    stand(&mut bench.board);
    drive(&mut bench.board, 120, 20.0);
    let [yaw, sigma] = bench.board.forward_deg().expect("a drive");
    assert!((yaw + 20.0).abs() < 3.0 * sigma && sigma < 3.0, "{yaw} +- {sigma}");
    let hundredths = |angle: f32| ((100.0 * angle).round() as i16).to_be_bytes();
    let response = [&[0x62, 0x01, 0x16, 2][..], &hundredths(yaw), &hundredths(sigma)].concat();
    bench.expect(&[0x22, 0x01, 0x16], &response);
    assert!(!bench.board.take_mount_moved());

    // At the next stop it is stored; a start knows it.
    stand(&mut bench.board);
    bench.expect(&[0x3E, 0], &[0x7E, 0]);
    let mut board = start(&flash);
    assert_eq!(board.forward_deg(), Some([yaw, sigma]));
    let before = *board.learned();

    // Somebody has turned the sensor: it stands as level as before.
    drive(&mut board, 120, 80.0);
    assert!(board.take_mount_moved() && !board.take_mount_moved(), "once");
    stand(&mut board);
    assert_eq!(*board.learned(), before, "nothing is learnt");

    // After the next start its owner says that this is right.
    let mut board = start(&flash);
    stand(&mut board);
    assert_eq!(board.forget_learned(), Ok(()));
    stand(&mut board);
    drive(&mut board, 120, 80.0);
    let [yaw, sigma] = board.forward_deg().expect("a drive");
    assert!((yaw + 80.0).abs() < 3.0 * sigma && !board.take_mount_moved(), "{yaw} +- {sigma}");
}

#[test]
fn how_far_a_sensor_must_be_moved_depends_on_how_well_forward_was_known() {
    for (sigma_deg, turned, moved) in
        [(1.0, 20.0, false), (1.0, 35.0, true), (9.0, 35.0, false), (9.0, 90.0, true)]
    {
        let mut learned = Learned::NOTHING;
        learned.add_standstill(sample(0, LEVEL, 0.0).specific_force);
        let known = Forward { direction: [1.0, 0.0, 0.0], sigma: f32::to_radians(sigma_deg) };
        learned.forward = Some(known);
        let (mut learner, limits) = (Learner::START, StaticConfig::DEFAULT);
        let reports = driven(180, turned).filter(|(sample, wheels)| {
            let standing = judged(wheels.standstill);
            learner.observe(Some(sample), wheels, &standing, &limits, &mut learned)
        });
        assert_eq!(reports.count(), usize::from(moved), "{turned} deg, known within {sigma_deg} deg");
        assert!(!moved || learned.forward == Some(known), "what was known stays");
    }
}

#[test]
fn a_minute_on_a_ramp_is_one_standstill() {
    let (_, mut board) = fresh();
    stand(&mut board);
    let ramp = [2.2, 0.0, 9.56];
    observe(&mut board, 1, (0.01, 20), LEVEL, Standstill::Moving);
    for _ in 0..15 {
        observe(&mut board, 4, (0.01, 20), ramp, Standstill::Still);
        // A sample is missing.
        let still = WheelSample::without_speeds(Standstill::Still);
        board.observe(None, 0, (Status::Ready, Faults::GAP), &still, &Standing::WHEELS);
    }
    let [ahead, ..] = board.learned().specific_force.expect("two standstills");
    assert!((ahead.metre_per_sec2() - 2.2 / 8.0).abs() < 0.01, "{ahead:?}");
}

/// The last one is a platform that turns while the wheels stand: the pipeline contradicts it.
#[test]
fn bad_readings_and_a_contradicted_standstill_teach_nothing() {
    let contradicted = Standing { is_contradicted: true, ..Standing::UNKNOWN };
    let (_, mut board) = fresh();
    let before = *board.learned();
    for (validity, rate, state, standing) in [
        (Validity::Saturated, 0.05, (Status::Clipped, Faults::NONE), Standing::WHEELS),
        (Validity::Recovering, 0.05, (Status::Clipped, Faults::NONE), Standing::WHEELS),
        (Validity::Implausible, 0.05, (Status::Clipped, Faults::NONE), Standing::WHEELS),
        (Validity::Stuck, 0.05, (Status::Clipped, Faults::NONE), Standing::WHEELS),
        (Validity::Good, 0.009, (Status::Ready, Faults::WHEELS), contradicted),
    ] {
        for tick in 0..1_000 {
            let sample = ImuSample { validity, ..sample(tick, LEVEL, rate) };
            let wheels = WheelSample::without_speeds(Standstill::Still);
            board.observe(Some(&sample), 0, state, &wheels, &standing);
        }
        assert_eq!(*board.learned(), before, "{validity:?}");
    }
}

fn moves(bench: &mut Bench, faults: Faults) {
    let (wheels, moving) = (WheelSample::without_speeds(Standstill::Moving), sample(0, LEVEL, 0.01));
    bench.board.observe(Some(&moving), 0, (Status::Ready, faults), &wheels, &Standing::UNKNOWN);
}

/// Troubles may be appended at any time; where that needs an erase, a workshop waits for the vehicle to stand.
#[test]
fn troubles_erase_nothing_in_motion() {
    // A request that may be told to wait for an erase.
    const READ: [u8; 3] = [0x22, 0xF1, 0x86];
    let (flash, mut bench) = bench();
    for k in 0..10_000 {
        let latitude = Configuration { latitude_deg: Some((k % 90) as f32), ..Configuration::DEFAULT };
        assert_eq!(bench.board.set_configuration(&latitude), Ok(()));
        if !open(&flash).expect("the flash answers").has_room() {
            break;
        }
    }
    // What was learnt waits, too, although the vehicle stands.
    stand(&mut bench.board);
    let before = flash.borrow().operations();
    bench.expect(&READ, &[0x62, 0xF1, 0x86, 1]);
    bench.expect(&[0x10, 3], &[0x50, 3, 0, 50, 0x01, 0xF4]);
    moves(&mut bench, Faults::GAP);
    bench.expect(&READ, &[0x62, 0xF1, 0x86, 3]);
    assert_eq!(flash.borrow().operations(), before);
    observe(&mut bench.board, 1, (0.01, 20), LEVEL, Standstill::Still);
    bench.expect(&READ, &[0x62, 0xF1, 0x86, 3]);
    assert!(flash.borrow().operations() > before);
}

#[test]
fn a_tilt_is_kept_and_dropped_when_the_sensor_was_moved() {
    let (flash, mut bench) = bench();
    assert_eq!(bench.board.set_configuration(&Configuration::DEFAULT), Ok(()));
    bench.expect(&[0x22, 0x01, 0x18], &[0x62, 0x01, 0x18, 0, 0, 0, 0, 0, 0x03, 0x22]);
    // Two stops on a street that slopes by 1 deg; the sensor rolls by 12 deg.
    let mut estimator = VerticalEstimator::new(Vertical::UNKNOWN);
    for roll in [11.0, 13.0] {
        let (sin, cos) = f64::to_radians(roll).sin_cos();
        estimator.rest(&sample(0, [0.0, (9.81 * sin) as f32, (9.81 * cos) as f32], 0.0).specific_force);
    }
    bench.board.learn_vertical(*estimator.known());
    let (knowledge, [roll, pitch, sigma]) = bench.board.level_deg();
    assert!(knowledge == Knowledge::Fine && (roll - 12.0).abs() < 0.5 && pitch.abs() < 0.1, "{roll} {pitch}");
    assert!((2.0..3.0).contains(&sigma), "{sigma}");
    let hundredths = |angle: f32| ((100.0 * angle).round() as i16).to_be_bytes();
    let response = [hundredths(roll), hundredths(pitch), hundredths(sigma)].concat();
    bench.expect(&[0x22, 0x01, 0x18], &[&[0x62, 0x01, 0x18, 2][..], &response].concat());
    let tilted = [0.0, 2.04, 9.6];
    observe(&mut bench.board, 4, (0.01, 20), tilted, Standstill::Still);
    bench.expect(&[0x3E, 0], &[0x7E, 0]);

    let mut kept = Bench::new(&flash);
    assert_eq!(kept.board.learned().vertical, *estimator.known());
    let used = Configuration::DEFAULT.pipeline(&Calibration::NONE, kept.board.learned(), 0);
    assert!(used.levelling && used.vertical == *estimator.known());
    let off = Configuration { learn: false, ..Configuration::DEFAULT };
    assert_eq!(off.pipeline(&Calibration::NONE, kept.board.learned(), 0).vertical, Vertical::UNKNOWN);
    // The sensor hangs on its side now.
    observe(&mut kept.board, 4, (0.01, 20), [0.0, 9.81, 0.0], Standstill::Still);
    assert!(kept.board.take_mount_moved());
    assert_eq!(kept.board.learned().vertical, Vertical::UNKNOWN);
    kept.board.learn_vertical(*estimator.known());
    assert_eq!(kept.board.learned().vertical, Vertical::UNKNOWN, "nothing is learnt");
    kept.expect(&[0x3E, 0], &[0x7E, 0]);
    assert_eq!(start(&flash).learned().vertical, Vertical::UNKNOWN);
}

#[test]
fn a_gain_by_courses_is_kept_less_certain_and_dropped_when_the_sensor_was_moved() {
    let (flash, mut bench) = bench();
    let mut configuration = Configuration::DEFAULT;
    configuration.heading.nmea2000 = true;
    assert_eq!(bench.board.set_configuration(&configuration), Ok(()));
    let read = [0x22, 0x01, 0x19];
    let response = |state: u8, counters: [u32; 3], gain: [i16; 2]| {
        let words = counters.map(u32::to_be_bytes).concat();
        [&[0x62, 0x01, 0x19, state][..], &gain.map(i16::to_be_bytes).concat(), &words, &[0]].concat()
    };
    bench.expect(&read, &response(0, [0; 3], [0; 2]));
    let of = configuration.pipeline(&Calibration::NONE, &Learned::NOTHING, 7).gain_of;
    let gain = |sigma| Gain { share: -0.008, sigma, of };
    let counters = CourseCounters { used: 900, refused: 2, restarts: 0 };
    let seen = |sigma| CourseState { counters, gain: Some(gain(sigma)), ..CourseState::START };
    bench.board.learn_course(&seen(0.003));
    assert_eq!(bench.board.learned().gain, None, "too uncertain to be kept");
    for sigma in [0.002, 0.0015, 0.001] {
        bench.board.learn_course(&seen(sigma));
    }
    bench.expect(&read, &response(2, [900, 2, 0], [-800, 100]));
    stand(&mut bench.board);
    bench.expect(&[0x3E, 0], &[0x7E, 0]);

    let mut kept = Bench::new(&flash);
    assert_eq!(kept.board.learned().gain, Some(gain(0.001)));
    let used = |configuration: &Configuration, weights: u32| {
        configuration.pipeline(&Calibration::NONE, kept.board.learned(), weights).gain
    };
    let given = used(&configuration, 7).expect("it is used");
    assert!(given.share == -0.008 && (given.sigma - 0.001_887).abs() < 1e-6, "{given:?}");
    assert_eq!(used(&configuration, 8), None, "another model");
    assert_eq!(used(&Configuration::DEFAULT, 7), None, "no courses are configured");
    assert_eq!(used(&Configuration { learn: false, ..configuration }, 7), None);
    // The sensor hangs on its side now.
    observe(&mut kept.board, 4, (0.01, 20), [0.0, 9.81, 0.0], Standstill::Still);
    assert!(kept.board.take_mount_moved());
    kept.board.learn_course(&seen(0.001));
    assert_eq!(kept.board.learned().gain, None);
    kept.expect(&[0x3E, 0], &[0x7E, 0]);
    assert_eq!(start(&flash).learned().gain, None);
    // What was forgotten is learnt from the next start on.
    let mut board = start(&flash);
    board.learn_course(&seen(0.001));
    observe(&mut board, 1, (0.01, 20), LEVEL, Standstill::Still);
    assert_eq!(board.forget_learned(), Ok(()));
    board.learn_course(&seen(0.001));
    assert_eq!(board.learned().gain, None);
}

#[test]
fn courses_that_contradict_the_gyro_are_a_trouble() {
    let (_flash, mut bench) = bench();
    let status = |bench: &mut Bench, status: u8| {
        bench.expect(
            &[0x19, 6, 0xDA, 0x04, 0x62, 1],
            &[0x59, 6, 0xDA, 0x04, 0x62, status, 1, u8::from(status & 8 != 0)],
        );
    };
    bench.expect(&[0x3E, 0], &[0x7E, 0]);
    status(&mut bench, 0);
    let counters = CourseCounters { used: 10, refused: 11, restarts: 1 };
    let refusal = Some(Refusal::Jump);
    let contradicted = CourseState { counters, is_contradicted: true, refusal, ..CourseState::START };
    bench.board.learn_course(&contradicted);
    bench.expect(
        &[0x22, 0x01, 0x19],
        &[0x62, 0x01, 0x19, 3, 0, 0, 0, 0, 0, 0, 0, 10, 0, 0, 0, 11, 0, 0, 0, 1, 1],
    );
    status(&mut bench, 0x2F);
    bench.board.learn_course(&CourseState::START);
    bench.expect(&[0x3E, 0], &[0x7E, 0]);
    status(&mut bench, 0x2E);
}

#[test]
fn what_was_learnt_fits_a_response_and_a_record() {
    let mut thermal_bias = ThermalBias::UNKNOWN;
    thermal_bias.add(true, CentiCelsius(-3_000), [AngularRate(-11_000_000); 3]);
    let learned = Learned {
        thermal_bias,
        specific_force: Some([SpecificForce(-10_000_000); 3]),
        vertical: Vertical::UNKNOWN,
        forward: Some(Forward { direction: [-0.577; 3], sigma: 0.171 }),
        gain: Some(Gain { share: -0.05, sigma: 0.002, of: u32::MAX }),
    };
    let record = postcard::to_stdvec(&learned).expect("there is room");
    assert!(record.len() + 4 <= MAX_MESSAGE, "{} bytes", record.len());
    let flash = Flash::default();
    assert_eq!(open(&flash).expect("an empty flash").set(&learned), Ok(()));
}
