//! Increments of a three-axis fibre-optic gyro at 1 kHz, in format B. A row's rate is taken as that of the 10 ms before
//! it: ten messages with a tenth of its angle each.

use gyronet::sample::{ImuSample, PERIOD_US};
use gyronet::sensor::dsp1760::message::{Extra, Message, Validity};

/// Number of messages per row.
pub const MESSAGES: u64 = 10;
/// Time from one message to the next, microseconds.
pub const MESSAGE_US: u64 = PERIOD_US / MESSAGES;

/// Encodes a tenth of a row's turn as the message at `now`.
pub fn message(now: u64, sample: &ImuSample) -> Message {
    let seconds = MESSAGE_US as f64 * 1e-6;
    Message {
        rotation: sample.angular_rate.map(|rate| (rate.rad_per_sec() * seconds) as f32),
        acceleration: [0.0; 3],
        extra: Extra::Timed { time: now as u32, temperature: 25 },
        validity: Validity::GYRO,
        sequence: (now / MESSAGE_US % 128) as u8,
    }
}
