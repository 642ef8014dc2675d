//! ADIS16465 and ADIS16470: the burst, and the driver on a mocked bus.

use embedded_hal_mock::eh1::spi::{Mock, Transaction};
use gyronet::sample::Validity;
use gyronet::sensor::adis16465::{Adis16465, AdisError, BURST, Burst, BurstError, DiagStat, Model};
use gyronet::units::{CentiCelsius, Micros};
use proptest::prelude::*;

/// ADIS16465-2: gz +10 deg/s, az 1 g, 25.3 deg C, counter 0x1234.
const VECTOR: [u8; BURST] =
    [0, 0, 0, 0, 0xff, 0xfd, 0x01, 0x90, 0, 0x0c, 0xff, 0xd8, 0x0f, 0xa0, 0, 0xfd, 0x12, 0x34, 0x06, 0x62];

fn burst() -> Burst {
    Burst {
        diagnosis: DiagStat(0),
        rate: [0, -3, 400],
        acceleration: [12, -40, 4000],
        temperature: 253,
        counter: 0x1234,
    }
}

#[test]
fn a_burst_is_read_as_the_data_sheet_says() {
    assert_eq!(Burst::parse(&VECTOR), Ok(burst()));
    assert_eq!(burst().emit(), VECTOR);
    let sample = burst().sample(Model::Adis16465_2, Micros(5)).expect("good");
    assert!((sample.angular_rate[2].rad_per_sec() - 10f64.to_radians()).abs() < 2e-8);
    assert!((sample.specific_force[2].metre_per_sec2() - 9.806_65).abs() < 2e-6);
    assert_eq!((sample.temperature, sample.validity), (Some(CentiCelsius(2530)), Validity::Good));
    assert_eq!(sample.time, Micros(5));
}

#[test]
fn each_model_has_its_own_scale() {
    for (model, rate, acceleration) in [
        (Model::Adis16465_1, 1600, 4000),
        (Model::Adis16465_2, 400, 4000),
        (Model::Adis16465_3, 100, 4000),
        (Model::Adis16470, 100, 800),
    ] {
        let burst = Burst { rate: [0, 0, rate], acceleration: [0, 0, acceleration], ..burst() };
        let sample = burst.sample(model, Micros(0)).expect("good");
        assert!((sample.angular_rate[2].rad_per_sec() - 10f64.to_radians()).abs() < 2e-8, "{model:?}");
        assert!((sample.specific_force[2].metre_per_sec2() - 9.806_65).abs() < 2e-6, "{model:?}");
    }
}

#[test]
fn flags_of_the_part_are_read() {
    for bit in 0..16 {
        let diagnosis = DiagStat(1 << bit);
        let sample = Burst { diagnosis, ..burst() }.sample(Model::Adis16465_2, Micros(0));
        if (4..=7).contains(&bit) {
            assert_eq!(sample, Err(BurstError::Diagnosis(diagnosis)));
        } else {
            assert!(sample.is_ok(), "bit {bit}");
        }
    }
    // Bits 1 to 3 of DIAG_STAT, which spoil no reading.
    assert_eq!([DiagStat::OVERRUN, DiagStat::FLASH_UPDATE, DiagStat::SPI].map(|bit| bit.0), [2, 4, 8]);
    let clipped = Burst { rate: [0, 0, -32_768], ..burst() };
    let sample = clipped.sample(Model::Adis16465_1, Micros(0)).expect("in range");
    assert_eq!(sample.validity, Validity::Saturated);
    assert_eq!(Burst::parse(&[0; BURST]), Err(BurstError::Silent));
    assert_eq!(Burst::parse(&[0xFF; BURST]), Err(BurstError::Silent));
    // 2000 deg/s parts measure more than the pipeline's 916 deg/s: an error, not a wrong number.
    let fast = Burst { rate: [0, 0, 20_000], ..burst() };
    assert!(matches!(fast.sample(Model::Adis16470, Micros(0)), Err(BurstError::Reading(_))));
}

fn read(answer: [u8; BURST]) -> [Transaction<u8>; 4] {
    [
        Transaction::transaction_start(),
        Transaction::write_vec(vec![0x68, 0x00]),
        Transaction::read_vec(answer.to_vec()),
        Transaction::transaction_end(),
    ]
}

#[test]
fn the_driver_reads_a_burst() {
    let next = |counter| Burst { counter, ..burst() }.emit();
    let mut damaged = VECTOR;
    damaged[7] ^= 1;
    let mut spi = Mock::new(
        &[read(VECTOR), read(VECTOR), read(next(0x1235)), read(damaged), read(next(0x1248))].concat(),
    );
    let mut part = Adis16465::new(spi.clone(), Model::Adis16465_2);
    let good = burst().sample(Model::Adis16465_2, Micros(1)).expect("good");
    assert_eq!(part.read(Micros(1)), Ok(good));
    assert_eq!(part.read(Micros(2)), Err(AdisError::Burst(BurstError::Repeated { counter: 0x1234 })));
    assert!(part.read(Micros(3)).is_ok());
    let sums = BurstError::Checksum { computed: 0x0663, stored: 0x0662 };
    assert_eq!(part.read(Micros(4)), Err(AdisError::Burst(sums)));
    assert_eq!(part.lost(), 0);
    assert!(part.read(Micros(5)).is_ok());
    assert_eq!(part.lost(), 0x12);
    spi.done();
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn round_trip_and_damage(
        diagnosis: u16, rate: [i16; 3], acceleration: [i16; 3], temperature: i16, counter: u16
    ) {
        let burst = Burst { diagnosis: DiagStat(diagnosis), rate, acceleration, temperature, counter };
        let bytes = burst.emit();
        prop_assume!(bytes.iter().any(|byte| *byte != 0));
        prop_assert_eq!(Burst::parse(&bytes), Ok(burst));
        // A sum of bytes finds every single flipped bit.
        for bit in 0..BURST * 8 {
            let mut damaged = bytes;
            damaged[bit / 8] ^= 1 << (bit % 8);
            prop_assert!(Burst::parse(&damaged).is_err(), "bit {}", bit);
        }
    }
}
