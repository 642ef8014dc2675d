//! Makes the three protected yaw messages (rate, angle, detail) from estimates.
//!
//! A constant rate would have the same rounding error every time. So each message's residual is added to the next
//! value, to the last bit: the sum of the rates sent differs from that of the exact ones by at most half an LSB.

use super::DataFrame;
use super::e2e::{Profile, Protector};
use super::yaw::{
    AngleMessage, DetailMessage, Quality, RATE_NOT_AVAILABLE, RateMessage, encode_angle, encode_latency,
    encode_sigma,
};
use crate::estimate::YawEstimate;
use embedded_can::{Frame, StandardId};

/// The encoder of the yaw messages: a set per `every` samples, with their mean rate and correction, so that rate times
/// period is the full angle, and their worst quality and largest expected error ([`YawEstimate::with_earlier`]).
#[derive(Debug, Clone, Copy)]
pub struct YawEncoder {
    protectors: [Protector; 3],
    sample_counter: u8,
    every: u8,
    samples: u8,
    rate: Mean,
    correction: Mean,
    /// The samples since the last set, joined.
    together: Option<YawEstimate>,
}

impl YawEncoder {
    /// Creates an encoder with the profiles of rate, angle and detail, for sets of `every` samples, at least one.
    pub const fn new([rate, angle, detail]: [Profile; 3], every: u8) -> Self {
        Self {
            protectors: [Protector::new(rate), Protector::new(angle), Protector::new(detail)],
            sample_counter: 0,
            every: if every == 0 { 1 } else { every },
            samples: 0,
            rate: Mean::new(MICRO_DEG_PER_SEC_Q32),
            correction: Mean::new(FIFTH_MILLI_DEG_PER_SEC_Q32),
            together: None,
        }
    }

    /// Adds a sample, and passes the frames to `send` when they are due; `ids` (11 bits) are of rate, angle and detail.
    pub fn send(&mut self, sample: &YawEstimate, ids: [u16; 3], mut send: impl FnMut(DataFrame)) {
        let Some(messages) = self.encode(sample) else { return };
        for (message, id) in messages.iter().zip(ids) {
            let frame = StandardId::new(id).and_then(|id| DataFrame::new(id, message));
            frame.into_iter().for_each(&mut send);
        }
    }

    /// Adds a sample, and returns the messages of rate, angle and detail when they are due.
    #[inline(never)]
    pub fn encode(&mut self, sample: &YawEstimate) -> Option<[[u8; 8]; 3]> {
        self.rate.sum += i64::from(sample.rate.0);
        self.correction.sum += i64::from(sample.correction.0);
        let joined;
        let sample = match &self.together {
            Some(earlier) => {
                joined = sample.with_earlier(earlier);
                &joined
            }
            None => sample,
        };
        self.samples += 1;
        if self.samples < self.every {
            self.together = Some(*sample);
            return None;
        }
        (self.samples, self.together) = (0, None);
        let rate = self.rate.take(self.every);
        let correction = self.correction.take(self.every);
        let rate = match sample.quality {
            Quality::Good | Quality::Degraded => rate,
            Quality::Initialising => {
                // Receivers do not integrate rates from the initialisation.
                self.rate.reset();
                rate
            }
            Quality::Unusable => {
                self.rate.reset();
                RATE_NOT_AVAILABLE
            }
        };
        let correction = self.limit(correction);
        let messages = [
            RateMessage { rate, source: sample.source, quality: sample.quality }.emit(),
            AngleMessage { yaw: encode_angle(sample.yaw), faults: sample.faults }.emit(),
            DetailMessage {
                correction,
                sigma: encode_sigma(sample.sigma),
                latency: encode_latency(sample.latency_us),
            }
            .emit(),
        ];
        Some(self.protect(messages))
    }

    fn limit(&mut self, correction: i32) -> i16 {
        let limited = correction.clamp(-i32::from(i16::MAX), i16::MAX.into());
        if limited != correction {
            self.correction.reset();
        }
        limited as i16
    }

    fn protect(&mut self, mut messages: [[u8; 8]; 3]) -> [[u8; 8]; 3] {
        for (message, protector) in messages.iter_mut().zip(&mut self.protectors) {
            message[2] = self.sample_counter;
            // Eight bytes fit every profile.
            let _ = protector.protect(message);
        }
        self.sample_counter = self.sample_counter.wrapping_add(1);
        messages
    }
}

/// Signal LSBs per rate code (2^-27 rad/s), times 2^32, for an LSB of 1e-6 deg/s, 180 / pi / 2^27 / 1e-6, too small by
/// 2.3e-10, and of 2e-4 deg/s. At most 2^31: an LSB below two codes would gain nothing.
const MICRO_DEG_PER_SEC_Q32: i64 = 1_833_464_944;
const FIFTH_MILLI_DEG_PER_SEC_Q32: i64 = 9_167_325;

/// A mean without loss: the division's remainder stays in the sum, the rounding to the signal's code in the residual.
#[derive(Debug, Clone, Copy)]
struct Mean {
    factor_q32: i64,
    sum: i64,
    /// Sum of the exact values minus the sum of the codes sent, in LSB x 2^-32.
    residual: i64,
}

impl Mean {
    const fn new(factor_q32: i64) -> Self {
        Self { factor_q32, sum: 0, residual: 0 }
    }

    /// Returns the code nearest to the mean plus the residual of earlier ones.
    fn take(&mut self, samples: u8) -> i32 {
        // Of one sample it is the sample. The processor divides 32 bits alone in hardware.
        let mean =
            if samples == 1 { self.sum } else { self.sum.checked_div_euclid(samples.into()).unwrap_or(0) };
        self.sum -= mean * i64::from(samples);
        // The mean of i32 values fits an i32: at most 2^62 + 2^31.
        let wanted = mean * self.factor_q32 + self.residual;
        let sent = (wanted + (1 << 31)) >> 32;
        self.residual = wanted - (sent << 32);
        sent as i32
    }

    /// Drops sum and residual, after a message that was marked bad.
    fn reset(&mut self) {
        (self.sum, self.residual) = (0, 0);
    }
}
