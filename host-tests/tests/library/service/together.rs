//! Settings that are valid one by one and together: what is accepted can run, in whatever order it is stored.

use super::uds::Bench;
use super::weights::upload as upload_over;
use super::{IDENTITY, fresh, start};
use embedded_can::Id;
use gyronet::can::config::Config;
use gyronet::can::signal::{BitField, ByteOrder};
use gyronet::can::wheel::{WheelConfigError, WheelSettings};
use gyronet::compensate::Stride;
use gyronet::heading::{HeadingConfigError, HeadingSettings, HeadingSignal};
use gyronet::model::blob::Shape;
use gyronet::model::weights;
use gyronet::mounting::GyroMap;
use gyronet::service::message::{FAILED_STARTS, Identity, Origin, Refusal};
use gyronet::service::{Device, SupportedHardware};
use gyronet::store::layout::STORE;
use gyronet::store::slots::{SlotError, WeightSource};
use gyronet::store::{Configuration, FieldError, FogPart, ImuPart, Slot, StoreError, UnitMap};
use gyronet_host_tests::flash::{F405, Flash, Region, shared};
use gyronet_host_tests::noise::Noise;
use gyronet_host_tests::recordings::workspace;
use gyronet_host_tests::settings;
use gyronet_host_tests::stored::{open, other_weights, slots, upload};
use gyronet_host_tests::wire::id11;
use std::collections::{BTreeMap, HashSet};

const HZ: u32 = 168_000_000;
const HARDWARE: SupportedHardware = SupportedHardware {
    imus: &[ImuPart::XsensMti],
    fogs: &[FogPart::Dsp1760],
    gnss: true,
    fd: true,
    clock_hz: HZ,
};

const NO_WHEELS: WheelSettings =
    WheelSettings { frames: [None; 4], signals: [None; 4], ..WheelSettings::TOYOTA };

type Board = Device<Region, Region>;

fn board(built_in: &[u8]) -> Board {
    let mut board = Board::new(&HARDWARE);
    board.begin(Some(Region::new(&shared(F405::up_to(STORE.end as usize)), STORE)), None, Ok(()), IDENTITY);
    assert!(board.weights(None, built_in).is_some());
    board
}

fn reason(result: Result<(), Refusal>) -> String {
    let Err(Refusal::Store(StoreError::Field(error))) = result else { panic!("{result:?}") };
    format!("{error:?}").chars().take_while(|letter| letter.is_alphabetic() || *letter == '(').collect()
}

/// Every identifier that the board sends or takes must be one of its own; inputs may share a frame.
fn are_distinct(configuration: &Configuration, wheels: &WheelSettings) -> bool {
    let can = Config::new(configuration.can).expect("it was accepted");
    let mut seen = HashSet::new();
    let mut all: Vec<Id> = can.messages().iter().map(|message| message.id).collect();
    all.extend(configuration.fog_ids.map(id11));
    all.extend(configuration.diagnosis.ids().expect("they were accepted"));
    let inputs: HashSet<Id> = wheels
        .frames
        .iter()
        .flatten()
        .map(|frame| frame.id)
        .chain(configuration.heading.filters().map(|(id, _)| id))
        .collect();
    all.extend(inputs);
    all.into_iter().all(|id| seen.insert(id))
}

/// The measured cost of a window (`cargo bench-target`), cycles, by the number of units.
fn measured() -> BTreeMap<u16, u32> {
    let page =
        std::fs::read_to_string(workspace().join("tools/MEASUREMENTS.md")).expect("it is in the repository");
    let (_, table) = page.split_once("| linear part and units a direction |").expect("the table");
    let rows = table.lines().skip(2).take_while(|line| line.starts_with('|'));
    rows.map(|row| {
        let cells: Vec<&str> = row.split('|').map(str::trim).collect();
        let units: String = cells[1].chars().take_while(char::is_ascii_digit).collect();
        (units.parse().expect("units"), cells[3].replace(',', "").parse().expect("cycles"))
    })
    .collect()
}

#[test]
fn the_cost_of_a_window_is_never_more_than_stated() {
    let measured = measured();
    assert!(measured.len() >= 5, "{measured:?}");
    for (units, cycles) in measured {
        let stated = Shape { units, linear: units < 60 }.window_cycles();
        assert!((cycles..cycles + cycles / 4 + 1_000).contains(&stated), "{units} units: {cycles}, {stated}");
    }
}

/// 10,000 configurations of values that are valid one by one, with wheels and either model, stored in both orders.
#[test]
fn what_is_accepted_together_can_run() {
    let mut models = [(board(&weights::DEFAULT.0), 0), (board(&weights::GYRONET.0), 60)];
    let measured = measured();
    let (mut accepted, mut reasons) = (0, BTreeMap::<String, usize>::new());
    for seed in 0..10_000 {
        let mut noise = Noise::new(seed);
        let (configuration, wheels) = (settings::configuration(&mut noise), settings::wheels(&mut noise));
        let (board, units) = &mut models[seed as usize % 2];
        let mut store = |wheels_first: bool| {
            board.set_wheels(&NO_WHEELS)?;
            board.set_configuration(&Configuration::DEFAULT)?;
            if wheels_first {
                board.set_wheels(&wheels)?;
                board.set_configuration(&configuration)
            } else {
                board.set_configuration(&configuration)?;
                board.set_wheels(&wheels)
            }
        };
        let (stored, wheels_first) = (store(false), store(true));
        let runs = |configuration: &Configuration| {
            let time = f64::from(configuration.compensate.stride.delay()) * 0.01;
            let fits = f64::from(measured[units]) / f64::from(HZ) < 0.75 * time;
            fits && are_distinct(configuration, &wheels)
        };
        if stored.is_ok() {
            assert!(runs(&configuration), "{seed}: {configuration:?} {wheels:?}");
            accepted += 1;
        } else {
            assert!(wheels_first.is_err(), "{seed}: the order decides");
            *reasons.entry(reason(stored)).or_default() += 1;
        }
    }
    println!("{accepted} of 10000 accepted; refused: {reasons:?}");
    assert!(accepted > 500 && reasons.len() >= 4, "{accepted}, {reasons:?}");
}

#[test]
fn neither_order_makes_the_board_send_what_it_receives() {
    let wheels = |raw: u16| {
        let mut wheels = WheelSettings::TOYOTA;
        wheels.frames[0].as_mut().expect("a frame").id = id11(raw);
        wheels
    };
    let own =
        |raw: u32| Err(Refusal::Store(StoreError::Field(FieldError::Wheels(WheelConfigError::Own(raw)))));
    let mut configuration = Configuration { fog_ids: [0xAA, 0x1A5, 0x1A6], ..Configuration::DEFAULT };
    let mut board = board(&weights::DEFAULT.0);
    assert_eq!(board.set_configuration(&configuration), own(0xAA), "the built-in wheel frame");
    assert_eq!(board.set_wheels(&wheels(0xB0)), Ok(()));
    assert_eq!(board.set_configuration(&configuration), Ok(()));
    assert_eq!(board.set_wheels(&WheelSettings::TOYOTA), own(0xAA), "of the next configuration");
    for raw in [0x7E0, 0x7DF, 0x7E8, 0x1A0, 0x1A5] {
        assert_eq!(board.set_wheels(&wheels(raw)), own(raw.into()), "diagnosis, and messages");
    }
    configuration.diagnosis.request = 0xB0;
    assert_eq!(board.set_configuration(&configuration), own(0xB0), "of the next wheels");
    let refused =
        |configuration: &Configuration, board: &mut Board| match board.set_configuration(configuration) {
            Err(Refusal::Store(StoreError::Field(FieldError::Heading(error)))) => error,
            other => panic!("{other:?}"),
        };
    let field = BitField::new(0, 16, ByteOrder::Intel, false).expect("inside the frame");
    let signal = |raw| HeadingSignal { id: id11(raw), field, factor: 1e-4, offset: 0.0, invalid: None };
    for raw in [0x7E0, 0x7DF, 0x7E8, 0x1A0, 0x1A5] {
        let heading = HeadingSettings { speed: Some(signal(raw)), ..HeadingSettings::NONE };
        let configuration = Configuration { heading, ..Configuration::DEFAULT };
        assert_eq!(refused(&configuration, &mut board), HeadingConfigError::Own(raw.into()));
    }
    // A parameter group is one of many identifiers.
    let mut configuration = Configuration::DEFAULT;
    configuration.heading.j1939 = true;
    configuration.diagnosis.extended = true;
    configuration.diagnosis.request = 0x18FE_E855;
    assert_eq!(refused(&configuration, &mut board), HeadingConfigError::Own(0x18FE_E855));
    configuration.diagnosis.request = 0x18DA_10F1;
    assert_eq!(board.set_configuration(&configuration), Ok(()));
    let heading = HeadingSettings { course: Some(signal(0x300)), ..HeadingSettings::NONE };
    let configuration = Configuration { heading, ..Configuration::DEFAULT };
    assert_eq!(refused(&configuration, &mut board), HeadingConfigError::NoSpeed);
    for factor in [0.0, f32::NAN, 1e9] {
        let speed = Some(HeadingSignal { factor, ..signal(0x300) });
        let heading = HeadingSettings { speed, ..HeadingSettings::NONE };
        let configuration = Configuration { heading, ..Configuration::DEFAULT };
        assert_eq!(refused(&configuration, &mut board), HeadingConfigError::Scale(0x300));
    }
}

/// Records that do not fit each other, as a tool may have put them into the flash.
#[test]
fn a_start_uses_what_fits_and_reports_the_rest() {
    let mut costly = Configuration { fog_ids: [0xAA, 0x1A5, 0x1A6], ..Configuration::DEFAULT };
    costly.compensate.stride = Stride::new(1).expect("a sample");
    let flash = Flash::default();
    upload(&flash, Slot::A, &other_weights(1)).expect("it is stored");
    open(&flash).and_then(|mut store| store.set(&costly)).expect("it is stored");
    let mut board = start(&flash);
    let info = board.info();
    assert_eq!((info.configuration, info.weights), (Origin::Stored, WeightSource::BuiltIn));
    let slow = |error| matches!(error, Some(SlotError::Slow { cycles, available }) if cycles > available);
    assert!(slow(info.refused_slots[0]) && board.stored_damaged(), "{info:?}");
    assert!(matches!(info.wheels, Origin::Refused(StoreError::Field(FieldError::Wheels(_)))));
    assert_eq!(board.wheels().frames, [None; 4], "no frame of its own is taken for the wheels");
    // And nothing heavier may be stored beside it.
    assert!(matches!(
        board.set_configuration(&costly),
        Err(Refusal::Store(StoreError::Field(FieldError::Wheels(_))))
    ));
    assert_eq!(board.set_wheels(&NO_WHEELS), Ok(()));
    let window = board.set_configuration(&costly);
    assert!(
        matches!(window, Err(Refusal::Store(StoreError::Field(FieldError::Window { .. })))),
        "{window:?}"
    );
}

#[test]
fn weights_that_are_too_slow_for_the_stride_are_not_activated() {
    let (_, mut board) = fresh();
    let mut configuration = Configuration::DEFAULT;
    configuration.compensate.stride = Stride::new(1).expect("a sample");
    assert_eq!(board.set_configuration(&configuration), Ok(()), "with the built-in weights");
    let file = other_weights(1);
    assert_eq!(upload_over(&mut board, &file), Ok(()));
    assert!(matches!(board.weights_activate(), Err(Refusal::Slot(SlotError::Slow { .. }))));
    assert_eq!(board.set_configuration(&Configuration::DEFAULT), Ok(()));
    assert_eq!(board.weights_activate(), Ok(()));
    let window = board.set_configuration(&configuration);
    assert!(
        matches!(window, Err(Refusal::Store(StoreError::Field(FieldError::Window { .. })))),
        "{window:?}"
    );
}

fn started(flash: &Flash, identity: Identity) -> super::Board {
    let mut board = super::Board::new(&super::SUPPORTED_HARDWARE);
    board.begin(Some(Region::new(flash, STORE)), None, Ok(()), identity);
    assert!(board.weights(Some(slots(&flash.borrow())), &weights::DEFAULT.0).is_some());
    board
}

#[test]
fn three_failed_starts_leave_the_bus_as_it_is_and_the_rest_built_in() {
    let flash = Flash::default();
    let mut stored = Configuration { latitude_deg: Some(48.0), ..Configuration::DEFAULT };
    stored.diagnosis.request = 0x700;
    stored.can.bits_per_second = 250_000;
    open(&flash).and_then(|mut store| store.set(&stored)).expect("it is stored");
    upload(&flash, Slot::A, &other_weights(1)).expect("it is stored");
    let start = |failed_starts| started(&flash, Identity { failed_starts, ..IDENTITY });
    let board = start(FAILED_STARTS - 1);
    assert_eq!((*board.configuration(), board.info().weights), (stored, WeightSource::Slot(Slot::A)));
    let mut board = start(FAILED_STARTS);
    let info = board.info();
    assert_eq!(info.configuration, Origin::Refused(StoreError::Resets));
    assert_eq!(info.weights, WeightSource::BuiltIn);
    assert!(board.stored_damaged() && board.configuration_lost());
    let Configuration { can, diagnosis, latitude_deg, learn, .. } = *board.configuration();
    assert_eq!((can, diagnosis, latitude_deg, learn), (stored.can, stored.diagnosis, None, false));
    // What is stored stays, until the owner stores another one.
    assert_eq!(*board.next_configuration(), stored);
    assert_eq!(board.set_configuration(&Configuration::DEFAULT), Ok(()));
    assert_eq!(*start(0).configuration(), Configuration::DEFAULT);
}

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
