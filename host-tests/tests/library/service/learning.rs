//! The board learns its sensor's bias by temperature while the wheels stand, keeps it over a restart, and forgets it on
//! request.

use super::uds::{Bench, bench};
use super::{Board, ask, sample, set, start};
use gyronet::health::{Faults, Status};
use gyronet::sample::{ImuSample, Standstill};
use gyronet::service::Request;
use gyronet::service::message::Calibrate;
use gyronet::store::{Calibration, Configuration};
use gyronet::units::CentiCelsius;
use gyronet_host_tests::flash::F405;
use std::cell::RefCell;
use std::rc::Rc;

const LEVEL: [f32; 3] = [0.0, 0.0, 9.81];

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
        board.observe(Some(&sample), tick as u32, (Status::Ready, Faults::NONE), wheels);
    }
}

/// Returns the yaw bias that the board has learnt for a temperature.
fn learned(board: &Board, celsius: f32) -> Option<f64> {
    board.learned().bias_curve.at(celsius).map(|bias| bias.gyro_bias[2].rad_per_sec())
}

fn is_near(found: Option<f64>, expected: f64) -> bool {
    found.is_some_and(|found| (found - expected).abs() < 5e-4)
}

#[test]
fn a_standstill_that_the_wheels_prove_is_learnt_from() {
    let mut board = start(&Rc::new(RefCell::new(F405::default())));
    for wheels in [Standstill::Moving, Standstill::Unknown] {
        observe(&mut board, 10, (0.01, 20), LEVEL, wheels);
    }
    observe(&mut board, 2, (0.01, 20), LEVEL, Standstill::Still);
    assert_eq!(learned(&board, 20.0), None, "three seconds are wanted");
    observe(&mut board, 4, (0.01, 20), LEVEL, Standstill::Still);
    assert!(is_near(learned(&board, 20.0), 0.01));
    // And where it is warm.
    observe(&mut board, 60, (0.01, 20), LEVEL, Standstill::Still);
    observe(&mut board, 60, (0.012, 40), LEVEL, Standstill::Still);
    assert!(is_near(learned(&board, 20.0), 0.01) && is_near(learned(&board, 40.0), 0.012));
    let before = *board.learned();
    // A sensor that was moved.
    observe(&mut board, 10, (0.01, 60), [0.0, 9.81, 0.0], Standstill::Still);
    assert_eq!(*board.learned(), before);
}

#[test]
fn what_was_learnt_survives_a_restart_and_is_used_where_the_configuration_wants_it() {
    let (flash, mut bench) = bench();
    // Without anything stored yet an erase would be needed, which only a session may ask for.
    assert_eq!(ask(&mut bench.board, &set(&Configuration::DEFAULT)), Ok(()));
    observe(&mut bench.board, 4, (0.01, 20), LEVEL, Standstill::Still);
    bench.expect(&[0x3E, 0], &[0x7E, 0]);
    let mut bench = Bench::new(&flash);
    assert!(is_near(learned(&bench.board, 20.0), 0.01));
    let used = |configuration: Configuration, board: &Board| {
        let table = configuration.pipeline(&Calibration::NONE, board.learned(), 0).bias_curve;
        table.at(20.0).map(|bias| bias.gyro_bias[2].rad_per_sec())
    };
    assert!(is_near(used(Configuration::DEFAULT, &bench.board), 0.01));
    let off = Configuration { learn_bias: false, ..Configuration::DEFAULT };
    assert_eq!(used(off, &bench.board), None);
    assert_eq!(ask(&mut bench.board, &set(&off)), Ok(()));
    let (mut board, before) = (start(&flash), *bench.board.learned());
    observe(&mut board, 4, (0.05, 40), LEVEL, Standstill::Still);
    assert_eq!(*board.learned(), before, "off");
}

#[test]
fn a_tester_reads_what_was_learnt_and_has_it_forgotten() {
    let (flash, mut bench) = bench();
    observe(&mut bench.board, 4, (0.01, 20), LEVEL, Standstill::Still);
    let record = postcard::to_stdvec(bench.board.learned()).expect("memory");
    bench.expect(&[0x22, 0x01, 0x15], &[&[0x62, 0x01, 0x15][..], &record].concat());
    // In an extended session, at standstill.
    bench.expect(&[0x31, 1, 0x02, 0x05], &[0x7F, 0x31, 0x7F]);
    bench.expect(&[0x10, 3], &[0x50, 3, 0, 50, 0x01, 0xF4]);
    observe(&mut bench.board, 1, (0.01, 20), LEVEL, Standstill::Moving);
    bench.expect(&[0x31, 1, 0x02, 0x05], &[0x7F, 0x31, 0x22]);
    observe(&mut bench.board, 1, (0.01, 20), LEVEL, Standstill::Still);
    bench.expect(&[0x31, 1, 0x02, 0x05], &[0x71, 1, 0x02, 0x05]);
    assert_eq!(learned(&bench.board, 20.0), None);
    assert_eq!(learned(&start(&flash), 20.0), None);
    assert_eq!(ask(&mut bench.board, &Request::Calibrate(Calibrate::Forget)), Ok(()));
}
