//! The vehicle's wheel frames, in the layout of Toyota's 0xAA: 0.01 km/h, offset -67.67 km/h, front right first.

use super::ride::Travelled;
use super::sensor::During;
use crate::wire::{data_frame, id11};
use gyronet::can::DataFrame;
use gyronet_tools::random::Random;

/// Time between two frames, s, and the distance of left and right wheels, m.
pub const PERIOD: f64 = 0.02;
const TRACK: f64 = 1.5;
/// Sigma of a turning wheel's speed: the pulses' length, as a share.
const RIPPLE: f64 = 2e-3;

#[derive(Debug, Clone, Copy)]
pub enum WheelFault {
    /// All speeds are multiplied: 0 where the wheels are locked or the frames frozen at zero.
    All(f64),
    /// One wheel's speed is multiplied.
    One(usize, f64),
    /// Driven wheels (the front ones) spin, m/s.
    Spin(f64),
    /// The frames repeat the last speeds.
    Frozen,
    /// A wheel's fault bit is set (bit 15 of its speed).
    Marked(usize),
    Silent,
}

/// The frames of a ride with their times; `shown` is the lowest speed that the sensors show, m/s.
pub fn frames(
    travelled: &Travelled,
    shown: f64,
    faults: &[During<WheelFault>],
    random: &mut Random,
) -> Vec<(f64, DataFrame)> {
    let mut frames = Vec::new();
    let mut speeds = [0.0; 4];
    for number in 1..(travelled.seconds() / PERIOD) as usize {
        let at = number as f64 * PERIOD - 0.003;
        let now: Vec<WheelFault> =
            faults.iter().filter(|fault| fault.holds(at)).map(|fault| fault.what).collect();
        if now.iter().any(|fault| matches!(fault, WheelFault::Silent)) {
            continue;
        }
        let mut marked = [0; 4];
        if !now.iter().any(|fault| matches!(fault, WheelFault::Frozen)) {
            let (middle, half) = (travelled.rolled(at), travelled.rate(at) * TRACK / 2.0);
            // Where the wheels do not roll, a turn of what carries the vehicle does not turn them.
            let half = if middle == 0.0 { 0.0 } else { half };
            speeds = [middle + half, middle - half, middle + half, middle - half];
        }
        for fault in now {
            match fault {
                WheelFault::All(by) => speeds = speeds.map(|speed| speed * by),
                WheelFault::One(wheel, by) => speeds[wheel] *= by,
                WheelFault::Spin(by) => speeds[..2].iter_mut().for_each(|speed| *speed += by),
                WheelFault::Marked(wheel) => marked[wheel] = 0x8000,
                WheelFault::Frozen | WheelFault::Silent => {}
            }
        }
        let codes: [u16; 4] = std::array::from_fn(|wheel| {
            let speed = speeds[wheel].abs() * (1.0 + RIPPLE * random.normal());
            let speed = if speed < shown { 0.0 } else { speed };
            ((speed * 3.6 + 67.67) * 100.0).round() as u16 | marked[wheel]
        });
        let data = codes.map(u16::to_be_bytes).concat();
        frames.push((at, data_frame(id11(0xAA), &data)));
    }
    frames
}
