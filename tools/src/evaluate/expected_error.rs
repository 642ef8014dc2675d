//! How often the error of a second lies inside the expected error that is sent with it.
//!
//! The expected error of a sample is that of the mean rate over the second that ends with it. Seconds follow each other
//! without overlap; those with a sample that is not good are left out.

use gyronet::estimate::YawEstimate;
use gyronet::health::Quality;
use gyronet::sample::RATE_HZ;
use gyronet::units::AngularRate;
use serde::Serialize;
use std::fmt;

/// Mean yaw rate from which a second counts as turning, rad/s.
const TURNS: f64 = 0.03;

#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct Seconds {
    pub seconds: usize,
    /// Share of them whose error is inside the expected one.
    pub inside: f64,
    /// The largest error, in expected errors.
    pub worst: f64,
}

impl Seconds {
    fn add(&mut self, error: f64, sigma: f64) {
        let inside = self.inside * self.seconds as f64 + f64::from(u8::from(error <= sigma));
        self.seconds += 1;
        self.inside = inside / self.seconds as f64;
        self.worst = self.worst.max(error / sigma);
    }
}

impl fmt::Display for Seconds {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { seconds, inside, worst } = self;
        if *seconds == 0 {
            return write!(f, "no seconds counted");
        }
        write!(f, "{inside:.2} of {seconds} s (worst {worst:.1})")
    }
}

/// The seconds inside one expected error of the delayed rate.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct ExpectedError {
    pub straight: Seconds,
    pub turning: Seconds,
    #[serde(skip)]
    second: Second,
}

#[derive(Debug, Clone, Copy, PartialEq, Default)]
struct Second {
    samples: u32,
    not_good: bool,
    error: f64,
    turned: f64,
}

impl ExpectedError {
    /// Adds the rate of a sample that was sent, and the true one, rad/s.
    pub fn add(&mut self, sent: &YawEstimate, truth: f64) {
        let second = &mut self.second;
        second.samples += 1;
        second.not_good |= sent.quality != Quality::Good;
        second.error += sent.rate.rad_per_sec() - truth;
        second.turned += truth;
        if second.samples < RATE_HZ {
            return;
        }
        let Second { not_good, error, turned, .. } = std::mem::take(second);
        let mean = |sum: f64| (sum / f64::from(RATE_HZ)).abs();
        let kind = if mean(turned) < TURNS { &mut self.straight } else { &mut self.turning };
        if let Some(sigma) = sent.sigma.map(AngularRate::rad_per_sec).filter(|_| !not_good) {
            kind.add(mean(error), sigma);
        }
    }
}

impl fmt::Display for ExpectedError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "inside 1 sigma: straight {}, turning {}", self.straight, self.turning)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_second_is_inside_or_outside_straight_or_turning_and_good() {
        let mut found = ExpectedError::default();
        let none = "inside 1 sigma: straight no seconds counted, turning no seconds counted";
        assert_eq!(found.to_string(), none);
        let rate = |rad_per_s: f32| AngularRate::from_rad_per_sec(rad_per_s).unwrap();
        // Rate, truth, sigma at the end and quality of a second.
        let seconds = [
            (1e-4, 0.0, 2e-4, Quality::Good),
            (-3e-4, 0.0, 2e-4, Quality::Good),
            (0.1, 0.1001, 2e-4, Quality::Good),
            (0.1, 0.2, 2e-4, Quality::Degraded),
        ];
        for (sent, truth, sigma, quality) in seconds {
            for k in 0..RATE_HZ {
                let sigma = Some(rate(if k == RATE_HZ - 1 { sigma } else { 1.0 }));
                found.add(&YawEstimate { rate: rate(sent), sigma, quality, ..YawEstimate::default() }, truth);
            }
        }
        let text = "inside 1 sigma: straight 0.50 of 2 s (worst 1.5), turning 1.00 of 1 s (worst 0.5)";
        assert_eq!(found.to_string(), text);
    }
}
