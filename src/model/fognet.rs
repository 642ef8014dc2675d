//! Runs FoGNet in integers: from the last minute it computes the error of the gyro's turn in that minute.
//!
//! ```text
//! 60 x 9 -> LSTM1, 2 x 90 both ways -> FC1 -> f1 (60)
//! f1, gyro (60 x 2) -> LSTM2, 2 x 60 both ways -> FC2 of the last step -> f2
//! gyro (60) -> FC3 -> f3
//! f2, f3 -> FC4 -> correction = gyro - truth
//! ```
//!
//! Section III-C of the paper describes it, but not the rate of sampling: with steps of 1 s LSTM2's "N units" give
//! 387,006 parameters, with faster ones millions.
//!
//! Through the LSTMs the increments go as int16. Through FC3 and FC4 a correction of 1e-4 rad in a turn of 10 rad
//! would be below an int16's LSB, so [`FogBlob::gains`] holds FC3, FC4 and the scales multiplied out, and the linear
//! part is computed from the increments themselves, in [`Angle`]: it is exact.

use super::fognet_blob::{COLUMNS, FogBlob, HIDDEN1, HIDDEN2, INPUTS};
use super::input::load_step;
use crate::model::seconds::{STEPS, SecondsWindow};
use crate::nn::bilstm::{self, Direction, Run};
use crate::nn::lstm::Scratch;
use crate::nn::{dense::Dense, pack, unpack};
use crate::units::{Angle, AngularRate};

/// The gyro's increment is in this column.
const GYRO: usize = INPUTS - 1;
/// Shifting an [`Angle`] right by this many bits gives the [`AngularRate`] that turns it in a second.
const ANGLE_TO_RATE: u32 = Angle::FRACTION_BITS - AngularRate::FRACTION_BITS;
pub const GAIN_FRACTION_BITS: u32 = 31;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FogEstimate {
    /// The error of the gyro's turn in the window.
    pub correction: Angle,
    /// The part of the correction that is linear in the gyro's increments.
    pub linear: Angle,
    /// Mean over the steps of the linear part's factor: the error of the gyro's scale, Q31.
    pub gain: i32,
    /// Input values that had to be clamped to the network's range.
    pub clamped_inputs: u16,
}

impl FogEstimate {
    pub const NONE: Self = Self { correction: Angle::ZERO, linear: Angle::ZERO, gain: 0, clamped_inputs: 0 };
}

/// Turns a minute into a correction; the integer network and the f32 reference implement it.
pub trait MinuteNetwork {
    fn estimate(&mut self, window: &SecondsWindow<'_>) -> FogEstimate;
}

/// Holds the working memory of one window. Both LSTMs share it: they run one after the other.
#[derive(Debug, Clone)]
pub struct FogNetState {
    input: [u32; STEPS * COLUMNS / 2],
    between: [u32; STEPS * HIDDEN1],
    scratch: Scratch<HIDDEN1, { HIDDEN1 / 2 + 1 }>,
}

impl FogNetState {
    /// A window leaves nothing in the state for the next one.
    pub const ZERO: Self = Self { input: [0; _], between: [0; _], scratch: Scratch::ZERO };
}

/// Runs the integer network, in the caller's state: it is too large to move on a small stack.
#[derive(Debug)]
pub struct FogNet<'w, 's> {
    blob: FogBlob<'w>,
    state: &'s mut FogNetState,
}

impl<'w, 's> FogNet<'w, 's> {
    /// Creates a network over checked weights.
    pub fn new(blob: FogBlob<'w>, state: &'s mut FogNetState) -> Self {
        Self { blob, state }
    }
}

fn half(weights: &[i16], direction: Direction, hidden: &[u32]) -> i32 {
    let (forward, backward) = weights.split_at_checked(weights.len() / 2).unwrap_or_default();
    Dense::partial(if direction == Direction::Forward { forward } else { backward }, hidden)
}

impl MinuteNetwork for FogNet<'_, '_> {
    fn estimate(&mut self, window: &SecondsWindow<'_>) -> FogEstimate {
        let Self { blob, state } = self;
        let FogNetState { input, between, scratch } = &mut **state;
        let clamp = i32::from(blob.input_clamp);
        let (mut linear, mut clamped_inputs) = (0i128, 0);
        for ((step, second), gain) in window.iter().enumerate().zip(blob.gains) {
            linear += i128::from(second.turn.0) * i128::from(*gain);
            let turn = (second.turn.0 >> ANGLE_TO_RATE).clamp(i32::MIN.into(), i32::MAX.into()) as i32;
            let codes = second.features.into_iter().chain([turn]);
            clamped_inputs += load_step::<INPUTS, COLUMNS>(input, step, codes, &blob.normalisation, clamp);
        }
        let linear = (linear + (1 << (GAIN_FRACTION_BITS - 1))) >> GAIN_FRACTION_BITS;
        let linear = Angle(linear.clamp(i64::MIN.into(), i64::MAX.into()) as i64);

        let (mut f1, mut run) = ([blob.fc1.bias; STEPS], Run::START);
        while run.advance(&blob.lstm1, input, between, scratch, &mut [], |direction, step, hidden| {
            f1[step] = f1[step].wrapping_add(half(blob.fc1.weights, direction, hidden));
        }) {}
        // LSTM2's input, f1 and the gyro, over LSTM1's. Reading stays ahead of writing: five words a step are read, one is
        // written.
        for (step, f1) in f1.into_iter().enumerate() {
            let (gyro, _) = unpack(input[bilstm::word_index(step, GYRO, COLUMNS)]);
            let f1 = blob.fc1.scale(f1).min(clamp).max(-clamp);
            input[bilstm::word_index(step, 0, 2)] = pack(f1 as i16, gyro as i16);
        }
        // FC2 needs only the last step, with which the backward pass of LSTM2's second layer begins.
        let (input, between) = (&input[..STEPS], &mut between[..STEPS * HIDDEN2]);
        let (mut f2, mut run, mut seen) = (blob.fc2.bias, Run::START, 0);
        while run.advance(&blob.lstm2, input, between, scratch, &mut [], |direction, step, hidden| {
            if step == STEPS - 1 {
                f2 = f2.wrapping_add(half(blob.fc2.weights, direction, hidden));
                seen += 1;
            }
        }) && seen < 2
        {}
        let correction = Angle(linear.0.saturating_add(blob.spread(f2).0));
        FogEstimate { correction, linear, gain: blob.mean_gain(), clamped_inputs }
    }
}
