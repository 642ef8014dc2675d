//! The classic baseline: a linear-phase low-pass, 10 Hz pass band, 15 Hz stop band.
//!
//! The paper's Table I filters the raw gyro with it. It removes noise above 15 Hz, which an
//! integral removes anyway; it leaves the bias, and it delays: the row is there to show that
//! smoothing is not correcting.
//!
//! The taps come from a Kaiser window (Oppenheim and Schafer, Discrete-Time Signal Processing,
//! section 7.5.3): a sinc that cuts off midway between the bands, times a window whose shape
//! beta and length follow from the attenuation and the width of the transition.

use gyronet::sample::RATE_HZ;
use std::f64::consts::PI;

/// The requirements of a filter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Design {
    /// End of the pass band, Hz.
    pub pass_hz: f64,
    /// Begin of the stop band, Hz.
    pub stop_hz: f64,
    /// Attenuation in the stop band, dB; the pass band's ripple is as small.
    pub attenuation_db: f64,
}

impl Design {
    /// The paper's bands. It does not say the attenuation: 60 dB.
    pub const PAPER: Self = Self { pass_hz: 10.0, stop_hz: 15.0, attenuation_db: 60.0 };

    /// The taps, symmetric, with a sum of 1.
    #[must_use]
    pub fn taps(&self) -> Vec<f64> {
        let radians = |hz: f64| 2.0 * PI * hz / f64::from(RATE_HZ);
        let width = radians(self.stop_hz - self.pass_hz);
        let cutoff = radians((self.pass_hz + self.stop_hz) / 2.0);
        let order = ((self.attenuation_db - 7.95) / (2.285 * width)).ceil();
        let beta = self.beta();
        let taps: Vec<f64> = (0..=order as usize)
            .map(|k| {
                let from_middle = k as f64 - order / 2.0;
                let along = 2.0 * k as f64 / order - 1.0;
                sinc(cutoff, from_middle) * bessel_i0(beta * (1.0 - along * along).max(0.0).sqrt())
            })
            .collect();
        let sum: f64 = taps.iter().sum();
        taps.iter().map(|tap| tap / sum).collect()
    }

    /// Shape of the window, Kaiser's empirical fit for 21 dB and more.
    fn beta(&self) -> f64 {
        let a = self.attenuation_db;
        if a > 50.0 { 0.1102 * (a - 8.7) } else { 0.5842 * (a - 21.0).powf(0.4) + 0.07886 * (a - 21.0) }
    }
}

/// sin(cutoff x n) / (pi x n).
fn sinc(cutoff: f64, n: f64) -> f64 {
    if n == 0.0 { cutoff / PI } else { (cutoff * n).sin() / (PI * n) }
}

/// Modified Bessel function of the first kind, order 0, by its power series.
fn bessel_i0(x: f64) -> f64 {
    let quarter = x * x / 4.0;
    let (mut term, mut sum) = (1.0, 1.0);
    for k in 1..64 {
        term *= quarter / f64::from(k * k);
        sum += term;
    }
    sum
}

/// Filters causally: a sample's output knows only what came before, so it is late by half the
/// length of the filter. Before the first sample the input is taken to have been the first one.
#[must_use]
pub fn filter(taps: &[f64], input: &[f64]) -> Vec<f64> {
    (0..input.len())
        .map(|now| taps.iter().enumerate().map(|(k, tap)| tap * input[now.saturating_sub(k)]).sum())
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Magnitude of the frequency response.
    fn response(taps: &[f64], hz: f64) -> f64 {
        let phase = |k: usize| 2.0 * PI * hz / f64::from(RATE_HZ) * k as f64;
        let re: f64 = taps.iter().enumerate().map(|(k, tap)| tap * phase(k).cos()).sum();
        let im: f64 = taps.iter().enumerate().map(|(k, tap)| tap * phase(k).sin()).sum();
        re.hypot(im)
    }

    #[test]
    fn bands_are_as_asked() {
        let taps = Design::PAPER.taps();
        assert_eq!(taps.len(), 74);
        let band = |from: f64, to: f64| (0..=500).map(move |k| from + (to - from) * f64::from(k) / 500.0);
        let ripple = band(0.0, 10.0).map(|hz| (response(&taps, hz) - 1.0).abs()).fold(0.0, f64::max);
        let leak = band(15.0, 50.0).map(|hz| response(&taps, hz)).fold(0.0, f64::max);
        // Kaiser's formula for the length is a fit: 59.1 dB of the 60.
        assert!(ripple < 1.12e-3, "{ripple}");
        assert!(leak < 1.12e-3, "{leak}");
    }

    #[test]
    fn phase_is_linear() {
        let taps = Design::PAPER.taps();
        for (front, back) in taps.iter().zip(taps.iter().rev()) {
            assert!((front - back).abs() < 1e-15);
        }
    }

    #[test]
    fn a_ramp_comes_out_late_by_half_the_length() {
        let ramp: Vec<f64> = (0..400).map(f64::from).collect();
        let out = filter(&Design::PAPER.taps(), &ramp);
        assert!((out[399] - (399.0 - 36.5)).abs() < 1e-9, "{}", out[399]);
        assert_eq!(out[0], 0.0);
    }

    #[test]
    fn bessel_known_values() {
        assert!((bessel_i0(1.0) - 1.266_065_877_752_008_4).abs() < 1e-14);
        assert!((bessel_i0(5.0) - 27.239_871_823_604_442).abs() < 1e-12);
    }
}
