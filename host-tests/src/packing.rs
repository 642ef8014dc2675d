//! LSTM weights row by row, packed as documented in `gyronet::nn::lstm`. It was written
//! from that documentation, not from the quantiser, so that it can check both.

use crate::noise::Noise;
use gyronet::nn::lstm::{DirectionWeights, ROW_LIMIT};
use gyronet::nn::{GATES, HIDDEN_MAX};

#[derive(Debug, Clone, Default)]
pub struct Row {
    pub bias: i32,
    /// Gate input = accumulator * multiplier / 2^16.
    pub multiplier: i16,
    pub input: Vec<i8>,
    pub recurrent: Vec<i8>,
}

impl Row {
    /// The largest sum that inputs up to `input_max` and any hidden state can give, with the bias.
    pub fn bound(&self, input_max: i32) -> i64 {
        let sum = |row: &[i8], max: i32| {
            row.iter().map(|w| i64::from(w.unsigned_abs())).sum::<i64>() * i64::from(max)
        };
        sum(&self.input, input_max) + sum(&self.recurrent, HIDDEN_MAX) + i64::from(self.bias.unsigned_abs())
    }

    /// Random weights up to `largest`, thinned until the row's bound stays below `limit`; the bias may use
    /// all of the remaining range.
    fn random(
        noise: &mut Noise,
        inputs: usize,
        units: usize,
        largest: i64,
        input_max: i32,
        limit: i64,
    ) -> Self {
        let mut weights = |n| (0..n).map(|_| noise.int(-largest, largest) as i8).collect::<Vec<i8>>();
        let mut row = Self { input: weights(inputs), recurrent: weights(units), ..Self::default() };
        while row.bound(input_max) >= limit {
            for w in row.input.iter_mut().chain(&mut row.recurrent) {
                *w = if noise.int(0, 3) == 0 { 0 } else { *w };
            }
        }
        let left = limit - 1 - row.bound(input_max);
        let left = if noise.int(0, 1) == 0 { left } else { left / 1000 };
        row.bias = noise.int(-left, left) as i32;
        row.multiplier =
            if noise.int(0, 9) == 0 { noise.int(-32_768, 32_767) } else { noise.int(0, 3_000) } as i16;
        row
    }
}

/// i, f, g, o of each unit.
#[derive(Debug, Clone)]
pub struct Rows(pub Vec<[Row; GATES]>);

impl Rows {
    /// Random rows within the range of the kernel for inputs up to `input_max`.
    pub fn random(noise: &mut Noise, inputs: usize, units: usize, input_max: i32) -> Self {
        let mut row = |gate: usize| {
            let largest = [127, 40, 3][noise.int(0, 2) as usize];
            Row::random(noise, inputs, units, largest, input_max, ROW_LIMIT[gate])
        };
        Self((0..units).map(|_| std::array::from_fn(&mut row)).collect())
    }

    pub fn pack(&self) -> Packed {
        let mut packed =
            Packed { units: self.0.len(), inputs: self.0[0][0].input.len(), ..Packed::default() };
        for unit in &self.0 {
            let [i, f, g, o] = unit.each_ref().map(|row| row.bias);
            // 256 * high + low may exceed 32 bits; the sum is taken modulo 2^32.
            let both = |low: i32, high: i32| 256 * i64::from(high) + i64::from(low);
            packed.input.extend([i.into(), both(i, f), g.into(), both(g, o)].map(|start: i64| start as u32));
            columns(&mut packed.input, unit.each_ref().map(|row| row.input.clone()), 2);
            columns(&mut packed.recurrent, unit.each_ref().map(|row| row.recurrent.clone()), 4);
            let [i, f, g, o] = unit.each_ref().map(|row| row.multiplier);
            packed.recurrent.extend([word(i, f), word(g, o)]);
        }
        packed
    }
}

pub fn word(first: i16, second: i16) -> u32 {
    let ([a, b], [c, d]) = (first.to_le_bytes(), second.to_le_bytes());
    u32::from_le_bytes([a, b, c, d])
}

/// Appends rows i, f, g, o, with their columns padded with zeros to a multiple.
fn columns(out: &mut Vec<u32>, mut rows: [Vec<i8>; GATES], multiple: usize) {
    for row in &mut rows {
        row.resize(row.len().next_multiple_of(multiple), 0);
    }
    let [i, f, g, o] = &rows;
    for j in (0..i.len()).step_by(2) {
        for (low, high) in [(i, f), (g, o)] {
            let halfword = |j: usize| 256 * i16::from(high[j]) + i16::from(low[j]);
            out.push(word(halfword(j), halfword(j + 1)));
        }
    }
}

#[derive(Debug, Clone, Default)]
pub struct Packed {
    units: usize,
    inputs: usize,
    input: Vec<u32>,
    recurrent: Vec<u32>,
}

impl Packed {
    pub fn direction(&self) -> DirectionWeights<'_> {
        DirectionWeights::new(self.units, self.inputs, &self.input, &self.recurrent)
            .expect("records of the stated size")
    }
}
