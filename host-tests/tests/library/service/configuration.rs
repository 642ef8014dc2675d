//! The configuration is stored whole, at standstill alone, and refused where it is wrong.

use super::{Board, GOOD, IDENTITY, LEVEL, SUPPORTED_HARDWARE, fresh, sample, start};
use gyronet::bias::{EarthRate, Latitude, StaticConfig};
use gyronet::can::config::{Config, ConfigError, Settings, YawSettings};
use gyronet::can::diagnosis::DiagnosisIds;
use gyronet::can::fd::FD_ID;
use gyronet::can::wheel::{WheelFrame, WheelSettings};
use gyronet::compensate::CompensateConfig;
use gyronet::fog::Tilt;
use gyronet::heading::{GnssProtocol, GnssSettings, HeadingSettings};
use gyronet::health::{Faults, Status};
use gyronet::model::weights::DEFAULT;
use gyronet::sample::{Standstill, WheelSample};
use gyronet::service::message::{FlashState, Origin, Refusal};
use gyronet::standstill::{Standing, StandstillSource};
use gyronet::store::layout;
use gyronet::store::slots::{SlotError, WeightSource};
use gyronet::store::{Calibration, Learned, StoreError};
use gyronet::store::{Configuration, Field, FieldError, FlashFault, FogGyro, FogPart, ImuPart, Mounting};
use gyronet::units::SpecificForce;
use gyronet_host_tests::flash::{Flash, Region};
use gyronet_host_tests::wire::id11;

#[test]
fn configuration_is_kept_whole() {
    let (flash, mut board) = fresh();
    assert_eq!(board.info().configuration, Origin::BuiltIn);
    let wanted = Configuration { latitude_deg: Some(-33.9), ..Configuration::DEFAULT };
    assert_eq!(board.set_configuration(&wanted), Ok(()));
    let mut board = start(&flash);
    assert_eq!(board.info().configuration, Origin::Stored);
    assert_eq!(*board.configuration(), wanted);
    // Refused, and named, and the old one stays.
    let wild = Configuration { mounting: Mounting { pitch_deg: 91.0, ..Mounting::default() }, ..wanted };
    match board.set_configuration(&wild) {
        Err(Refusal::Store(StoreError::Field(error @ FieldError::Range { field, value, .. }))) => {
            assert_eq!((field, value), (Field::MountingPitchDeg, 91.0));
            assert!(error.to_string().contains("mounting.pitch_deg"), "{error}");
        }
        other => panic!("{other:?}"),
    }
    let slow = |bits_per_second| Settings { bits_per_second, ..wanted.can };
    let overload = ConfigError::Overload { per_mille: 972, bits_per_second: 125_000 };
    let fog = Some(FogPart::Dsp1760);
    let mut with_line = wanted;
    with_line.heading.line = Some(GnssSettings { protocol: GnssProtocol::Nmea, baud: 9_600 });
    let yaw = wanted.can.yaw.map(|yaw| YawSettings { fd: Some(FD_ID), ..yaw });
    for (configuration, error) in [
        (Configuration { imu: ImuPart::Icm42688, ..wanted }, FieldError::PartNotInImage),
        (Configuration { can: slow(100_000), ..wanted }, FieldError::Can(ConfigError::BitRate(100_000))),
        (Configuration { can: slow(125_000), fog, ..wanted }, FieldError::Can(overload)),
        (
            Configuration { fog_ids: [0x1A0, 0x1A5, 0x1A6], ..wanted },
            FieldError::Can(ConfigError::DuplicateIdentifier(0x1A0)),
        ),
        (Configuration { fog, ..wanted }, FieldError::PartNotInImage),
        (with_line, FieldError::NoLine),
        (Configuration { can: Settings { yaw, ..wanted.can }, ..wanted }, FieldError::NoFd),
    ] {
        let refused = Err(Refusal::Store(StoreError::Field(error)));
        assert_eq!(board.set_configuration(&configuration), refused, "{configuration:?}");
    }
    assert_eq!(*start(&flash).configuration(), wanted);
}

#[test]
fn wheel_frames_are_kept() {
    let (flash, mut board) = fresh();
    let known = |board: &mut Board| (board.info().wheels, *board.wheels());
    let built_in = (Origin::BuiltIn, WheelSettings::TOYOTA);
    assert_eq!(known(&mut board), built_in);
    let with_id = |id: u16| {
        let frame = WheelSettings::TOYOTA.frames[0].map(|frame| WheelFrame { id: id11(id), ..frame });
        WheelSettings { frames: [frame, None, None, None], ..WheelSettings::TOYOTA }
    };
    assert_eq!(board.set_wheels(&with_id(0xAB)), Ok(()));
    assert_eq!(known(&mut board), built_in, "from the next start on");
    let mut board = start(&flash);
    assert_eq!(known(&mut board), (Origin::Stored, with_id(0xAB)));
}

#[test]
fn damaged_record_is_noted() {
    let (flash, mut board) = fresh();
    assert_eq!(board.set_configuration(&Configuration::DEFAULT), Ok(()));
    // Another record is whole.
    assert_eq!(board.set_wheels(&WheelSettings::TOYOTA), Ok(()));
    flash.borrow_mut().damage(layout::STORE.start as usize + 20, 4);
    let board = start(&flash);
    assert_eq!(board.info().flash, FlashState::Damaged);
    assert_eq!(board.info().configuration, Origin::BuiltIn);
    assert!(board.stored_damaged() && board.configuration_lost());
    // At every start, whatever else is stored, until it is stored again.
    for _ in 0..2 {
        let mut board = start(&flash);
        assert_eq!(board.info().configuration, Origin::Refused(StoreError::Lost));
        assert!(board.stored_damaged() && board.configuration_lost());
        assert_eq!(board.set_wheels(&WheelSettings::TOYOTA), Ok(()));
    }
    assert_eq!(start(&flash).set_configuration(&Configuration::DEFAULT), Ok(()));
    let board = start(&flash);
    assert!(!board.stored_damaged() && !board.configuration_lost());
}

#[test]
fn a_torn_record_of_something_else_heals_at_the_next_start() {
    let flash = Flash::default();
    // No configuration is stored. Of two records of the wheels the second one is torn: its checksum is missing.
    let mut board = start(&flash);
    for _ in 0..2 {
        assert_eq!(board.set_wheels(&WheelSettings::TOYOTA), Ok(()));
    }
    let first = layout::STORE.start as usize + 8;
    let size = 8 + usize::from(flash.borrow().bytes()[first + 2]).next_multiple_of(4);
    flash.borrow_mut().damage(first + 2 * size - 4, 4);
    assert!(start(&flash).stored_damaged());
    let board = start(&flash);
    assert!(!board.stored_damaged() && !board.configuration_lost());
}

#[test]
fn nothing_is_written_without_flash_or_with_an_unlocked_controller_and_the_standstill_gate_holds() {
    let flash = Flash::default();
    let wanted = Configuration { latitude_deg: Some(-33.9), ..Configuration::DEFAULT };
    assert_eq!(start(&flash).set_configuration(&wanted), Ok(()));
    let mut board = Board::new(&SUPPORTED_HARDWARE);
    let records = Region::new(&flash, layout::STORE);
    board.begin(Some(records), Some(Region::mapped(&flash, None)), Err(FlashFault::Unlocked), IDENTITY);
    assert_eq!(*board.configuration(), wanted);
    let about = board.info();
    assert_eq!((about.flash, about.writable), (FlashState::Ready, false));
    assert!(board.stored_damaged() && !board.configuration_lost());
    assert_eq!(about.stored_fault, Some(StoreError::Flash(FlashFault::Unlocked)));
    let before = flash.borrow().operations();
    let no_flash = Err(Refusal::Store(StoreError::NoFlash));
    assert_eq!(board.set_configuration(&Configuration::DEFAULT), no_flash);
    let no_slot = Err(Refusal::Slot(SlotError::NoFlash));
    assert_eq!(board.weights_begin(64), no_slot);
    see(&mut board, Standing::UNKNOWN);
    assert!(!storable(&mut board));
    assert_eq!(board.restart(), Err(Refusal::Moving));
    assert_eq!(flash.borrow().operations(), before);
    let mut absent = Board::new(&SUPPORTED_HARDWARE);
    absent.begin(None, None, Ok(()), IDENTITY);
    absent.weights(None, &DEFAULT.0);
    let about = absent.info();
    assert_eq!((about.flash, about.weights), (FlashState::Absent, WeightSource::BuiltIn));
    assert_eq!(absent.set_configuration(&Configuration::DEFAULT), no_flash);
    assert_eq!([absent.weights_begin(64), absent.weights_verify(|_| ())], [no_slot; 2]);
    assert_eq!(absent.weights_activate(), Err(Refusal::Slot(SlotError::NotBegun)));
}

#[test]
fn identifiers_of_diagnosis_are_three_that_nobody_else_uses() {
    let (_, mut board) = fresh();
    let mut ask = |extended, [request, functional, response]: [u32; 3]| {
        let diagnosis = DiagnosisIds { extended, request, functional, response };
        board.set_configuration(&Configuration { diagnosis, ..Configuration::DEFAULT })
    };
    assert_eq!(ask(false, [0x700, 0x7DF, 0x708]), Ok(()));
    assert_eq!(ask(true, [0x18DA_10F1, 0x18DB_33F1, 0x18DA_F110]), Ok(()));
    for (extended, ids, named) in [
        (false, [0x800, 0x7DF, 0x7E8], 0x800),
        (true, [0x18DA_10F1, 0x18DB_33F1, 1 << 29], 1 << 29),
        (false, [0x7E0, 0x7E0, 0x7E8], 0x7E0),
        (false, [0x7E0, 0x7DF, 0x7E0], 0x7E0),
        // The rate's own.
        (false, [0x7E0, 0x7DF, 0x1A0], 0x7E0),
    ] {
        let refused = Err(Refusal::Store(StoreError::Field(FieldError::Diagnosis(named))));
        assert_eq!(ask(extended, ids), refused, "{ids:x?}");
    }
}

fn see(board: &mut Board, standing: Standing) {
    let at_rest = sample(0, LEVEL, 0.01);
    let wheels = WheelSample::without_speeds(Standstill::Unknown);
    board.observe(Some(&at_rest), 0, GOOD, &wheels, &standing);
}

fn storable(board: &mut Board) -> bool {
    match board.set_configuration(&Configuration::DEFAULT) {
        Ok(()) => true,
        Err(Refusal::Moving) => false,
        other => panic!("{other:?}"),
    }
}

#[test]
fn flash_is_written_at_standstill_alone() {
    let (_, mut board) = fresh();
    assert!(storable(&mut board), "no rate is valid yet");
    let quiet =
        |probability| Standing { source: StandstillSource::Inertial, probability, ..Standing::UNKNOWN };
    let contradicted = Standing { is_contradicted: true, ..Standing::UNKNOWN };
    for (standing, may) in [
        (Standing::UNKNOWN, false),
        (Standing::WHEELS, true),
        (contradicted, false),
        (quiet(0.0), false),
        (quiet(0.5), true),
        (quiet(0.98), true),
    ] {
        see(&mut board, standing);
        assert_eq!(storable(&mut board), may, "{standing:?}");
    }
    see(&mut board, Standing::UNKNOWN);
    // Without a sensor: a bench, a vehicle that drives, whose wheel frames end, and one that stands.
    for (wheels, may) in [
        (Standstill::Unknown, true),
        (Standstill::Moving, false),
        (Standstill::Unknown, false),
        (Standstill::Still, true),
    ] {
        let wheels = WheelSample::without_speeds(wheels);
        board.observe(None, 700, (Status::Silent, Faults::NONE), &wheels, &Standing::UNKNOWN);
        assert_eq!(storable(&mut board), may, "{:?}", wheels.standstill);
    }
    see(&mut board, Standing::UNKNOWN);
    type Request = fn(&mut Board) -> Result<(), Refusal>;
    let requests: [Request; 7] = [
        |board| board.set_wheels(&WheelSettings::TOYOTA),
        |board| board.set_unit(None),
        |board| board.weights_begin(64),
        |board| board.upload_block(&[]),
        Board::weights_activate,
        Board::forget_learned,
        Board::restart,
    ];
    for (number, request) in requests.into_iter().enumerate() {
        assert_eq!(request(&mut board), Err(Refusal::Moving), "{number}");
        assert_eq!(board.refusal(), Some(Refusal::Moving), "testers can read it");
    }
}

/// Each value differs from the default.
#[test]
fn every_setting_reaches_the_coprocessor() {
    let static_init = StaticConfig { gyro_bias: 0.05, ..StaticConfig::DEFAULT };
    let compensate = CompensateConfig { model: false, ..CompensateConfig::DEFAULT };
    let heading = HeadingSettings { nmea2000: true, ..HeadingSettings::NONE };
    let mut can = Settings::DEFAULT;
    can.bits_per_second = 1_000_000;
    let set = Configuration {
        fog: Some(FogPart::Dsp1760),
        can,
        latitude_deg: Some(37.0),
        mounting: Mounting { roll_deg: 0.0, pitch_deg: 0.0, yaw_deg: 90.0 },
        static_init,
        compensate,
        fog_ids: [0x2A0, 0x2A1, 0x2A2],
        fog_gyro: FogGyro { tilt_deg: 10.0 },
        heading,
        ..Configuration::DEFAULT
    };
    let force = [SpecificForce(1), SpecificForce(2), SpecificForce(3)];
    let learned = Learned { specific_force: Some(force), ..Learned::NOTHING };
    let config = set.coprocessor(&Calibration::NONE, &learned, 0);
    assert_eq!(
        (config.can, config.fog_ids, config.fog_expected),
        (Config::new(can).expect("valid"), set.fog_ids, true)
    );
    let (latitude, tilt) = (Latitude::from_degrees(37.0), Tilt::from_degrees(10.0).expect("valid"));
    assert_eq!((config.fog.latitude, config.fog.tilt, config.heading.is_some()), (latitude, tilt, true));
    let pipeline = config.pipeline;
    assert_eq!((pipeline.static_init, pipeline.compensate), (static_init, compensate));
    assert_eq!(pipeline.earth_rate, latitude.map(EarthRate::Subtracted).expect("valid"));
    assert_eq!(Some(pipeline.mounting), set.mounting.rotation());
    assert!(pipeline.levelling && pipeline.rest_force == Some(force));
    let bare = Configuration::DEFAULT.coprocessor(&Calibration::NONE, &learned, 0);
    assert!(!bare.fog_expected && bare.heading.is_none() && bare.fog.latitude.is_none());
}
