//! This module detects repeated readings: a working part has noise, a stuck one has none.

use crate::sample::ImuSample;

/// The part counts as stuck after this many samples in a row that equal the one before: in all axes of the gyro, in
/// all of the accelerometer, or in one axis that rarely repeats a reading.
///
/// With noise of half a bit an axis at rest repeats nearly every second reading. Even then three axes repeat seven
/// times in a row only once in two days, and once in months where an axis repeats one reading in thirty. No
/// navigation rate of these samples has been sent yet.
pub const STUCK_AFTER: u8 = 7;
/// An axis that often repeats a reading counts as stuck after this many equal samples in a row.
pub const AXIS_STUCK_AFTER: u8 = 30;

/// The axes are accelerometer x, y, z, then gyro x, y, z.
const AXES: usize = 6;
/// Samples over which the frequency of repetitions is averaged, as a power of two.
const AVERAGE: u32 = 8;
const ALWAYS: u16 = 1 << 15;
/// An axis whose share of repetitions is below this normally has enough noise; the share includes the last
/// [`STUCK_AFTER`] samples.
const SELDOM: u16 = ALWAYS / 16;

/// Counts how often each axis repeats a reading.
#[derive(Debug, Clone)]
pub(super) struct Repeats {
    last: Option<[i32; AXES]>,
    /// Samples in a row that were equal to the one before.
    equal: [u8; AXES],
    /// Running share of repeated samples; [`ALWAYS`] stands for all of them.
    repeats: [u16; AXES],
    stuck: [bool; AXES],
}

impl Repeats {
    /// Creates the state in which every axis counts as a coarse one with frequent repetitions.
    pub const fn new() -> Self {
        Self { last: None, equal: [0; AXES], repeats: [ALWAYS; AXES], stuck: [false; AXES] }
    }

    /// Adds a sample and returns whether the part is stuck.
    pub fn observe(&mut self, sample: &ImuSample) -> bool {
        let ([fx, fy, fz], [wx, wy, wz]) = (sample.specific_force, sample.angular_rate);
        let axes = [fx.0, fy.0, fz.0, wx.0, wy.0, wz.0];
        let last = self.last.replace(axes);
        let pairs = last.unwrap_or(axes).into_iter().zip(axes);
        let counts = self.equal.iter_mut().zip(&mut self.repeats).zip(&mut self.stuck);
        for ((before, now), ((equal, repeats), stuck)) in pairs.zip(counts) {
            let repeated = last.is_some() && before == now;
            *equal = if repeated { equal.saturating_add(1) } else { 0 };
            *repeats -= *repeats >> AVERAGE;
            *repeats += if repeated { ALWAYS >> AVERAGE } else { 0 };
            let seldom = *repeats < SELDOM && *equal >= STUCK_AFTER;
            *stuck = repeated && (*stuck || seldom || *equal >= AXIS_STUCK_AFTER);
        }
        let (accelerometer, gyro) = self.equal.split_at(AXES / 2);
        let stands = |part: &[u8]| part.iter().all(|equal| *equal >= STUCK_AFTER);
        stands(accelerometer) || stands(gyro) || self.stuck.contains(&true)
    }
}
