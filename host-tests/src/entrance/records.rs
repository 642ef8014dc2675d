//! Reads records in flash: configuration, calibration, what was learnt, and the accepted weights.

use super::{byte, take};
use crate::ram_flash::RamFlash;
use crate::sent::Sent;
use crate::synthetic::turning;
use embedded_storage::nor_flash::ReadNorFlash;
use gyronet::Coprocessor;
use gyronet::bias::ThermalBias;
use gyronet::heading::Gain;
use gyronet::model::blob::CRC;
use gyronet::mounting::{Forward, GyroMap, Vertical};
use gyronet::sample::ImuSample;
use gyronet::store::{Accepted, Calibration, Configuration, Learned, Record, Store, UnitMap};
use gyronet::units::{AngularRate, CentiCelsius, SpecificForce};

/// Size of a sector, smaller than the part's, so that it is soon full.
pub const SECTOR: usize = 1024;
type Flash = RamFlash<SECTOR>;

/// Reads bytes as the content of both sectors or, if the first byte is odd, as records (key, version, length,
/// content) with valid lengths, headers and checksums. A record that is read must be within its ranges and usable,
/// and a stored record must be read back.
pub fn flash(mut data: &[u8]) {
    let flash = if byte(&mut data) & 1 == 0 { Flash::new(data) } else { Flash::new(&fitting(data)) };
    let mut store = Store::open(flash, 0).expect("the flash answers");
    let calibration = store.get::<Calibration>().ok().flatten().unwrap_or_default();
    calibration.check().expect("the store checks what it reads");
    let learned = store.get::<Learned>().ok().flatten().unwrap_or(Learned::NOTHING);
    learned.check().expect("the store checks what it reads");
    if let Ok(Some(configuration)) = store.get::<Configuration>() {
        configuration.check().expect("the store checks what it reads");
        run(&configuration, &calibration, &learned);
    }
    let _ = store.get::<Accepted>();
    if store.set(&Configuration::DEFAULT).is_ok() {
        assert_eq!(store.get(), Ok(Some(Configuration::DEFAULT)));
    }
}

/// Runs a few samples through a coprocessor with this configuration.
fn run(configuration: &Configuration, calibration: &Calibration, learned: &Learned) {
    let weights = calibration.unit.map_or(0, |unit| unit.weights);
    let mut coprocessor = Coprocessor::new(configuration.coprocessor(calibration, learned, weights));
    for tick in 0..3 {
        let temperature = Some(CentiCelsius(2_300));
        let sample = ImuSample { temperature, ..turning(tick, AngularRate(1_000)) };
        coprocessor.imu(sample, sample.time, &mut Sent::default()).expect("the sample is on the grid");
    }
}

fn fitting(mut data: &[u8]) -> Vec<u8> {
    let generation = 1_u32;
    let header = CRC.checksum(&(generation ^ u32::from_le_bytes(*b"GYR1")).to_le_bytes());
    let mut sector = [generation.to_le_bytes(), header.to_le_bytes()].concat();
    while !data.is_empty() {
        let (key, version) = (byte(&mut data), byte(&mut data));
        let len = usize::from(byte(&mut data));
        let content = take(&mut data, len);
        let mut record = vec![key, version, content.len() as u8, 0];
        record.extend(content);
        record.resize(record.len().next_multiple_of(4), 0xFF);
        record.extend(CRC.checksum(&record).to_le_bytes());
        sector.extend(record);
    }
    sector
}

/// Its corpus, as this version of the store writes it.
pub fn seeds() -> [(&'static str, Vec<u8>); 4] {
    let calibration = Calibration { unit: Some(UnitMap { gyro_map: GyroMap::IDENTITY, weights: 0 }) };
    let configuration = Configuration { latitude_deg: Some(48.1), ..Configuration::DEFAULT };
    let mut thermal_bias = ThermalBias::UNKNOWN;
    thermal_bias.add(true, CentiCelsius(2_500), [AngularRate(5), AngularRate(-5), AngularRate(7)]);
    let learned = Learned {
        thermal_bias,
        specific_force: Some([SpecificForce(1 << 20); 3]),
        vertical: Vertical::UNKNOWN,
        forward: Some(Forward { direction: [0.6, 0.8, 0.0], sigma: 0.05 }),
        gain: Some(Gain { share: 0.008, sigma: 0.001, of: 0 }),
    };
    // The first sector, as it is in flash.
    let mut raw = vec![0; 1 + SECTOR];
    let mut flash = Flash::new(&[]);
    let mut store = Store::open(&mut flash, 0);
    if let Ok(store) = &mut store {
        store.set(&configuration).expect("there is room");
        store.set(&calibration).and_then(|()| store.set(&learned)).expect("there is room");
    }
    drop(store);
    flash.read(0, &mut raw[1..]).expect("a range inside the flash");
    while raw.last() == Some(&0xFF) {
        raw.pop();
    }
    let record = |key: u8, version: u8, content: &[u8]| {
        [&[1, key, version, content.len() as u8][..], content].concat()
    };
    // A record in flash: its first word, its content, its checksum.
    let stored = |key: u8, version: u8| {
        let mut at = 1 + 8;
        while raw[at] != key {
            at += 8 + usize::from(raw[at + 2]).next_multiple_of(4);
        }
        record(key, version, &raw[at + 4..][..usize::from(raw[at + 2])])
    };
    [
        ("sectors", raw.clone()),
        ("configuration", stored(Configuration::KEY, Configuration::VERSION)),
        ("calibration", stored(Calibration::KEY, Calibration::VERSION)),
        ("learned", stored(Learned::KEY, Learned::VERSION)),
    ]
}
