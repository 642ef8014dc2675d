//! This module is GyroNet in integers: it takes ten samples and returns the yaw gyro's error at each of them, and
//! how far off that may be.

use super::blob::{Blob, HIDDEN};
use super::input::load_step;
use super::{Estimate, SCALE_MAX, SCALE_MIN, WindowNetwork};
use crate::model::window::{FEATURES, Features, WINDOW};
use crate::nn::bilstm::{self, Direction, Pass, Run};
use crate::nn::lstm::{DirectionWeights, Scratch};
use crate::nn::{dense::Dense, exp2::times_exp2};
use crate::units::AngularRate;
use core::borrow::BorrowMut;

/// Words of the hidden state of one direction.
const HIDDEN_WORDS: usize = HIDDEN / 2;

/// Words of the recurrent weights of one direction.
const RECURRENT_WORDS: usize = DirectionWeights::recurrent_words(HIDDEN);

/// Working memory of one window.
#[derive(Debug, Clone)]
pub struct GyroNetState {
    input: [u32; WINDOW * FEATURES / 2],
    layer1: [u32; WINDOW * HIDDEN],
    /// The projections of all steps of a direction, so that each weight of its input is read once a window.
    scratch: Scratch<HIDDEN, HIDDEN_WORDS, { WINDOW / 2 }>,
    /// The recurrent weights of the direction at work, which each step reads.
    recurrent: [u32; RECURRENT_WORDS],
    /// The biases of the gyro error's row, then of the log scale's row.
    sums: [[i32; 2]; WINDOW],
    clamped_inputs: u16,
    /// A window that is not done.
    run: Run,
    under_way: bool,
}

impl GyroNetState {
    /// A fresh state; a window leaves nothing in it for the next one. All of it is zero, so that it needs no place
    /// in flash.
    pub const ZERO: Self = Self {
        input: [0; _],
        layer1: [0; _],
        scratch: Scratch::ZERO,
        recurrent: [0; _],
        sums: [[0; _]; _],
        clamped_inputs: 0,
        run: Run::new(),
        under_way: false,
    };
}

/// The integer network: weights in place, state owned or (`S` a reference) the caller's, where it is too
/// large to be moved about on a small stack.
#[derive(Debug, Clone)]
pub struct GyroNet<'w, S = GyroNetState> {
    blob: Blob<'w>,
    state: S,
}

impl<'w> GyroNet<'w> {
    /// Makes a network over checked weights.
    #[must_use]
    pub fn new(blob: Blob<'w>) -> Self {
        Self::with_state(blob, GyroNetState::ZERO)
    }
}

impl<'w, S: BorrowMut<GyroNetState>> GyroNet<'w, S> {
    /// Makes a network over checked weights, in a state of the caller's. A window that it was working on is
    /// dropped.
    #[must_use]
    pub fn with_state(blob: Blob<'w>, mut state: S) -> Self {
        state.borrow_mut().under_way = false;
        Self { blob, state }
    }

    /// Returns the weights that it runs on.
    #[must_use]
    pub fn blob(&self) -> &Blob<'w> {
        &self.blob
    }

    /// Loads a window; [`GyroNet::advance`] then runs it piece by piece. One that was under way
    /// is dropped.
    pub fn start(&mut self, window: &[Features; WINDOW]) {
        let clamped_inputs = self.load(window);
        let state = self.state.borrow_mut();
        state.clamped_inputs = clamped_inputs;
        state.sums = [[self.blob.gyro_error.bias, self.blob.log_scale.bias]; WINDOW];
        state.run = Run::new();
        state.under_way = true;
    }

    /// Runs a bounded piece of the window (one direction of one layer, a third of it or less); returns the estimate
    /// with the last one, `None` before that and when none is under way.
    pub fn advance(&mut self) -> Option<Estimate> {
        let Self { blob, state } = self;
        let GyroNetState { input, layer1, scratch, recurrent, sums, clamped_inputs, run, under_way } =
            state.borrow_mut();
        if !*under_way {
            return None;
        }
        let more = run.advance(&blob.layers, input, layer1, scratch, recurrent, |way, step, hidden| {
            let Some(sums) = sums.get_mut(step) else { return };
            for (sum, row) in sums.iter_mut().zip([&blob.gyro_error, &blob.log_scale]) {
                let (forward, backward) = row.weights.split_at_checked(HIDDEN).unwrap_or_default();
                let weights = if way == Direction::Forward { forward } else { backward };
                *sum = sum.wrapping_add(Dense::partial(weights, hidden));
            }
        });
        if more {
            return None;
        }
        *under_way = false;
        let corrections = sums.map(|[error, _]| AngularRate(blob.gyro_error.scale(error)));
        let log_scale =
            sums.iter().fold(0, |sum: i32, [_, log]| sum.saturating_add(blob.log_scale.scale(*log)));
        let scale = AngularRate(times_exp2(blob.scale_unit, log_scale)).clamp(SCALE_MIN, SCALE_MAX);
        Some(Estimate { corrections, scale, clamped_inputs: *clamped_inputs })
    }

    /// Returns the newest sample's correction without a scale, and the clamped inputs. The backward half of layer 2
    /// needs just its first step for that, which saves a third of the work; the result is the last of
    /// [`WindowNetwork::estimate`]'s, bit for bit.
    pub fn estimate_newest(&mut self, window: &[Features; WINDOW]) -> (AngularRate, u16) {
        let clamped_inputs = self.load(window);
        let Self { blob: Blob { layers: [first, second], gyro_error: dense, .. }, state } = self;
        let GyroNetState { input, layer1, scratch, recurrent, .. } = state.borrow_mut();
        for (direction, way, offset) in
            [(&first.forward, Direction::Forward, 0), (&first.backward, Direction::Backward, HIDDEN)]
        {
            Pass::new(way).finish(direction, input, scratch, recurrent, |step, hidden| {
                bilstm::store(layer1, step, offset, 2 * HIDDEN, HIDDEN, hidden);
            });
        }
        let (forward, backward) = dense.weights.split_at_checked(HIDDEN).unwrap_or_default();
        let mut sum = dense.bias;
        let mut add = |weights, step, hidden: &[u32]| {
            if step == WINDOW - 1 {
                sum = sum.wrapping_add(Dense::partial(weights, hidden));
            }
        };
        Pass::new(Direction::Forward)
            .finish(&second.forward, layer1, scratch, recurrent, |step, hidden| add(forward, step, hidden));
        Pass::first(Direction::Backward, &second.backward, layer1, scratch, |step, hidden| {
            add(backward, step, hidden);
        });
        (AngularRate(dense.scale(sum)), clamped_inputs)
    }

    /// Normalises the window into the first layer's input; counts what had to be clamped.
    fn load(&mut self, window: &[Features; WINDOW]) -> u16 {
        let clamp = i32::from(self.blob.input_clamp);
        let input = &mut self.state.borrow_mut().input;
        let mut clamped = 0;
        for (step, features) in window.iter().enumerate() {
            let codes = features.iter().copied();
            let normalisation = &self.blob.normalisation;
            clamped += load_step::<FEATURES, FEATURES>(input, step, codes, normalisation, clamp);
        }
        clamped
    }
}

impl<S: BorrowMut<GyroNetState>> WindowNetwork for GyroNet<'_, S> {
    fn estimate(&mut self, window: &[Features; WINDOW]) -> Estimate {
        self.start(window);
        loop {
            // A run takes four pieces, whatever the window holds.
            if let Some(estimate) = self.advance() {
                return estimate;
            }
        }
    }
}
