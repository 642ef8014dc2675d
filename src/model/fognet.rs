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
use crate::nn::bilstm::{self, Direction, Layer, Pass, Run};
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

/// Names the piece of the window that runs next. FC2 needs only the last step, where the backward pass of LSTM2's
/// second layer begins: that is [`Stage::Last`]. `Idle` is zero, so that an idle state needs no initial value in
/// flash.
#[derive(Debug, Clone)]
#[repr(u8)]
#[allow(clippy::large_enum_variant, reason = "no heap to put the large one on; they share its place")]
enum Stage {
    Idle,
    First(Run, Scratch<HIDDEN1, { HIDDEN1 / 2 + 1 }>),
    Second(Run, Scratch2),
    Last(Scratch2),
}

type Scratch2 = Scratch<HIDDEN2, { HIDDEN2 / 2 }>;

/// Holds the working memory of one window. Both LSTMs share it: they run one after the other.
#[derive(Debug, Clone)]
pub struct FogNetState {
    input: [u32; STEPS * COLUMNS / 2],
    between: [u32; STEPS * HIDDEN1],
    f1: [i32; STEPS],
    f2: i32,
    linear: Angle,
    clamped_inputs: u16,
    stage: Stage,
}

impl FogNetState {
    /// A state without a window in progress. A window leaves nothing in the state for the next one.
    pub const ZERO: Self = Self {
        input: [0; _],
        between: [0; _],
        f1: [0; _],
        f2: 0,
        linear: Angle::ZERO,
        clamped_inputs: 0,
        stage: Stage::Idle,
    };
}

/// Runs the integer network, in the caller's state: it is too large to move on a small stack.
#[derive(Debug)]
pub struct FogNet<'w, 's> {
    blob: FogBlob<'w>,
    state: &'s mut FogNetState,
}

impl<'w, 's> FogNet<'w, 's> {
    /// Creates a network over checked weights. A window in progress in that state is dropped.
    pub fn new(blob: FogBlob<'w>, state: &'s mut FogNetState) -> Self {
        state.stage = Stage::Idle;
        Self { blob, state }
    }

    pub fn blob(&self) -> &FogBlob<'w> {
        &self.blob
    }

    /// Loads a window; [`FogNet::advance`] then runs it piece by piece. A window in progress is dropped.
    pub fn start(&mut self, window: &SecondsWindow<'_>) {
        let Self { blob, state } = self;
        let clamp = i32::from(blob.input_clamp);
        state.clamped_inputs = 0;
        let mut linear = 0i128;
        for ((step, second), gain) in window.iter().enumerate().zip(blob.gains) {
            linear += i128::from(second.turn.0) * i128::from(*gain);
            let turn = (second.turn.0 >> ANGLE_TO_RATE).clamp(i32::MIN.into(), i32::MAX.into()) as i32;
            let codes = second.features.into_iter().chain([turn]);
            let (input, normalisation) = (&mut state.input, &blob.normalisation);
            state.clamped_inputs += load_step::<INPUTS, COLUMNS>(input, step, codes, normalisation, clamp);
        }
        let linear = (linear + (1 << (GAIN_FRACTION_BITS - 1))) >> GAIN_FRACTION_BITS;
        state.linear = Angle(linear.clamp(i64::MIN.into(), i64::MAX.into()) as i64);
        state.f1 = [blob.fc1.bias; STEPS];
        state.f2 = blob.fc2.bias;
        state.stage = Stage::First(Run::START, Scratch::ZERO);
    }

    /// Runs a piece (two steps of a direction of a layer); returns the estimate with the last one.
    pub fn advance(&mut self) -> Option<FogEstimate> {
        let Self { blob, state } = self;
        let FogNetState { input, between, f1, f2, stage, .. } = state;
        match stage {
            Stage::Idle => None,
            Stage::First(run, first) => {
                let more =
                    run.advance(&blob.lstm1, input, between, first, &mut [], |direction, step, hidden| {
                        if let Some(f1) = f1.get_mut(step) {
                            *f1 = f1.wrapping_add(half(blob.fc1.weights, direction, hidden));
                        }
                    });
                if !more {
                    state.load_second(blob);
                }
                None
            }
            Stage::Second(run, second) => {
                let mut last = false;
                let (input, between) = (&input[..STEPS], &mut between[..STEPS * HIDDEN2]);
                run.advance(&blob.lstm2, input, between, second, &mut [], |direction, step, hidden| {
                    if step == STEPS - 1 {
                        *f2 = f2.wrapping_add(half(blob.fc2.weights, direction, hidden));
                        last = true;
                    }
                });
                if last {
                    *stage = Stage::Last(Scratch::ZERO);
                }
                None
            }
            Stage::Last(second) => {
                let [_, Layer { backward, .. }] = &blob.lstm2;
                let between = &between[..STEPS * HIDDEN2];
                Pass::first(Direction::Backward, backward, between, second, |_, hidden| {
                    *f2 = f2.wrapping_add(half(blob.fc2.weights, Direction::Backward, hidden));
                });
                state.stage = Stage::Idle;
                Some(state.estimate(blob))
            }
        }
    }
}

fn half(weights: &[i16], direction: Direction, hidden: &[u32]) -> i32 {
    let (forward, backward) = weights.split_at_checked(weights.len() / 2).unwrap_or_default();
    Dense::partial(if direction == Direction::Forward { forward } else { backward }, hidden)
}

impl FogNetState {
    /// Writes LSTM2's input, f1 and the gyro, over LSTM1's.
    fn load_second(&mut self, blob: &FogBlob<'_>) {
        let clamp = i32::from(blob.input_clamp);
        for step in 0..STEPS {
            // Reading stays ahead of writing: five words a step are read, one is written.
            let (gyro, _) = unpack(self.input[bilstm::word_index(step, GYRO, COLUMNS)]);
            let f1 = blob.fc1.scale(self.f1[step]).min(clamp).max(-clamp);
            self.input[bilstm::word_index(step, 0, 2)] = pack(f1 as i16, gyro as i16);
        }
        self.stage = Stage::Second(Run::START, Scratch::ZERO);
    }

    fn estimate(&self, blob: &FogBlob<'_>) -> FogEstimate {
        let correction = Angle(self.linear.0.saturating_add(blob.spread(self.f2).0));
        FogEstimate {
            correction,
            linear: self.linear,
            gain: blob.mean_gain(),
            clamped_inputs: self.clamped_inputs,
        }
    }
}

impl MinuteNetwork for FogNet<'_, '_> {
    fn estimate(&mut self, window: &SecondsWindow<'_>) -> FogEstimate {
        self.start(window);
        loop {
            // A run takes a fixed number of pieces, whatever the window contains.
            if let Some(estimate) = self.advance() {
                return estimate;
            }
        }
    }
}
