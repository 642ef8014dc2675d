//! Measures the error that quantisation adds, by comparing the integer and the f32 network on each
//! window.

use gyronet::model::fognet::{FogEstimate, MinuteNetwork};
use gyronet::model::seconds::SecondsWindow;
use gyronet::model::window::{Features, WINDOW};
use gyronet::model::{Estimate, WindowNetwork};

/// A pair of networks that run on the same windows. It returns the integer estimates and sums the differences.
#[derive(Debug)]
pub struct Both<'n, I, F> {
    integer: &'n mut I,
    reference: &'n mut F,
    error: QuantizationError,
}

/// The differences of two networks, summed over all outputs of all windows.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct QuantizationError {
    pub windows: u64,
    pub clamped_inputs: u64,
    squared_difference: f64,
    squared_reference: f64,
}

impl QuantizationError {
    /// Returns the RMS of the difference over the RMS of the f32 output; zero before the first window.
    pub fn relative_rms(&self) -> f64 {
        if self.squared_reference > 0.0 {
            (self.squared_difference / self.squared_reference).sqrt()
        } else {
            0.0
        }
    }
}

impl<'n, I, F> Both<'n, I, F> {
    pub fn new(integer: &'n mut I, reference: &'n mut F) -> Self {
        Self { integer, reference, error: QuantizationError::default() }
    }

    pub fn error(&self) -> QuantizationError {
        self.error
    }
}

impl<I: WindowNetwork, F: WindowNetwork> WindowNetwork for Both<'_, I, F> {
    fn estimate(&mut self, window: &[Features; WINDOW]) -> Estimate {
        let integer = self.integer.estimate(window);
        let reference = self.reference.estimate(window);
        self.error.windows += 1;
        self.error.clamped_inputs += u64::from(integer.clamped_inputs);
        for (ours, theirs) in integer.corrections.iter().zip(&reference.corrections) {
            let (ours, theirs) = (ours.rad_per_sec(), theirs.rad_per_sec());
            self.error.squared_difference += (ours - theirs) * (ours - theirs);
            self.error.squared_reference += theirs * theirs;
        }
        integer
    }
}

impl<I: MinuteNetwork, F: MinuteNetwork> MinuteNetwork for Both<'_, I, F> {
    fn estimate(&mut self, window: &SecondsWindow<'_>) -> FogEstimate {
        let integer = self.integer.estimate(window);
        let reference = self.reference.estimate(window);
        self.error.windows += 1;
        self.error.clamped_inputs += u64::from(integer.clamped_inputs);
        let (ours, theirs) = (integer.correction.rad(), reference.correction.rad());
        self.error.squared_difference += (ours - theirs) * (ours - theirs);
        self.error.squared_reference += theirs * theirs;
        integer
    }
}
