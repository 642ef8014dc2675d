//! Records in flash: configuration, calibration, what was learnt, and the accepted weights.

use super::{byte, take};
use crate::flash::{F405, Flash, shared};
use crate::sent::Sent;
use crate::stored::open;
use crate::synthetic::turning;
use gyronet::Coprocessor;
use gyronet::bias::ThermalBias;
use gyronet::heading::Gain;
use gyronet::model::blob::CRC;
use gyronet::mounting::{Forward, GyroMap, Vertical};
use gyronet::sample::ImuSample;
use gyronet::store::layout::{RECORD_SECTOR, STORE};
use gyronet::store::{Accepted, Calibration, Configuration, Learned, Record, UnitMap};
use gyronet::units::{AngularRate, CentiCelsius, SpecificForce};

/// Reads bytes as the content of both sectors, a half each, or as records (key, version, length, content) with valid
/// lengths, headers and checksums, once or until the sector is full, as the first byte says. A record that is read must
/// be within its ranges and usable, and a stored record must be read back.
pub fn flash(mut data: &[u8]) {
    let mut flash = F405::up_to(STORE.end as usize);
    match byte(&mut data) % 4 {
        kind @ (1 | 3) => flash.fill(STORE.start, &fitting(data, kind == 3)),
        _ => {
            let halves = data.split_at(data.len() / 2);
            for (place, half) in (STORE.start..).step_by(RECORD_SECTOR).zip([halves.0, halves.1]) {
                flash.fill(place, &half[..half.len().min(RECORD_SECTOR)]);
            }
        }
    }
    let flash = shared(flash);
    let mut store = open(&flash).expect("the flash answers");
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

fn run(configuration: &Configuration, calibration: &Calibration, learned: &Learned) {
    let weights = calibration.unit.map_or(0, |unit| unit.weights);
    let mut coprocessor = Coprocessor::new(configuration.coprocessor(calibration, learned, weights));
    for tick in 0..3 {
        let temperature = Some(CentiCelsius(2_300));
        let sample = ImuSample { temperature, ..turning(tick, AngularRate(1_000)) };
        coprocessor.imu(sample, sample.time, &mut Sent::default()).expect("the sample is on the grid");
    }
}

/// A sector of the records in these bytes, once or until it is full.
pub fn fitting(mut data: &[u8], is_full: bool) -> Vec<u8> {
    let generation = 1_u32;
    let header = CRC.checksum(&(generation ^ u32::from_le_bytes(*b"GYR1")).to_le_bytes());
    let header = [generation.to_le_bytes(), header.to_le_bytes()].concat();
    let mut records = Vec::new();
    while !data.is_empty() {
        let (key, version) = (byte(&mut data), byte(&mut data));
        let len = usize::from(byte(&mut data));
        let content = take(&mut data, len);
        let mut record = vec![key, version, content.len() as u8, 0];
        record.extend(content);
        record.resize(record.len().next_multiple_of(4), 0xFF);
        record.extend(CRC.checksum(&record).to_le_bytes());
        records.extend(record);
    }
    let times = if is_full { (RECORD_SECTOR - header.len()) / records.len().max(1) } else { 1 };
    [header, records.repeat(times)].concat()
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
    let flash = Flash::default();
    let mut store = open(&flash).expect("the flash answers");
    store.set(&configuration).expect("there is room");
    store.set(&calibration).and_then(|()| store.set(&learned)).expect("there is room");
    let flash = flash.borrow();
    let sectors =
        [0, RECORD_SECTOR].map(|sector| &flash.bytes()[STORE.start as usize + sector..][..RECORD_SECTOR]);
    let used = sectors[0].iter().rposition(|byte| *byte != 0xFF).map_or(0, |last| last + 1);
    let raw = [&[0], &sectors[0][..used], &sectors[1][..used]].concat();
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
