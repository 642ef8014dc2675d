//! The map of a unit, and the size of what was learnt.

use super::uds::Bench;
use super::{fresh, start};
use gyronet::bias::ThermalBias;
use gyronet::heading::Gain;
use gyronet::mounting::{Forward, GyroMap, Vertical};
use gyronet::service::message::Refusal;
use gyronet::store::{Configuration, Learned, UnitMap};
use gyronet::uds::isotp::MAX_MESSAGE;
use gyronet::units::{AngularRate, CentiCelsius, SpecificForce};
use gyronet_host_tests::flash::Flash;
use gyronet_host_tests::stored::open;

#[test]
fn the_map_of_a_unit_is_kept_for_the_weights_it_was_found_with() {
    let (flash, mut board) = fresh();
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
