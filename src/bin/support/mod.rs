//! The self-test and the bench share this module: reproducible numbers and weights of any size.

mod numbers;
#[allow(dead_code, reason = "the self-test has no models of its own")]
pub mod random_model;

pub use numbers::Numbers;

use gyronet::nn::lstm::DirectionWeights;

/// Random input and recurrent records of one direction, made by the compiler and kept in flash.
///
/// Weights are up to +-`weight`, which keeps every row inside its bound for the sizes here.
pub struct Records<const INPUT: usize, const RECURRENT: usize> {
    input: [u32; INPUT],
    recurrent: [u32; RECURRENT],
}

impl<const INPUT: usize, const RECURRENT: usize> Records<INPUT, RECURRENT> {
    #[allow(long_running_const_eval, reason = "100,000 random weights")]
    pub const fn random(units: usize, inputs: usize, weight: i32, seed: u32) -> Self {
        let mut numbers = Numbers::new(seed);
        let mut records = Self { input: [0; INPUT], recurrent: [0; RECURRENT] };
        let padded = DirectionWeights::padded(units);
        let mut unit = 0;
        while unit < units {
            let at = unit * (4 + inputs);
            let mut pair = 0;
            while pair < 2 {
                let (low, high) = (numbers.within(20_000), numbers.within(20_000));
                records.input[at + 2 * pair] = low as u32;
                records.input[at + 2 * pair + 1] = low.wrapping_add(high * 256) as u32;
                pair += 1;
            }
            let mut k = 0;
            while k < inputs {
                records.input[at + 4 + k] = word(&mut numbers, weight);
                k += 1;
            }
            let at = unit * (padded + 2);
            let mut k = 0;
            while k < units {
                records.recurrent[at + k] = word(&mut numbers, weight);
                k += 1;
            }
            let mut k = 0;
            while k < 2 {
                // A scale that takes typical sums over the whole range of a gate.
                let multiplier = (400 + numbers.within(200)) as u32;
                records.recurrent[at + padded + k] = multiplier | multiplier << 16;
                k += 1;
            }
            unit += 1;
        }
        records
    }

    pub fn direction(&self, units: usize, inputs: usize) -> DirectionWeights<'_> {
        match DirectionWeights::new(units, inputs, &self.input, &self.recurrent) {
            Some(direction) => direction,
            None => panic!("records of the wrong length"),
        }
    }
}

/// Two columns of two gates.
const fn word(numbers: &mut Numbers, limit: i32) -> u32 {
    let mut word = 0;
    let mut k = 0;
    while k < 2 {
        let halfword = numbers.within(limit) * 256 + numbers.within(limit);
        word |= (halfword as u16 as u32) << (16 * k);
        k += 1;
    }
    word
}

/// Words of the records of a direction, for the type of [`Records`].
pub const fn input_words(units: usize, inputs: usize) -> usize {
    DirectionWeights::input_words(units, inputs)
}

/// Returns the same as [`input_words`] for the recurrent records.
pub const fn recurrent_words(units: usize) -> usize {
    DirectionWeights::recurrent_words(units)
}

/// Random records of U units and I inputs as a static.
#[macro_export]
macro_rules! random_records {
    ($name:ident, $units:expr, $inputs:expr, $weight:expr, $seed:expr) => {
        static $name: $crate::support::Records<
            { $crate::support::input_words($units, $inputs) },
            { $crate::support::recurrent_words($units) },
        > = $crate::support::Records::random($units, $inputs, $weight, $seed);
    };
}
