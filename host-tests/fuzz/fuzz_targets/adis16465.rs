//! Any bytes as bursts, as they are and with a sum that fits.
#![no_main]

use gyronet::sensor::adis16465::{BURST, Burst, Model};
use gyronet::units::Micros;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|data: &[u8]| {
    let (bursts, _) = data.as_chunks::<BURST>();
    for bytes in bursts {
        let mut fitting = *bytes;
        let sum: u16 = fitting.iter().take(18).map(|byte| u16::from(*byte)).sum();
        fitting[18..].copy_from_slice(&sum.to_be_bytes());
        for bytes in [*bytes, fitting] {
            if let Ok(burst) = Burst::parse(&bytes) {
                assert_eq!(burst.emit(), bytes);
                for model in [Model::Adis16465_1, Model::Adis16465_2, Model::Adis16465_3, Model::Adis16470] {
                    let _ = burst.sample(model, Micros(0));
                }
            }
        }
    }
});
