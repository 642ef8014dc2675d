//! The packed kernels against plain integer arithmetic, bit for bit: one row, one gate, one unit
//! at a time, in 64 bits, written from the documentation of `gyronet::nn`; sigmoid and tanh over every input against f64.

use gyronet::nn::activation::{INPUT_BITS, saturate, sigmoid, tanh};
use gyronet::nn::bilstm::{Direction, Layer, Run, word_index};
use gyronet::nn::lstm::{DirectionWeights, ROW_LIMIT, Scratch, project, row_bound, step};
use gyronet::nn::{GATE_FRACTION_BITS, GATES, HIDDEN_MAX};
use gyronet_host_tests::noise::{Noise, cases};
use gyronet_host_tests::packing::{Row, Rows, word};
use proptest::prelude::*;
use std::slice::from_mut;

/// Q15 of a table's result.
fn q15(word: i32) -> i64 {
    i64::from(word >> 16)
}

fn to_i32(value: i64) -> i32 {
    value.clamp(i32::MIN.into(), i32::MAX.into()) as i32
}

/// One step of all units: new cell and hidden states.
fn naive_step(rows: &Rows, x: &[i16], previous: &[i16], cell: &[i32]) -> (Vec<i32>, Vec<i16>) {
    let dot = |w: &[i8], x: &[i16]| w.iter().zip(x).map(|(w, x)| i64::from(*w) * i64::from(*x)).sum::<i64>();
    let gate = |row: &Row| {
        let sum = i64::from(row.bias) + dot(&row.input, x) + dot(&row.recurrent, previous);
        saturate(to_i32((sum * i64::from(row.multiplier)) >> 16))
    };
    let unit = |(gates, cell): (&[Row; GATES], &i32)| {
        let [i, f, g, o] = gates.each_ref().map(gate);
        let kept = (i64::from(*cell) * q15(sigmoid(f))) >> 16 << 1;
        let added = (q15(sigmoid(i)) * q15(tanh(g))) >> 10;
        let cell = to_i32(kept + added);
        let hidden = (q15(sigmoid(o)) * q15(tanh(saturate(cell >> 6))) + (1 << 19)) >> 20;
        (cell, i16::try_from(hidden).expect("+-1024"))
    };
    rows.0.iter().zip(cell).map(unit).unzip()
}

/// Hidden states (T, U) of one direction over (T, I).
fn naive_direction(rows: &Rows, way: Direction, x: &[Vec<i16>]) -> Vec<Vec<i16>> {
    let units = rows.0.len();
    let (mut cell, mut hidden) = (vec![0; units], vec![0; units]);
    let mut output = vec![Vec::new(); x.len()];
    for n in 0..x.len() {
        let t = if way == Direction::Forward { n } else { x.len() - 1 - n };
        (cell, hidden) = naive_step(rows, &x[t], &hidden, &cell);
        output[t].clone_from(&hidden);
    }
    output
}

fn words(values: &[i16]) -> Vec<u32> {
    values.chunks(2).map(|pair| word(pair[0], pair.get(1).copied().unwrap_or(0))).collect()
}

fn interleave(first: &[i16], second: &[i16]) -> Vec<u32> {
    words(first).into_iter().zip(words(second)).flat_map(|(first, second)| [first, second]).collect()
}

fn unpack<const U: usize>(hidden: &[u32]) -> [i16; U] {
    std::array::from_fn(|u| (hidden[u / 2] >> (16 * (u % 2))) as i16)
}

/// Values up to `max`: random, or with the signs of one row's weights, so that its sum is the
/// largest that there is.
fn values(noise: &mut Noise, max: i32, row: Option<(&Row, &[i8])>, len: usize) -> Vec<i16> {
    let max = i64::from(max);
    match row {
        Some((row, weights)) => {
            let sign = if row.bias < 0 { -1 } else { 1 };
            weights.iter().map(|w| (sign * max * i64::from(w.signum())) as i16).collect()
        }
        None if noise.int(0, 1) == 0 => {
            (0..len).map(|_| [-max, 0, max][noise.int(0, 2) as usize] as i16).collect()
        }
        None => (0..len).map(|_| noise.int(-max, max) as i16).collect(),
    }
}

/// One pair of steps: the library's definition against the naive one.
fn check_step<const U: usize, const W: usize>(inputs: usize, seed: u64) {
    let mut noise = Noise::new(seed);
    let input_max = [HIDDEN_MAX, 24 * HIDDEN_MAX, i16::MAX.into()][noise.int(0, 2) as usize];
    let rows = Rows::random(&mut noise, inputs, U, input_max);
    let packed = rows.pack();
    let direction = packed.direction();
    let extreme = noise.int(0, 1) == 0;
    let row = &rows.0[noise.int(0, U as i64 - 1) as usize][noise.int(0, 3) as usize];
    let target = |weights: fn(&Row) -> &[i8]| extreme.then_some((row, weights(row)));
    let x = [(); 2].map(|()| values(&mut noise, input_max, target(|row| &row.input), inputs));
    let hidden = values(&mut noise, HIDDEN_MAX, target(|row| &row.recurrent), U);
    let shift = noise.int(0, 12);
    let cell: [i32; U] = std::array::from_fn(|_| noise.bits() as i32 >> shift);
    let mut previous = [0; W];
    previous[..U / 2].copy_from_slice(&words(&hidden));

    let interleaved = interleave(&x[0], &x[1]);
    let mut projections = [[[0; GATES]; U]; 2];
    project(&direction, &interleaved, from_mut(&mut projections));
    for previous in [Some(&previous), None] {
        for (x, projection) in x.iter().zip(&projections) {
            let zero = vec![0; U];
            let expected = naive_step(&rows, x, if previous.is_some() { &hidden } else { &zero }, &cell);
            let (mut cell, mut hidden) = (cell, [0; W]);
            step(&direction, projection, previous, &mut cell, &mut hidden);
            assert_eq!((&cell[..], &unpack::<U>(&hidden)[..]), (&expected.0[..], &expected.1[..]));
        }
    }
}

/// Two bidirectional layers over a sequence.
fn check_run<const U: usize, const W: usize>(inputs: usize, steps: usize, seed: u64) {
    let mut noise = Noise::new(seed);
    let input_max = 24 * HIDDEN_MAX;
    let ways = [Direction::Forward, Direction::Backward];
    let rows = [(inputs, input_max), (2 * U, HIDDEN_MAX)]
        .map(|(inputs, max)| ways.map(|_| Rows::random(&mut noise, inputs, U, max)));
    let packed = rows.each_ref().map(|layer| layer.each_ref().map(Rows::pack));
    let layers = packed.each_ref().map(|[f, b]| Layer { forward: f.direction(), backward: b.direction() });

    let x: Vec<Vec<i16>> = (0..steps).map(|_| values(&mut noise, input_max, None, inputs)).collect();
    let concatenate =
        |[f, b]: [Vec<Vec<i16>>; 2]| f.into_iter().zip(b).map(|(f, b)| [f, b].concat()).collect::<Vec<_>>();
    let layer = |n: usize, x: &[Vec<i16>]| [0, 1].map(|way| naive_direction(&rows[n][way], ways[way], x));
    let expected = layer(1, &concatenate(layer(0, &x)));

    let mut input = vec![0; steps * inputs / 2];
    for (step, x) in x.iter().enumerate() {
        for (k, word) in words(x).into_iter().enumerate() {
            input[word_index(step, 2 * k, inputs)] = word;
        }
    }
    let (mut between, mut scratch, mut run) = (vec![0; steps * U], Scratch::<U, W>::ZERO, Run::START);
    // With room for a copy of the weights, and without.
    let mut room = vec![0; if seed.is_multiple_of(2) { U * (DirectionWeights::padded(U) + 2) } else { 0 }];
    let mut seen = [vec![None; steps], vec![None; steps]];
    let mut pieces = 0;
    while run.advance(&layers, &input, &mut between, &mut scratch, &mut room, |way, step, hidden| {
        seen[usize::from(way == Direction::Backward)][step] = Some(unpack::<U>(hidden).to_vec());
    }) {
        pieces += 1;
    }
    assert_eq!(pieces + 1, 2 * steps, "two steps of one direction of one layer a piece");
    assert_eq!(seen, expected.map(|way| way.into_iter().map(Some).collect::<Vec<_>>()));
}

#[test]
fn the_rows_reach_their_bounds() {
    // Otherwise the extreme cases below would be none.
    let mut noise = Noise::new(8);
    let rows = Rows::random(&mut noise, 120, 60, HIDDEN_MAX);
    let packed = rows.pack();
    for (unit, gates) in rows.0.iter().enumerate() {
        let bound = row_bound(&packed.direction(), unit, HIDDEN_MAX);
        assert_eq!(bound, gates.each_ref().map(|row| row.bound(HIDDEN_MAX)));
        assert!(bound.iter().zip(ROW_LIMIT).all(|(bound, limit)| *bound < limit));
    }
    let close = rows.0.iter().flatten().zip(ROW_LIMIT.iter().cycle());
    assert!(close.filter(|(row, limit)| row.bound(HIDDEN_MAX) > **limit / 4 * 3).count() > 20);
}

#[test]
fn sizes_that_do_not_fit_are_refused() {
    let packed = Rows::random(&mut Noise::new(9), 6, 4, HIDDEN_MAX).pack();
    let (input, recurrent) = (packed.direction().input(), packed.direction().recurrent());
    assert!(DirectionWeights::new(4, 6, input, recurrent).is_some());
    for (units, inputs) in [(4, 8), (4, 4), (6, 6), (2, 6), (0, 0), (3, 6), (4, 5)] {
        assert!(DirectionWeights::new(units, inputs, input, recurrent).is_none(), "{units}, {inputs}");
    }
    assert!(DirectionWeights::new(4, 6, &input[1..], recurrent).is_none());
    assert!(DirectionWeights::new(4, 6, input, &recurrent[1..]).is_none());
}

const MAX: i32 = (1 << (INPUT_BITS - 1)) - 1;
const MIN: i32 = -(1 << (INPUT_BITS - 1));

fn outputs(function: fn(i32) -> i32) -> Vec<i32> {
    (MIN..=MAX).map(|x| function(x) >> 16).collect()
}

/// Largest error in Q15 LSB, where, and the largest step down between neighbours.
fn survey(outputs: &[i32], exact: fn(f64) -> f64) -> (f64, i32, i32) {
    let errors = outputs.iter().zip(MIN..).map(|(y, x)| {
        let exact = exact(f64::from(x) / f64::from(1 << GATE_FRACTION_BITS)) * 32_768.0;
        ((f64::from(*y) - exact).abs(), x)
    });
    let (error, at) = errors.max_by(|a, b| a.0.total_cmp(&b.0)).expect("many inputs");
    let down = outputs.windows(2).map(|pair| pair[0] - pair[1]).max().expect("many inputs");
    (error, at, down)
}

#[test]
fn errors_stay_below_their_documented_bounds() {
    for (name, function, exact, limit) in [
        ("sigmoid", sigmoid as fn(i32) -> i32, (|x| 1.0 / (1.0 + (-x).exp())) as fn(f64) -> f64, 1.75),
        ("tanh", tanh, f64::tanh, 2.5),
    ] {
        let outputs = outputs(function);
        assert_eq!(outputs.len(), 262_144);
        let (error, at, down) = survey(&outputs, exact);
        println!(
            "{name}: largest error {error:.3} LSB of 2^-15 ({:.2e}) at input {at}, largest step down {down}",
            error / 32_768.0
        );
        assert!(error <= limit, "{name}: {error} LSB");
        assert!(down <= 1, "{name} goes down by {down}");
        let lowest = exact(f64::from(MIN) / f64::from(1 << GATE_FRACTION_BITS)) * 32_768.0;
        assert!((f64::from(outputs[0]) - lowest).abs() <= limit, "{name} at its lower end: {}", outputs[0]);
        assert!(outputs.iter().all(|y| (-32_768..=32_767).contains(y)), "{name} leaves Q15");
    }
}

#[test]
fn inputs_beyond_the_table_saturate() {
    for (x, y) in
        [(MAX, MAX), (MAX + 1, MAX), (i32::MAX, MAX), (MIN, MIN), (MIN - 1, MIN), (i32::MIN, MIN), (5, 5)]
    {
        assert_eq!(saturate(x), y);
    }
}

proptest! {
    #![proptest_config(cases(100))]
    #[test]
    fn gyronet_layer_2(seed: u64) { check_step::<60, 30>(120, seed); }
    #[test]
    fn fognet_lstm1_layer_2(seed: u64) { check_step::<90, 46>(180, seed); }
    #[test]
    fn smallest(seed: u64) { check_step::<4, 2>(2, seed); check_step::<2, 2>(4, seed); check_step::<6, 4>(10, seed); }
    #[test]
    fn whole_gyronet(seed: u64) { check_run::<60, 30>(6, 10, seed); }
    #[test]
    fn whole_odd_sizes(seed: u64) { check_run::<6, 4>(10, 8, seed); check_run::<90, 46>(10, 2, seed); }
}
