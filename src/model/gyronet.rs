//! Runs GyroNet in integers: from ten samples it estimates the yaw gyro's error at each of them.
//!
//! The error is the sum of a linear part, computed from the features' codes without rounding them, and of the output
//! of two layers of Bi-LSTMs. A weight file has one or both, with Bi-LSTMs of any size up to the paper's.

use super::blob::{Blob, BlobError, HIDDEN};
use super::input::load_step;
use super::{Estimate, WindowNetwork, weights};
use crate::model::window::{FEATURES, Features, WINDOW};
use crate::nn::bilstm::{Direction, Run};
use crate::nn::lstm::{DirectionWeights, Scratch};
use crate::nn::{dense::Dense, linear::Linear};
use crate::units::AngularRate;

/// The working memory of one window, for networks of up to `U` units a direction: `W` is half of them, `R` the words of
/// their recurrent weights. By default it has the size of the library's default model: a linear part alone.
#[derive(Debug, Clone)]
pub struct GyroNetState<
    const U: usize = { weights::DEFAULT_UNITS },
    const W: usize = { weights::DEFAULT_UNITS / 2 },
    const R: usize = { DirectionWeights::recurrent_words(weights::DEFAULT_UNITS) },
> {
    input: [u32; WINDOW * FEATURES / 2],
    layer1: [[u32; U]; WINDOW],
    /// The projections of all steps of a direction, so that each weight of its input is read once a window.
    scratch: Scratch<U, W, { WINDOW / 2 }>,
    /// The recurrent weights of the current direction, which each step reads.
    recurrent: [u32; R],
    linear: [i32; WINDOW],
    /// Sums of the gyro error's row for each sample; they start from its bias.
    sums: [i32; WINDOW],
    clamped_inputs: u16,
    run: Run,
    under_way: bool,
}

/// The memory of the largest network, the paper's: 27 KB.
pub type LargestState = GyroNetState<HIDDEN, { HIDDEN / 2 }, { DirectionWeights::recurrent_words(HIDDEN) }>;

impl<const U: usize, const W: usize, const R: usize> GyroNetState<U, W, R> {
    /// A state without a window: a window leaves nothing. All zeros, it needs no initial value in flash.
    pub const ZERO: Self = Self {
        input: [0; _],
        layer1: [[0; U]; _],
        scratch: Scratch::ZERO,
        recurrent: [0; R],
        linear: [0; _],
        sums: [0; _],
        clamped_inputs: 0,
        run: Run::START,
        under_way: false,
    };
}

/// A state of a network, or a reference to one.
pub trait Memory {
    /// The most units a direction that there is room for.
    const UNITS: usize;

    fn start(&mut self, blob: &Blob<'_>, window: &[Features; WINDOW]);
    /// Runs a piece of the window; returns the estimate with the last one.
    fn advance(&mut self, blob: &Blob<'_>) -> Option<Estimate>;
    fn stop(&mut self);
}

impl<M: Memory> Memory for &mut M {
    const UNITS: usize = M::UNITS;

    fn start(&mut self, blob: &Blob<'_>, window: &[Features; WINDOW]) {
        (**self).start(blob, window);
    }

    fn advance(&mut self, blob: &Blob<'_>) -> Option<Estimate> {
        (**self).advance(blob)
    }

    fn stop(&mut self) {
        (**self).stop();
    }
}

impl<const U: usize, const W: usize, const R: usize> Memory for GyroNetState<U, W, R> {
    const UNITS: usize = U;

    fn start(&mut self, blob: &Blob<'_>, window: &[Features; WINDOW]) {
        self.clamped_inputs = load(blob, window, &mut self.input);
        self.linear = [0; _];
        for (output, row) in self.linear.iter_mut().zip(blob.linear.iter().flat_map(Linear::rows)) {
            *output = Linear::output(row, window.as_flattened());
        }
        self.sums = [blob.gyro_error.bias; WINDOW];
        self.run = Run::START;
        self.under_way = true;
    }

    fn advance(&mut self, blob: &Blob<'_>) -> Option<Estimate> {
        let Self { input, layer1, scratch, recurrent, linear, sums, clamped_inputs, run, under_way } = self;
        if !*under_way {
            return None;
        }
        if let Some(layers) = &blob.layers {
            let units = layers[0].forward.units();
            let layer1 = layer1.as_flattened_mut().get_mut(..WINDOW * units).unwrap_or_default();
            let more = run.advance(layers, input, layer1, scratch, recurrent, |direction, step, hidden| {
                let Some(sum) = sums.get_mut(step) else { return };
                let (forward, backward) = blob.gyro_error.weights.split_at_checked(units).unwrap_or_default();
                let weights = if direction == Direction::Forward { forward } else { backward };
                *sum = sum.wrapping_add(Dense::partial(weights, hidden));
            });
            if more {
                return None;
            }
        }
        *under_way = false;
        let corrections = core::array::from_fn(|step| {
            AngularRate(blob.gyro_error.scale(sums[step]).saturating_add(linear[step]))
        });
        let linear_sum = linear.iter().map(|part| i64::from(*part)).sum();
        Some(Estimate { corrections, clamped_inputs: *clamped_inputs, linear_sum })
    }

    fn stop(&mut self) {
        self.under_way = false;
    }
}

/// Runs the integer network, in a state of its own or, where that is too large for the stack, the caller's.
#[derive(Debug, Clone)]
pub struct GyroNet<'w, S = LargestState> {
    blob: Blob<'w>,
    state: S,
}

impl<'w> GyroNet<'w> {
    /// Creates a network over checked weights, with a state for the largest network: 27 KB.
    pub fn new(blob: Blob<'w>) -> Self {
        Self { blob, state: GyroNetState::ZERO }
    }
}

impl GyroNet<'static, GyroNetState> {
    /// Creates the library's default model with a state of its size; an error is damaged flash.
    pub fn shipped() -> Result<Self, BlobError> {
        Self::with_state(Blob::new_checked(&weights::DEFAULT.0)?, GyroNetState::ZERO)
    }
}

impl<'w, S: Memory> GyroNet<'w, S> {
    /// Creates a network that works in the caller's state, whose window is dropped, unless it is too small.
    pub fn with_state(blob: Blob<'w>, mut state: S) -> Result<Self, BlobError> {
        let found = blob.shape.units;
        if usize::from(found) > S::UNITS {
            return Err(BlobError::Units { found, largest: S::UNITS as u16 });
        }
        state.stop();
        Ok(Self { blob, state })
    }

    /// Loads a window and runs the linear part; [`GyroNet::advance`] runs the rest. One in progress is dropped.
    pub fn start(&mut self, window: &[Features; WINDOW]) {
        self.state.start(&self.blob, window);
    }

    /// Runs a piece (one direction of a layer, a third of it or less); returns the estimate with the last one.
    pub fn advance(&mut self) -> Option<Estimate> {
        self.state.advance(&self.blob)
    }
}

/// Normalises the window into the first layer's input, if there is one; returns how many values had to be clamped.
fn load(blob: &Blob<'_>, window: &[Features; WINDOW], input: &mut [u32]) -> u16 {
    if blob.layers.is_none() {
        return 0;
    }
    let clamp = i32::from(blob.input_clamp);
    let mut clamped = 0;
    for (step, features) in window.iter().enumerate() {
        let codes = features.iter().copied();
        clamped += load_step::<FEATURES, FEATURES>(input, step, codes, &blob.normalisation, clamp);
    }
    clamped
}

impl<S: Memory> WindowNetwork for GyroNet<'_, S> {
    fn estimate(&mut self, window: &[Features; WINDOW]) -> Estimate {
        self.start(window);
        loop {
            // A run takes four pieces at most, whatever the window contains.
            if let Some(estimate) = self.advance() {
                return estimate;
            }
        }
    }
}
