//! GyroNet in integers: ten samples in, the yaw gyro's error at each of them out.

use super::blob::{Blob, HIDDEN, Normalisation};
use super::{Estimate, WindowNetwork};
use crate::nn::bilstm::{self, Way};
use crate::nn::{Aligned, dense::Dense, lstm::Scratch};
use crate::units::AngularRate;
use crate::window::{FEATURES, Features, WINDOW};

/// Working memory of one window.
#[derive(Debug, Clone)]
pub struct GyroNetState {
    input: Aligned<[i16; WINDOW * FEATURES]>,
    layer1: Aligned<[i16; WINDOW * 2 * HIDDEN]>,
    scratch: Scratch<HIDDEN>,
}

impl GyroNetState {
    /// Nothing in it yet; a window leaves nothing for the next one either.
    pub const ZERO: Self = Self { input: Aligned([0; _]), layer1: Aligned([0; _]), scratch: Scratch::ZERO };
}

/// The integer network: weights in place, state owned.
#[derive(Debug, Clone)]
pub struct GyroNet<'w> {
    blob: Blob<'w>,
    state: GyroNetState,
}

impl<'w> GyroNet<'w> {
    /// A network over checked weights.
    #[must_use]
    pub fn new(blob: Blob<'w>) -> Self {
        Self { blob, state: GyroNetState::ZERO }
    }

    /// The weights that it runs on.
    #[must_use]
    pub fn blob(&self) -> &Blob<'w> {
        &self.blob
    }

    /// Normalises the window into the first layer's input; counts what had to be clamped.
    fn load(&mut self, window: &[Features; WINDOW]) -> u16 {
        let clamp = i32::from(self.blob.input_clamp);
        let mut clamped = 0;
        for (step, features) in window.iter().enumerate() {
            for (column, (code, n)) in features.iter().zip(&self.blob.normalisation).enumerate() {
                let value = normalise(*code, *n);
                let inside = value.clamp(-clamp, clamp);
                clamped += u16::from(inside != value);
                self.state.input.0[bilstm::interleaved(step, column, FEATURES)] = inside as i16;
            }
        }
        clamped
    }
}

impl WindowNetwork for GyroNet<'_> {
    fn estimate(&mut self, window: &[Features; WINDOW]) -> Estimate {
        let clamped_inputs = self.load(window);
        let GyroNetState { input, layer1, scratch } = &mut self.state;
        let Blob { layers: [first, second], dense, .. } = &self.blob;
        bilstm::run_layer(first, FEATURES, &input.0, scratch, &mut layer1.0);
        let mut sums = [dense.bias; WINDOW];
        let (forward, backward) = dense.weights.split_at(HIDDEN);
        for (direction, way, weights) in
            [(&second.forward, Way::Forward, forward), (&second.backward, Way::Backward, backward)]
        {
            bilstm::run(direction, way, 2 * HIDDEN, &layer1.0, scratch, |step, hidden| {
                sums[step] = sums[step].wrapping_add(Dense::partial(weights, hidden));
            });
        }
        Estimate { corrections: sums.map(|sum| AngularRate(dense.scale(sum))), clamped_inputs }
    }
}

/// (code - offset) * multiplier / 2^31 to nearest, saturated to 32 bits.
fn normalise(code: i32, n: Normalisation) -> i32 {
    let product = i64::from(code.saturating_sub(n.offset)) * i64::from(n.multiplier);
    ((product + (1 << 30)) >> 31).clamp(i64::from(i32::MIN), i64::from(i32::MAX)) as i32
}
