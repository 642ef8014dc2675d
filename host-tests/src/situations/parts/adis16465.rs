//! Bursts of an ADIS16465-2, and a simulated SPI bus for the driver.
//!
//! The part sends 16 bits of each reading and no time: the driver stamps a sample with the time of its read.

use embedded_hal::spi::{ErrorType, Operation, SpiDevice};
use gyronet::sample::ImuSample;
use gyronet::sensor::adis16465::{BURST, Burst, DiagStat, Model};
use gyronet::units::STANDARD_GRAVITY;
use std::convert::Infallible;
use std::sync::{Arc, Mutex, PoisonError};

/// The simulated model has a range of 500 deg/s.
pub const MODEL: Model = Model::Adis16465_2;
/// The reported temperature, counts of 0.1 deg C: room temperature.
const TEMPERATURE: i16 = 250;

/// Returns the counts in one rad/s and in one m/s^2.
fn counts() -> [f64; 2] {
    let per_rad = f64::from(MODEL.counts_per_dps()).to_degrees();
    [per_rad, f64::from(MODEL.counts_per_g()) / f64::from(STANDARD_GRAVITY)]
}

/// Encodes a sample as a burst, with the readings rounded to the part's steps.
pub fn burst(number: usize, sample: &ImuSample) -> Burst {
    let [per_rad, per_force] = counts();
    let count = |value: f64| libm::round(value) as i16;
    Burst {
        diagnosis: DiagStat::default(),
        rate: sample.angular_rate.map(|rate| count(rate.rad_per_sec() * per_rad)),
        acceleration: sample.specific_force.map(|force| count(force.metre_per_sec2() * per_force)),
        temperature: TEMPERATURE,
        counter: number as u16,
    }
}

/// A simulated SPI bus on which every read returns the same bytes until others are set.
#[derive(Debug, Clone, Default)]
pub struct Bus(Arc<Mutex<[u8; BURST]>>);

impl Bus {
    /// Sets the bytes of the next reads.
    pub fn answer(&self, burst: [u8; BURST]) {
        *self.0.lock().unwrap_or_else(PoisonError::into_inner) = burst;
    }
}

impl ErrorType for Bus {
    type Error = Infallible;
}

impl SpiDevice for Bus {
    fn transaction(&mut self, operations: &mut [Operation<'_, u8>]) -> Result<(), Infallible> {
        let burst = *self.0.lock().unwrap_or_else(PoisonError::into_inner);
        for operation in operations {
            if let Operation::Read(to) = operation {
                to.iter_mut().zip(burst).for_each(|(to, byte)| *to = byte);
            }
        }
        Ok(())
    }
}
