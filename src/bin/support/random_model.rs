//! Window models of any shape with random weights, and windows for them, the same on a board and a host.

use super::numbers::Numbers;
use gyronet::model::blob::{CRC, HEADER_LEN, LINEAR_INPUTS, MAGIC, Shape, VERSION};
use gyronet::model::window::{FEATURES, Features, WINDOW};
use gyronet::nn::lstm::DirectionWeights;

/// Limit of an input, Q10. With this limit and [`WEIGHT`] every row of a model of up to 60 units stays within its
/// bound.
const CLAMP: i32 = 8_192;
const WEIGHT: i32 = 40;

struct Writer<const LEN: usize> {
    bytes: [u8; LEN],
    at: usize,
    numbers: Numbers,
    /// Limit of an int8 weight.
    weight: i32,
}

impl<const LEN: usize> Writer<LEN> {
    const fn bytes(&mut self, bytes: &[u8]) {
        let mut k = 0;
        while k < bytes.len() {
            self.bytes[self.at] = bytes[k];
            self.at += 1;
            k += 1;
        }
    }

    const fn word(&mut self, word: i32) {
        self.bytes(&word.to_le_bytes());
    }

    const fn halfword(&mut self, halfword: i32) {
        self.bytes(&(halfword as i16).to_le_bytes());
    }

    const fn direction(&mut self, units: usize, inputs: usize) {
        let mut unit = 0;
        while unit < units {
            let mut pair = 0;
            while pair < 2 {
                let (low, high) = (self.numbers.within(20_000), self.numbers.within(20_000));
                self.word(low);
                self.word(low.wrapping_add(high * 256));
                pair += 1;
            }
            self.columns(inputs);
            unit += 1;
        }
        let mut unit = 0;
        while unit < units {
            self.columns(DirectionWeights::padded(units));
            let mut row = 0;
            while row < 4 {
                // A multiplier that spreads typical sums over the whole range of a gate.
                let multiplier = 400 + self.numbers.within(200);
                self.halfword(multiplier);
                row += 1;
            }
            unit += 1;
        }
    }

    /// Writes random columns, each as two halfwords of two gates.
    const fn columns(&mut self, count: usize) {
        let mut k = 0;
        while k < 2 * count {
            let packed = self.numbers.within(self.weight) * 256 + self.numbers.within(self.weight);
            self.halfword(packed);
            k += 1;
        }
    }

    const fn row(&mut self, columns: usize, multiplier: i32) {
        let mut k = 0;
        while k < columns {
            let weight = self.numbers.within(2_000);
            self.halfword(weight);
            k += 1;
        }
        self.word(0);
        self.word(multiplier);
    }
}

/// Returns the input and the recurrent records of a direction, of weights up to +-`weight`.
#[allow(
    dead_code,
    long_running_const_eval,
    reason = "100,000 random weights; a small core runs models alone"
)]
pub const fn records<const LEN: usize>(units: usize, inputs: usize, weight: i32, seed: u32) -> [u8; LEN] {
    let mut to = Writer { bytes: [0; LEN], at: 0, numbers: Numbers::new(seed), weight };
    to.direction(units, inputs);
    assert!(to.at == LEN);
    to.bytes
}

/// Returns a weight file of `LEN` bytes, which must be [`Shape::file_len`] without provenance.
#[allow(long_running_const_eval, reason = "60,000 random weights and their checksum")]
#[must_use]
pub const fn file<const LEN: usize>(shape: Shape, seed: u32) -> [u8; LEN] {
    assert!(LEN == shape.file_len(0));
    let mut to = Writer { bytes: [0; LEN], at: 0, numbers: Numbers::new(seed), weight: WEIGHT };
    let [network, window, inputs, units, layers, outputs] = shape.topology();
    to.bytes(&MAGIC);
    to.bytes(&VERSION.to_le_bytes());
    to.bytes(&network.to_le_bytes());
    to.word(LEN as i32);
    to.halfword(window as i32);
    to.halfword(inputs as i32);
    to.halfword(units as i32);
    to.halfword(layers as i32);
    to.word(outputs as i32);
    to.word(0);
    to.word(CLAMP);
    let mut feature = 0;
    while feature < FEATURES {
        to.word(0);
        to.word(200_000);
        feature += 1;
    }
    assert!(to.at == HEADER_LEN);
    // In each row the weights of an input add up to zero, as a weight file must have them.
    let (mut k, mut sums) = (0, [0; FEATURES]);
    while shape.linear && k < WINDOW * LINEAR_INPUTS {
        let (input, is_last) = (k % FEATURES, k % LINEAR_INPUTS >= LINEAR_INPUTS - FEATURES);
        let weight = if is_last { -sums[input] } else { to.numbers.within(1 << 20) };
        sums[input] = if is_last { 0 } else { sums[input] + weight };
        to.word(weight);
        k += 1;
    }
    let units = units as usize;
    if units > 0 {
        to.direction(units, FEATURES);
        to.direction(units, FEATURES);
        to.direction(units, 2 * units);
        to.direction(units, 2 * units);
        to.row(2 * units, 1 << 20);
    }
    let (content, _) = to.bytes.split_at(LEN - 4);
    let crc = CRC.checksum(content);
    to.bytes(&crc.to_le_bytes());
    to.bytes
}

/// Returns a window of up to +-10 m/s^2 and +-0.25 rad/s, or for every fourth `n` with features at the ends of the range.
pub fn window(numbers: &mut Numbers, n: u32) -> [Features; WINDOW] {
    let mut window = [[0; FEATURES]; WINDOW];
    for features in &mut window {
        for (k, value) in features.iter_mut().enumerate() {
            *value = match n % 4 {
                3 => [i32::MAX, i32::MIN][numbers.next() as usize % 2],
                _ => numbers.within(if k < 3 { 10 << 20 } else { 1 << 25 }),
            };
        }
    }
    window
}
