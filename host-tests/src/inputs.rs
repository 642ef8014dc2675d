//! The inputs of a board with everything connected: an MTi, a fibre-optic gyro that is simulated from the reference,
//! and wheel frames.

use gyronet::can::DataFrame;
use gyronet::sample::ImuSample;
use gyronet::sensor::dsp1760::message::{Extra, Message, Validity};
use gyronet::sensor::xsens::MtData2;
use gyronet_tools::drive::wheel_frames;

/// The gyro sends this many messages in 10 ms.
const MESSAGES_PER_ROW: usize = 10;
/// The gyro has this resolution, rad.
const FOG_STEP: f64 = 4e-8;
/// Wheel frames are this many samples apart.
const WHEEL_INTERVAL: usize = 2;
const STANDING_SAMPLES: usize = 600;

/// Holds the inputs of 10 ms, in order.
#[derive(Debug, Clone)]
pub struct Step {
    pub wheels: Option<DataFrame>,
    pub imu: MtData2,
    /// The bytes of the fibre-optic gyro.
    pub fog: Vec<u8>,
}

impl Step {
    /// Returns the inputs that end with a sample, in which the vehicle turns at `reference`, rad/s.
    pub fn new(number: usize, sample: &ImuSample, reference: f64) -> Self {
        let speed = if number < STANDING_SAMPLES { 0.0 } else { 20.0 };
        Self {
            wheels: number.is_multiple_of(WHEEL_INTERVAL).then(|| wheels(speed)),
            imu: MtData2::of(sample, number as u16),
            fog: fog_bytes(number, reference),
        }
    }
}

/// Returns the bytes that the gyro sends in the 10 ms that end with a row, at this rate, rad/s. For the first row it
/// sends only the last message, so that a message set always follows the last message of a row.
fn fog_bytes(number: usize, reference: f64) -> Vec<u8> {
    // A gyro that repeats itself counts as stuck, so no reading equals the one before.
    let noise = if number.is_multiple_of(2) { FOG_STEP / 4.0 } else { -FOG_STEP / 4.0 };
    let reading = ((reference * 0.01 / MESSAGES_PER_ROW as f64 / FOG_STEP).round() * FOG_STEP + noise) as f32;
    let message = |part: usize| Message {
        rotation: [0.0, 0.0, reading],
        acceleration: [0.0; 3],
        extra: Extra::Temperature(25),
        validity: Validity::ALL,
        sequence: ((number * MESSAGES_PER_ROW + part) % 128) as u8,
    };
    let first = if number == 0 { MESSAGES_PER_ROW - 1 } else { 0 };
    (first..MESSAGES_PER_ROW).flat_map(|part| message(part).emit().to_vec()).collect()
}

/// The frame of wheels that all turn at this speed, km/h.
pub fn wheels(speed: f64) -> DataFrame {
    wheel_frames::frame([Some(speed); 4]).expect("a frame")
}
