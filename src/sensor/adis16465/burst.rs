//! The burst of an ADIS16465 or ADIS16470 has twenty bytes, big-endian.
//!
//! | offset | content |
//! |---|---|
//! | 0 | DIAG_STAT |
//! | 2 | i16 rate x, y, z |
//! | 8 | i16 specific force x, y, z |
//! | 14 | i16 temperature, 0.1 deg C |
//! | 16 | data counter |
//! | 18 | sum of the 18 bytes before, modulo 2^16 |
//!
//! Eighteen zeros have the sum zero, so the checksum alone would accept them. All-zero and all-one bursts are
//! therefore refused: an unpowered sensor or a broken line reads like that.

use crate::sample::{ImuSample, Validity};
use crate::units::{AngularRate, CentiCelsius, Micros, RangeError, STANDARD_GRAVITY, SpecificForce};

/// Length of a burst without the command, bytes.
pub const BURST: usize = 20;
/// Number of bytes that the checksum covers.
const SUMMED: usize = 18;

/// The sensor model, which determines the scales.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Model {
    /// ADIS16465-1: 125 deg/s.
    Adis16465_1,
    /// ADIS16465-2: 500 deg/s.
    Adis16465_2,
    /// ADIS16465-3: 2000 deg/s.
    Adis16465_3,
    /// ADIS16470: 2000 deg/s, 40 g.
    Adis16470,
}

impl Model {
    /// Returns the counts per deg/s.
    #[must_use]
    pub const fn counts_per_dps(self) -> f32 {
        match self {
            Self::Adis16465_1 => 160.0,
            Self::Adis16465_2 => 40.0,
            Self::Adis16465_3 | Self::Adis16470 => 10.0,
        }
    }

    /// Returns the counts per g.
    #[must_use]
    pub const fn counts_per_g(self) -> f32 {
        match self {
            Self::Adis16465_1 | Self::Adis16465_2 | Self::Adis16465_3 => 4000.0,
            Self::Adis16470 => 800.0,
        }
    }
}

/// The diagnostic flags of the sensor; reading clears them.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct DiagStat(pub u16);

impl DiagStat {
    /// Data were not fetched in time, or were overwritten.
    pub const OVERRUN: Self = Self(1 << 1);
    /// A write to the sensor's flash failed.
    pub const FLASH_UPDATE: Self = Self(1 << 2);
    /// A transfer had a wrong number of clocks.
    pub const SPI: Self = Self(1 << 3);
    /// The supply voltage is too low.
    pub const STANDBY: Self = Self(1 << 4);
    /// The self-test of the sensors failed.
    pub const SELF_TEST: Self = Self(1 << 5);
    /// The sensor's program memory is corrupt.
    pub const MEMORY: Self = Self(1 << 6);
    /// The clocks disagree.
    pub const CLOCK: Self = Self(1 << 7);
    /// The bits that make readings unusable. An overrun, a failed write to flash or an SPI error concerns another
    /// transfer, because the checksum of this one is correct.
    pub const FATAL: Self = Self(Self::STANDBY.0 | Self::SELF_TEST.0 | Self::MEMORY.0 | Self::CLOCK.0);

    /// Returns whether any of these bits is set.
    #[must_use]
    pub const fn intersects(self, other: Self) -> bool {
        self.0 & other.0 != 0
    }
}

/// The reason why bytes are not a burst, or a burst gives no sample.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum BurstError {
    /// The checksum is wrong.
    #[error("ADIS164xx: the bytes add up to {computed:04x}, but the burst says {stored:04x}")]
    Checksum {
        /// The sum computed over the bytes.
        computed: u16,
        /// The sum in the burst.
        stored: u16,
    },
    /// The bytes are all zeros or all ones: no sensor answers.
    #[error("ADIS164xx: no sensor answers")]
    Silent,
    /// The sensor reports that its readings are unusable.
    #[error("ADIS164xx: DIAG_STAT {:04x}", .0.0)]
    Diagnosis(DiagStat),
    /// The data counter has not advanced: the readings are the same as before.
    #[error("ADIS164xx: the data counter did not advance from {counter}")]
    Repeated {
        /// The counter.
        counter: u16,
    },
    /// A reading is out of range.
    #[error("ADIS164xx: a reading is {0}")]
    Reading(RangeError),
}

/// A burst in raw counts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Burst {
    /// Diagnostic flags.
    pub diagnosis: DiagStat,
    /// Angular rate about x, y, z.
    pub rate: [i16; 3],
    /// Specific force along x, y, z.
    pub acceleration: [i16; 3],
    /// Temperature, 0.1 deg C.
    pub temperature: i16,
    /// Data counter; it wraps.
    pub counter: u16,
}

impl Burst {
    /// Parses a burst.
    ///
    /// # Errors
    /// `Checksum` or `Silent`.
    pub fn parse(bytes: &[u8; BURST]) -> Result<Self, BurstError> {
        if bytes.iter().all(|byte| *byte == 0) || bytes.iter().all(|byte| *byte == 0xFF) {
            return Err(BurstError::Silent);
        }
        let (words, _) = bytes.as_chunks::<2>();
        let word = |n: usize| words.get(n).map_or(0, |word| u16::from_be_bytes(*word));
        let (computed, stored) = (sum(bytes), word(9));
        if computed != stored {
            return Err(BurstError::Checksum { computed, stored });
        }
        Ok(Self {
            diagnosis: DiagStat(word(0)),
            rate: core::array::from_fn(|axis| word(1 + axis) as i16),
            acceleration: core::array::from_fn(|axis| word(4 + axis) as i16),
            temperature: word(7) as i16,
            counter: word(8),
        })
    }

    /// Encodes the burst.
    pub fn emit(&self) -> [u8; BURST] {
        let ([gx, gy, gz], [ax, ay, az]) = (self.rate, self.acceleration);
        let words = [gx, gy, gz, ax, ay, az, self.temperature].map(|reading| reading as u16);
        let words = [self.diagnosis.0].into_iter().chain(words).chain([self.counter]);
        let mut bytes = [0; BURST];
        for (to, word) in bytes.chunks_exact_mut(2).zip(words) {
            to.copy_from_slice(&word.to_be_bytes());
        }
        let [high, low] = sum(&bytes).to_be_bytes();
        bytes[SUMMED] = high;
        bytes[SUMMED + 1] = low;
        bytes
    }

    /// Converts the readings, taken at `time`, to the pipeline's units.
    ///
    /// # Errors
    /// `Diagnosis` or `Reading`.
    pub fn sample(&self, model: Model, time: Micros) -> Result<ImuSample, BurstError> {
        if self.diagnosis.intersects(DiagStat::FATAL) {
            return Err(BurstError::Diagnosis(self.diagnosis));
        }
        let rate = |count: i16| {
            let dps = f32::from(count) / model.counts_per_dps();
            AngularRate::from_rad_per_sec(dps.to_radians())
        };
        let force = |count: i16| {
            SpecificForce::from_metre_per_sec2(f32::from(count) / model.counts_per_g() * STANDARD_GRAVITY)
        };
        let ([gx, gy, gz], [ax, ay, az]) = (self.rate, self.acceleration);
        let at_the_end = [gx, gy, gz, ax, ay, az].iter().any(|count| count.unsigned_abs() >= 32_767);
        let converted = || {
            Ok(ImuSample {
                time,
                specific_force: [force(ax)?, force(ay)?, force(az)?],
                angular_rate: [rate(gx)?, rate(gy)?, rate(gz)?],
                temperature: self.temperature.checked_mul(10).map(CentiCelsius),
                validity: Validity::reported(at_the_end),
            })
        };
        converted().map_err(BurstError::Reading)
    }
}

fn sum(bytes: &[u8; BURST]) -> u16 {
    bytes.iter().take(SUMMED).map(|byte| u16::from(*byte)).sum()
}
