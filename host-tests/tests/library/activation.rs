//! Sigmoid and tanh over every input that they can get, against f64.

use gyronet::nn::GATE_FRACTION_BITS;
use gyronet::nn::activation::{self, INPUT_BITS, saturate};

const MAX: i32 = (1 << (INPUT_BITS - 1)) - 1;
const MIN: i32 = -(1 << (INPUT_BITS - 1));

/// The function's Q15 outputs in order of its inputs.
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

fn sigmoid(x: f64) -> f64 {
    1.0 / (1.0 + (-x).exp())
}

#[test]
fn errors_stay_below_their_documented_bounds() {
    for (name, function, exact, limit) in [
        ("sigmoid", activation::sigmoid as fn(i32) -> i32, sigmoid as fn(f64) -> f64, 1.75),
        ("tanh", activation::tanh, f64::tanh, 2.5),
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
