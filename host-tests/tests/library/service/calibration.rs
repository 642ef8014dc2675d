//! A calibration runs at standstill, and its result is stored when that is asked for.

use super::uds::Bench;
use super::{Board, GOOD, LEVEL, observe, sample, start};
use gyronet::bias::{BiasCurve, CurveFilter};
use gyronet::heading::Gain;
use gyronet::health::{Faults, Status};
use gyronet::mounting::{Forward, GyroMap, Vertical};
use gyronet::sample::{Standstill, WheelSample};
use gyronet::service::calibrate::{CalibrationFault, State, Task};
use gyronet::service::message::Refusal;
use gyronet::standstill::Standing;
use gyronet::store::{Configuration, Learned, Mounting, UnitMap};
use gyronet::uds::isotp::MAX_MESSAGE;
use gyronet::units::{AngularRate, CentiCelsius, SpecificForce};
use gyronet_host_tests::flash::F405;
use gyronet_host_tests::stored::open;
use std::cell::RefCell;
use std::rc::Rc;

/// Runs a calibration to its end, while the wheels stand.
fn calibrate(board: &mut Board, task: Task, force: [f32; 3], wobble: f32) -> State {
    calibrate_by(board, task, (force, wobble), Standstill::Still)
}

fn calibrate_by(
    board: &mut Board,
    task: Task,
    (force, wobble): ([f32; 3], f32),
    wheels: Standstill,
) -> State {
    board.start_calibration(task);
    for k in 0..301u64 {
        let rate = 0.01 + if k % 2 == 0 { wobble } else { -wobble };
        observe(board, k as u32, Some(&sample(k, force, rate)), GOOD, wheels);
    }
    board.calibration_state()
}

#[test]
fn calibration_is_found_and_kept() {
    let flash = Rc::new(RefCell::new(F405::default()));
    let mut board = start(&flash);
    assert_eq!(board.store_result(), Err(Refusal::NothingFound));
    let moving = State::Failed(Task::Static, CalibrationFault::Moving(0));
    assert_eq!(calibrate(&mut board, Task::Static, LEVEL, 0.3), moving);
    assert_eq!(board.store_result(), Err(Refusal::NothingFound));
    let mut board = start(&flash);
    let before = (*board.learned(), board.calibration().level);
    for task in [Task::Static, Task::Mounting] {
        // Without wheels, so that nothing else learns.
        let found = calibrate_by(&mut board, task, ([0.3, 0.0, 9.81], 0.001), Standstill::Unknown);
        assert_eq!(found, State::Found(task));
        assert_eq!((*board.learned(), board.calibration().level), before, "not in use before it is stored");
        board.cancel_calibration();
        board.observe(None, 0, (Status::Silent, Faults::NONE), &WheelSample::default(), &Standing::UNKNOWN);
        assert_eq!(board.store_result(), Err(Refusal::NothingFound), "cancelled");
    }
    assert_eq!(calibrate(&mut board, Task::Static, LEVEL, 0.001), State::Found(Task::Static));
    assert_eq!(board.store_result(), Ok(()));
    // Rolled and then pitched by 30 deg: gravity shows on all axes.
    let tilted = [-9.81 * 0.5, 9.81 * 0.433_012_7, 9.81 * 0.75];
    assert_eq!(calibrate(&mut board, Task::Mounting, tilted, 0.001), State::Found(Task::Mounting));
    assert_eq!(board.store_result(), Ok(()));
    assert_eq!(
        calibrate(&mut board, Task::Mounting, [9.81, 0.0, 0.0], 0.001),
        State::Failed(Task::Mounting, CalibrationFault::Tilted(90.0))
    );
    let board = start(&flash);
    let level = board.calibration().level.expect("it was stored");
    assert!((level.roll_deg - 30.0).abs() < 1e-3 && (level.pitch_deg - 30.0).abs() < 1e-3, "{level:?}");
    let bias = board.learned().bias_curve.at(30.0).expect("it was stored").gyro_bias;
    assert!(bias.iter().all(|rate| (rate.rad_per_sec() - 0.01).abs() < 1e-4), "{bias:?}");
}

#[test]
fn the_map_of_a_unit_is_kept_for_the_weights_it_was_found_with() {
    let flash = Rc::new(RefCell::new(F405::default()));
    let mut board = start(&flash);
    let runs = board.info().weights_crc.unwrap_or(0);
    let elements = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [-0.006, 0.029, 1.001]];
    let gyro_map = GyroMap::from_elements(elements).expect("a unit's");
    let unit = |weights| Some(UnitMap { gyro_map, weights });
    let refused = Refusal::OtherWeights { found: runs ^ 1, runs };
    assert_eq!(board.set_unit(unit(runs ^ 1)), Err(refused));
    let mut tester = Bench::new(&flash);
    tester.expect(&[0x10, 3], &[0x50, 3, 0, 50, 0x01, 0xF4]);
    let record = postcard::to_allocvec(&unit(runs)).expect("memory");
    tester.expect(&[&[0x2E, 1, 0x0D][..], &record].concat(), &[0x6E, 1, 0x0D]);
    let board = start(&flash);
    assert_eq!(board.calibration().gyro_map(runs), Some(gyro_map));
    let of =
        |weights| Configuration::DEFAULT.pipeline(board.calibration(), board.learned(), weights).gyro_map;
    assert_eq!((of(runs), of(runs ^ 1)), (gyro_map, GyroMap::IDENTITY));
    assert_eq!(GyroMap::from_elements([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.2, 0.0, 1.0]]), None);
    assert_eq!(GyroMap::from_elements([[f32::NAN, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]), None);
}

#[test]
fn calibration_looks_at_the_wheels() {
    let contradicted = Standing { is_contradicted: true, ..Standing::UNKNOWN };
    for (wheels, standing) in [(Standstill::Moving, Standing::UNKNOWN), (Standstill::Still, contradicted)] {
        let mut board = start(&Rc::new(RefCell::new(F405::default())));
        board.start_calibration(Task::Static);
        let (smooth, wheels) = (sample(0, LEVEL, 0.01), WheelSample::without_speeds(wheels));
        board.observe(Some(&smooth), 0, GOOD, &wheels, &standing);
        let failed = State::Failed(Task::Static, CalibrationFault::Moving(6));
        assert_eq!(board.calibration_state(), failed);
    }
}

#[test]
fn configured_rotation_comes_first() {
    let flash = Rc::new(RefCell::new(F405::default()));
    let mounting = Mounting { roll_deg: 180.0, pitch_deg: 0.0, yaw_deg: 90.0 };
    assert_eq!(
        start(&flash).set_configuration(&Configuration { mounting, ..Configuration::DEFAULT }),
        Ok(())
    );
    let mut board = start(&flash);
    // Upside down and turned: gravity shows as -z, and the small force along the sensor's -x is
    // the vehicle's -y.
    let state = calibrate(&mut board, Task::Mounting, [-0.5, 0.0, -9.8], 0.001);
    assert_eq!(state, State::Found(Task::Mounting));
    assert_eq!(board.store_result(), Ok(()));
    let level = board.calibration().level.expect("it was found");
    assert!((level.roll_deg + 2.9206).abs() < 1e-3 && level.pitch_deg.abs() < 1e-3, "{level:?}");
}

#[test]
fn what_was_learnt_fits_a_response_and_a_record() {
    let mut filter = CurveFilter::new(&BiasCurve::UNKNOWN);
    filter.add(CentiCelsius(-3_000), [AngularRate(-11_000_000); 3]);
    let learned = Learned {
        bias_curve: filter.curve(),
        specific_force: Some([SpecificForce(-10_000_000); 3]),
        vertical: Vertical::UNKNOWN,
        forward: Some(Forward { direction: [-0.577; 3], sigma: 0.171 }),
        gain: Some(Gain { share: -0.05, sigma: 0.002, of: u32::MAX }),
    };
    let record = postcard::to_stdvec(&learned).expect("there is room");
    assert!(record.len() + 4 <= MAX_MESSAGE, "{} bytes", record.len());
    let flash = Rc::new(RefCell::new(F405::default()));
    assert_eq!(open(&flash).expect("an empty flash").set(&learned), Ok(()));
}
