//! The scale of the expected error: powers of two, what the integer network makes of the log that
//! its weights give, up to both ends of the range, and the network that comes with the library.

use gyronet::model::blob::{CRC, HIDDEN};
use gyronet::model::window::{FEATURES, WINDOW};
use gyronet::model::{Blob, GyroNet, SCALE_MAX, SCALE_MIN, WindowNetwork, weights};
use gyronet::nn::Aligned;
use gyronet::nn::dense::Dense;
use gyronet::nn::exp2::{FRACTION_BITS, times_exp2};

const LEN: usize = weights::GYRONET.0.len();

#[test]
fn the_power_of_two_is_within_its_bound() {
    let mut largest: f64 = 0.0;
    let mut before = 0;
    for exponent in -(3 << FRACTION_BITS)..4 << FRACTION_BITS {
        let power = times_exp2(1 << 26, exponent);
        let exact = f64::from(1 << 26) * (f64::from(exponent) / f64::from(1 << FRACTION_BITS)).exp2();
        largest = largest.max((f64::from(power) / exact - 1.0).abs());
        assert!(power >= before, "a step down at {exponent}");
        before = power;
    }
    println!("largest relative error {largest:.2e}");
    assert!(largest < 1.3e-4);
    for whole in -5..=5 {
        assert_eq!(times_exp2(1 << 20, whole << FRACTION_BITS), 1 << (20 + whole));
    }
}

#[test]
fn powers_beyond_the_range_saturate() {
    for unit in [0, 1, 1 << 20, u32::MAX] {
        assert_eq!(times_exp2(unit, i32::MIN), 0);
        assert_eq!(times_exp2(unit, i32::MAX), if unit == 0 { 0 } else { i32::MAX });
    }
}

/// The scale of a window when the log's row has no weights and its bias alone speaks: a log2 of
/// `log` in units of `unit` (rate code), in codes.
fn scale_of(unit: u32, log: f64) -> i32 {
    let mut file = Box::new(Aligned(weights::GYRONET.0));
    let row = LEN - 4 - 4 - 8 - 4 * HIDDEN;
    // The steps' codes are summed; an accumulator's LSB is 2^-20 of a unit.
    let multiplier = 1i32 << (Dense::SHIFT + FRACTION_BITS - 20);
    let bias = (log / WINDOW as f64 * f64::from(1 << 20)).round() as i32;
    file.0[row..row + 4 * HIDDEN].fill(0);
    let words = [bias as u32, multiplier as u32, unit].map(u32::to_le_bytes);
    file.0[row + 4 * HIDDEN..LEN - 4].copy_from_slice(words.as_flattened());
    let crc = CRC.checksum(&file.0[..LEN - 4]);
    file.0[LEN - 4..].copy_from_slice(&crc.to_le_bytes());
    let mut network = GyroNet::new(Blob::new_checked(&file.0).expect("it is good"));
    network.estimate(&[[0; FEATURES]; WINDOW]).scale.0
}

#[test]
fn the_scale_is_the_unit_times_the_power() {
    for unit in [1_000u32, 1 << 20, 7_654_321] {
        for log in [-9.0f64, -1.5, -0.001, 0.0, 0.25, 3.0] {
            let expected = f64::from(unit) * log.exp2();
            let expected = expected.clamp(f64::from(SCALE_MIN.0), f64::from(SCALE_MAX.0));
            let found = f64::from(scale_of(unit, log));
            assert!((found - expected).abs() <= 1.0 + 2e-4 * expected, "{found} is not {expected}");
        }
    }
}

#[test]
fn a_scale_stays_in_its_range() {
    assert_eq!(scale_of(1 << 20, -40.0), SCALE_MIN.0);
    assert_eq!(scale_of(0, 0.0), SCALE_MIN.0);
    assert_eq!(scale_of(1 << 20, 40.0), SCALE_MAX.0);
    assert_eq!(scale_of(u32::MAX, 20_000.0), SCALE_MAX.0);
    assert_eq!(scale_of(u32::MAX, -20_000.0), SCALE_MIN.0);
    assert_eq!((SCALE_MIN.rad_per_sec(), SCALE_MAX.rad_per_sec()), (1.0 / f64::from(1 << 20), 1.0));
}
