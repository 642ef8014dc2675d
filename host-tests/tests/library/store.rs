//! Records: ranges, versions, damage, and where they lie.

use embedded_storage::nor_flash::{NorFlash, NorFlashErrorKind};
use gyronet::bias::ThermalBias;
use gyronet::can::config::{ConfigError, YawSettings};
use gyronet::can::wheel::{WheelConfigError, WheelSettings};
use gyronet::store::firmware;
use gyronet::store::layout::{self, RECORD_SECTOR, SECTORS, SLOT_SIZE, sector_at};
use gyronet::store::slots::{SlotError, file, select};
use gyronet::store::{
    Accepted, Access, Configuration, Field, FieldError, FlashFault, Learned, Mounting, Record, Slot, Store,
    StoreError,
};
use gyronet::units::{AngularRate, CentiCelsius, SpecificForce};
use gyronet_host_tests::entrance::records;
use gyronet_host_tests::flash::{F405, Flash, Region};
use gyronet_host_tests::noise::{Noise, cases};
use gyronet_host_tests::recordings::workspace;
use proptest::prelude::*;

fn region(flash: &Flash) -> Region {
    Region::new(flash, layout::STORE)
}

fn open(flash: &Flash) -> Store<Region> {
    Store::open(region(flash), 0).expect("the flash answers")
}

#[test]
fn layout_is_the_linker_s() {
    let text = std::fs::read_to_string(workspace().join("src/bin/stm32f405/regions.x"))
        .expect("it is in the repository");
    let (base, room) = (layout::FLASH_BASE, firmware::TRAILER);
    assert!(text.contains(&format!("_slot : {base:#010x}, LENGTH = DEFINED(_slot) ? 256K - {room} : 1024K")));
    let read = |path: &str| std::fs::read_to_string(workspace().join(path)).expect("it is too");
    let build = read("src/bin/build.rs").replace('_', "");
    let [a, b] = Slot::ALL.map(|slot| base + slot.firmware().start);
    assert!(build.contains(&format!("const FIRMWARE: [u32; 2] = [{a:#010x}, {b:#010x}];")), "{a:x} {b:x}");
    let limits = read("src/bin/stm32f405/slots.x");
    let code = (firmware::LABEL + firmware::LABEL_SIZE).next_multiple_of(32);
    let [a, b] = Slot::ALL.map(|slot| base + slot.firmware().start + firmware::MAX_IMAGE);
    for text in [
        format!("_stext == ORIGIN(FLASH) + {code:#x},"),
        format!(".label ORIGIN(FLASH) + {:#x} :", firmware::LABEL),
        format!("BOOT      : ORIGIN = {base:#010X}, LENGTH = {}K", layout::BOOT_SIZE >> 10),
        format!("TRAILER_A : ORIGIN = {a:#010X}, LENGTH = {room}"),
        format!("TRAILER_B : ORIGIN = {b:#010X}, LENGTH = {room}"),
    ] {
        assert!(limits.contains(&text), "{text}");
    }
    assert_eq!(SECTORS.iter().sum::<u32>(), 1 << 20);
    // Boot loader, records, three sectors without use, firmware B, firmware A, weights.
    let begins = [layout::STORE, layout::FIRMWARE_B, layout::FIRMWARE_A, layout::SLOTS]
        .map(|range| (sector_at(range.start), sector_at(range.end)));
    assert_eq!(begins, [(Some(1), Some(3)), (Some(6), Some(8)), (Some(8), Some(10)), (Some(10), None)]);
    assert_eq!(layout::SLOTS.end, 1 << 20);
    assert_eq!([layout::FIRMWARE_A.len(), layout::FIRMWARE_B.len()], [256 << 10; 2]);
    let sizes = |range: std::ops::Range<u32>, size: usize| {
        let starts: Vec<u32> = range.step_by(size).collect();
        starts
            .iter()
            .map(|start| SECTORS[usize::from(sector_at(*start).expect("a sector"))])
            .collect::<Vec<_>>()
    };
    assert_eq!(sizes(layout::STORE, RECORD_SECTOR), [16 << 10; 2]);
    assert_eq!(sizes(layout::SLOTS, SLOT_SIZE), [128 << 10; 2]);
    assert_eq!((sector_at(0x4000), sector_at(0x4004), sector_at(0x8_0000)), (Some(1), None, Some(8)));
}

#[test]
fn a_value_out_of_its_range_is_refused() {
    let default = Configuration::DEFAULT;
    let tilted = |roll_deg, pitch_deg, yaw_deg| Configuration {
        mounting: Mounting { roll_deg, pitch_deg, yaw_deg },
        ..default
    };
    let mut noisy = default;
    noisy.static_init.gyro_std = 0.0;
    let cases = [
        (Configuration { latitude_deg: Some(90.5), ..default }, Field::LatitudeDeg),
        (Configuration { latitude_deg: Some(f32::NAN), ..default }, Field::LatitudeDeg),
        (tilted(180.1, 0.0, 0.0), Field::MountingRollDeg),
        (tilted(0.0, f32::NEG_INFINITY, 0.0), Field::MountingPitchDeg),
        (tilted(0.0, 0.0, -181.0), Field::MountingYawDeg),
        (noisy, Field::StaticGyroStd),
    ];
    let flash = Flash::default();
    let mut store = open(&flash);
    for (configuration, named) in cases {
        match store.set(&configuration) {
            Err(StoreError::Field(error @ FieldError::Range { field, .. })) => {
                assert_eq!(field, named);
                assert!(error.to_string().starts_with(named.name()), "{error}");
            }
            other => panic!("{named:?}: {other:?}"),
        }
    }
    let mut can = default.can;
    can.yaw = can.yaw.map(|yaw| YawSettings { period_ms: 15, ..yaw });
    let refused = store.set(&Configuration { can, ..default });
    assert_eq!(refused, Err(StoreError::Field(FieldError::Can(ConfigError::Period(15)))));
    let mut thermal_bias = ThermalBias::UNKNOWN;
    (0..100).for_each(|_| thermal_bias.add(true, CentiCelsius(11_000), [AngularRate(i32::MAX); 3]));
    let wild = Learned { thermal_bias, ..Learned::NOTHING };
    let refused = Err(StoreError::Field(FieldError::Implausible(Field::ThermalBias)));
    assert_eq!(store.set(&wild), refused);
    let none = WheelSettings { signals: [None; 4], ..WheelSettings::TOYOTA };
    let refused = StoreError::Field(FieldError::Wheels(WheelConfigError::Wheels(0)));
    assert_eq!(store.set(&none), Err(refused));
    assert_eq!(flash.borrow().operations(), 0, "nothing was written");
}

/// A configuration of layout 6, which could choose FoGNet, is not misread: fields are missing in its middle. Nor is one of a
/// later firmware.
#[test]
fn another_layout_is_refused_by_its_number() {
    let content = postcard::to_stdvec(&Configuration::DEFAULT).expect("it fits");
    for version in (1..=u8::MAX).filter(|version| *version != Configuration::VERSION) {
        let mut store = open(&written(version, &content));
        let refused = StoreError::Version { found: version, expected: Configuration::VERSION };
        assert_eq!(store.get::<Configuration>(), Err(refused));
        // A new one takes its place.
        store.set(&Configuration::DEFAULT).expect("it is stored");
        assert_eq!(store.get(), Ok(Some(Configuration::DEFAULT)));
    }
}

fn written(version: u8, content: &[u8]) -> Flash {
    let flash = Flash::default();
    let record = [&[Configuration::KEY, version, content.len() as u8], content].concat();
    region(&flash).write(0, &records::fitting(&record, false)).expect("it is blank");
    flash
}

proptest! {
    #![proptest_config(cases(200))]

    /// Sectors full of anything: nothing is read, nothing panics, and a record can be stored.
    #[test]
    fn sectors_full_of_anything(seed in any::<u64>(), sparse in any::<bool>()) {
        let flash = Flash::default();
        let mut noise = Noise::new(seed);
        let content: Vec<u8> = (0..2 * RECORD_SECTOR)
            .map(|_| if sparse && noise.byte() > 3 { 0xFF } else { noise.byte() })
            .collect();
        region(&flash).write(0, &content).expect("it is blank");
        let mut store = open(&flash);
        prop_assert_eq!(store.get::<Configuration>(), Ok(None));
        prop_assert_eq!(store.set(&Configuration::DEFAULT), Ok(()));
        prop_assert_eq!(open(&flash).get::<Configuration>(), Ok(Some(Configuration::DEFAULT)));
    }
}

#[test]
fn slots_are_checked() {
    let mut flash = F405::default();
    let start = layout::SLOTS.start as usize;
    let built_in = &gyronet::model::weights::GYRONET.0;
    let slots = |flash: &F405| -> [Vec<u8>; 2] {
        [0, SLOT_SIZE].map(|offset| flash.bytes()[start + offset..][..SLOT_SIZE].to_vec())
    };
    let [a, _] = slots(&flash);
    assert_eq!(file(&a).err(), Some(SlotError::Empty));
    flash.damage(start + 3, 0xFF);
    let [a, _] = slots(&flash);
    assert_eq!(file(&a).err(), Some(SlotError::Length(u32::MAX)));
    // A file that nobody accepted is not used, however good it is.
    let shared = Flash::default();
    Region::new(&shared, layout::SLOTS).write(0, built_in).expect("it is blank");
    let held = shared.borrow();
    let bytes = &held.bytes()[start..];
    let slots = [&bytes[..SLOT_SIZE], &bytes[SLOT_SIZE..]];
    let crc = file(slots[0]).expect("a whole file").crc;
    let selection = select(&Accepted::NONE, slots, built_in, u32::MAX);
    assert_eq!(selection.source, gyronet::store::slots::WeightSource::BuiltIn);
    let selection = select(&Accepted::NONE.with(Slot::A, crc ^ 1), slots, built_in, u32::MAX);
    assert_eq!(selection.source, gyronet::store::slots::WeightSource::BuiltIn);
    assert_eq!(selection.refused, [Some(SlotError::NotAccepted(crc)), None]);
}

#[test]
fn a_start_makes_room_where_little_is_left() {
    let flash = Flash::default();
    let mut store = open(&flash);
    let learned = Learned::NOTHING;
    store.set(&learned).expect("it is stored");
    // Each of the two sectors is full once.
    for turn in 0..2 {
        while store.has_room() {
            store.set(&learned).expect("it is stored");
        }
        let before = flash.borrow().operations();
        store.make_room().expect("the flash answers");
        assert!(store.has_room() && flash.borrow().operations() > before, "turn {turn}");
        let after = flash.borrow().operations();
        store.make_room().expect("the flash answers");
        assert_eq!(flash.borrow().operations(), after, "turn {turn}: there is room");
        let latitude = Configuration { latitude_deg: Some(turn as f32), ..Configuration::DEFAULT };
        store.set(&latitude).expect("it is stored without a read before");
        let mut restarted = open(&flash);
        assert_eq!(restarted.get(), Ok(Some(latitude)), "turn {turn}");
        assert_eq!(restarted.get::<Learned>(), Ok(Some(learned)), "turn {turn}");
        assert!(!restarted.damaged(), "turn {turn}");
    }
}

#[test]
fn sectors_of_zeros_are_damaged() {
    let flash = Flash::default();
    for offset in layout::STORE {
        flash.borrow_mut().damage(offset as usize, 0xFF);
    }
    let mut store = open(&flash);
    assert!(store.damaged(), "a raw image of the flash has overwritten the records");
    // A record mends one of the two, the next start the other; whether there was a key is not known.
    store.set(&Configuration::DEFAULT).expect("it is stored");
    assert!(store.damaged());
    let mut store = open(&flash);
    assert!(store.make_room().is_ok() && !store.damaged() && !open(&flash).damaged());
    assert_eq!(store.get::<Access>(), Err(StoreError::Lost));
}

#[test]
fn a_fault_of_the_flash_keeps_its_kind() {
    let kinds = [NorFlashErrorKind::NotAligned, NorFlashErrorKind::OutOfBounds, NorFlashErrorKind::Other];
    let faults = [FlashFault::NotAligned, FlashFault::OutOfBounds, FlashFault::Refused];
    assert_eq!(kinds.map(FlashFault::from), faults);
}

#[test]
fn a_reading_at_rest_that_repeats_stays_the_same() {
    let force = [100, -200, 1_000_000].map(SpecificForce);
    let mut learned = Learned::NOTHING;
    (0..3).for_each(|_| learned.add_standstill(force));
    assert_eq!(learned.specific_force, Some(force));
}
