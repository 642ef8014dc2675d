//! Seeded random numbers for long streams, the same on every machine and in every run, and the
//! settings of the property tests, whose seeds change from run to run.

use proptest::test_runner::Config;

/// Failed cases are not written to files, since the message has the input.
pub fn cases(count: u32) -> Config {
    // Miri checks every access of a case, so a few cases are enough there.
    let cases = if cfg!(miri) { count.min(4) } else { count };
    Config { cases, failure_persistence: None, ..Config::default() }
}

/// SplitMix64 (Steele, Lea, Flood: Fast Splittable Pseudorandom Number Generators, 2014).
#[derive(Debug, Clone)]
pub struct Noise(u64);

impl Noise {
    pub fn new(seed: u64) -> Self {
        Self(seed)
    }

    pub fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }

    pub fn byte(&mut self) -> u8 {
        self.bits().to_le_bytes()[7]
    }

    pub fn int(&mut self, from: i64, to: i64) -> i64 {
        let span = to.abs_diff(from) as u128 + 1;
        // The high half of a 64 x 64 bit product: uniform to one part in 2^64 / span.
        from + ((u128::from(self.bits()) * span) >> 64) as i64
    }

    /// Approximately normal, mean 0, variance 1: the sum of twelve uniform numbers.
    pub fn normal(&mut self) -> f64 {
        (0..12).map(|_| self.bits() as f64 / u64::MAX as f64).sum::<f64>() - 6.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_stream_is_that_of_the_reference_code() {
        // First outputs for seed 1234567, as in the reference C code.
        let mut noise = Noise::new(1_234_567);
        assert_eq!(noise.bits(), 6_457_827_717_110_365_317);
        assert_eq!(noise.bits(), 3_203_168_211_198_807_973);
    }
}
