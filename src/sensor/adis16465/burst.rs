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
//! Eighteen zeros have the sum zero: an all-zero burst, and an all-one burst, are refused, for
//! that is what a part without power and a cut line look like.

use crate::sample::{ImuSample, Validity};
use crate::units::{AngularRate, CentiCelsius, Micros, RangeError, STANDARD_GRAVITY, SpecificForce};

/// Bytes of a burst behind its command.
pub const BURST: usize = 20;
/// Bytes of a burst that are summed.
const SUMMED: usize = 18;

/// The part, which fixes the scales.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Model {
    /// 125 deg/s.
    Adis16465_1,
    /// 500 deg/s.
    Adis16465_2,
    /// 2000 deg/s.
    Adis16465_3,
    /// 2000 deg/s, 40 g.
    Adis16470,
}

impl Model {
    /// Counts per deg/s.
    #[must_use]
    pub const fn counts_per_dps(self) -> f32 {
        match self {
            Self::Adis16465_1 => 160.0,
            Self::Adis16465_2 => 40.0,
            Self::Adis16465_3 | Self::Adis16470 => 10.0,
        }
    }

    /// Counts per g.
    #[must_use]
    pub const fn counts_per_g(self) -> f32 {
        match self {
            Self::Adis16465_1 | Self::Adis16465_2 | Self::Adis16465_3 => 4000.0,
            Self::Adis16470 => 800.0,
        }
    }
}

/// The part's report of its own state; reading it clears it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct DiagStat(pub u16);

impl DiagStat {
    /// Data were not fetched in time or overwritten.
    pub const OVERRUN: Self = Self(1 << 1);
    /// A write to the part's flash failed.
    pub const FLASH_UPDATE: Self = Self(1 << 2);
    /// A transfer had a wrong number of clocks.
    pub const SPI: Self = Self(1 << 3);
    /// Supply voltage too low.
    pub const STANDBY: Self = Self(1 << 4);
    /// Self-test of the sensors failed.
    pub const SELF_TEST: Self = Self(1 << 5);
    /// The part's program memory is damaged.
    pub const MEMORY: Self = Self(1 << 6);
    /// The clocks disagree.
    pub const CLOCK: Self = Self(1 << 7);
    /// The bits that make readings useless. An overrun, a failed write to flash or a transfer error concerns
    /// another transfer than this one, whose sum fits.
    pub const FATAL: Self = Self(Self::STANDBY.0 | Self::SELF_TEST.0 | Self::MEMORY.0 | Self::CLOCK.0);

    /// Returns whether any of these bits is set.
    #[must_use]
    pub const fn intersects(self, other: Self) -> bool {
        self.0 & other.0 != 0
    }
}

/// The reason why bytes are no burst, or a burst gives no sample.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum BurstError {
    /// The sum does not fit.
    #[error("ADIS164xx: the bytes add up to {computed:04x}, but the burst says {stored:04x}")]
    Checksum {
        /// The value that the bytes give.
        computed: u16,
        /// The one in the burst.
        stored: u16,
    },
    /// The bytes are all zeros or all ones: no part answers.
    #[error("ADIS164xx: no part answers")]
    Silent,
    /// The part says that its readings are worthless.
    #[error("ADIS164xx: DIAG_STAT {:04x}", .0.0)]
    Diagnosis(DiagStat),
    /// The data counter stands still: the same readings again.
    #[error("ADIS164xx: the data counter stands still at {counter}")]
    Repeated {
        /// The counter.
        counter: u16,
    },
    /// A reading that no part of this kind can measure.
    #[error("ADIS164xx: a reading is {0}")]
    Reading(RangeError),
}

/// A burst in the part's own counts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Burst {
    /// The part reports a fault.
    pub diagnosis: DiagStat,
    /// x, y, z.
    pub rate: [i16; 3],
    /// x, y, z.
    pub acceleration: [i16; 3],
    /// 0.1 deg C.
    pub temperature: i16,
    /// Counts the readings; wraps.
    pub counter: u16,
}

impl Burst {
    /// Reads a burst.
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

    /// Returns the burst's bytes.
    #[must_use]
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
