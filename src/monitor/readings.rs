//! Faults that show in successive readings only: they repeat themselves, or are further apart than a vehicle moves.
//!
//! A part without a checksum passes a flipped bit on as a reading, which a limit on the step finds. It follows the
//! axis' own steps, because vehicles and roads differ: an RC car shakes its sensor by 1.2 rad/s, a car in a city by
//! 0.07. On the recordings of five vehicles four steps are beyond [`USUAL`] times their RMS, of 0.05 rad/s and 1.8
//! m/s^2 at most.

use crate::sample::{ImuSample, RATE_HZ};
use crate::units::{AngularRate, SpecificForce};

/// The part counts as stuck after this many samples in a row that equal the one before: in all axes of the gyro, in
/// all of the accelerometer, or in one axis that rarely repeats a reading.
///
/// With noise of half a bit an axis at rest repeats nearly every second reading. Even then three axes repeat seven
/// times in a row only once in two days, and once in months where an axis repeats one reading in thirty. No
/// delayed rate of these samples has been sent yet.
pub const STUCK_AFTER: u8 = 7;
/// An axis that often repeats a reading counts as stuck after this many equal samples in a row.
pub const AXIS_STUCK_AFTER: u8 = 30;

/// The axes are accelerometer x, y, z, then gyro x, y, z.
const AXES: usize = 6;
/// Samples over which the frequency of repetitions is averaged, as a power of two.
const AVERAGE: u32 = 8;
const ALWAYS: u16 = 1 << 15;
/// Below this share of repetitions an axis is one with noise; the last [`STUCK_AFTER`] samples count, too.
const SELDOM: u16 = ALWAYS / 16;

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

    pub fn observe(&mut self, sample: &ImuSample) -> bool {
        let axes = sample.codes();
        let last = self.last.replace(axes);
        let Self { equal, repeats, stuck, .. } = self;
        for axis in 0..AXES {
            let (equal, repeats, stuck) = (&mut equal[axis], &mut repeats[axis], &mut stuck[axis]);
            let repeated = last.is_some_and(|last| last[axis] == axes[axis]);
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

/// Plausible steps of the gyro's x, y and z in 10 ms, rad/s: a wrong one of z that passes turns by 0.2 deg.
pub const JUMP_RATE: [f32; 3] = [1.0, 1.0, 0.3];
/// Step of an accelerometer axis in 10 ms that is always plausible, m/s^2.
pub const JUMP_FORCE: f32 = 30.0;
/// Beyond these, a step is plausible up to so many times the RMS of the axis' last steps.
pub const USUAL: f32 = 12.0;
/// Steps of that RMS: 0.64 s.
const STEPS: f32 = 64.0;
/// Times the RMS of the last steps from which on a plausible step of the yaw rate may be a flipped bit, and the samples for
/// which the angle that it then turns wrongly is reported: a second, and those whose rates have not been sent yet.
const SUSPECT: f32 = 6.0;
const SUSPECTED: u8 = RATE_HZ as u8 + REPORTED;
/// At most this many readings in a row are rejected; the next one is accepted whatever its value.
pub const JUMP_PATIENCE: u8 = 3;
/// Samples for which a shift that has ended is still reported: their rates have not been sent yet.
const REPORTED: u8 = 12;
/// Readings in a row near the rate before the jumps that end a shift.
const BACK: u8 = 20;
/// Samples after a rejected one in which an axis's steps do not count for its usual steps, because a fault makes large steps,
/// too; and the samples of rejected steps after which they count, because the vehicle itself may have begun to shake.
const ODD: u16 = 100;
const USUAL_AFTER: u16 = 300;
/// Readings are not compared with a last good reading older than this, microseconds.
const OLD_US: u32 = 50_000;

#[derive(Debug, Clone)]
pub(super) struct Jump {
    /// The last accepted reading: gyro in rad/s, accelerometer in m/s^2.
    last: [f32; AXES],
    at: u32,
    known: bool,
    /// Mean squares of the axes' accepted steps.
    squares: [f32; AXES],
    rejected: u8,
    /// Samples since the first one that was rejected, and since the last one.
    odd_for: u16,
    odd_ago: u16,
    shift: Option<Shift>,
    /// The largest step that may be a flipped bit, rad/s, and the samples for which it counts.
    suspect: (f32, u8),
}

#[derive(Debug, Clone, Copy)]
struct Shift {
    /// Their sum, and the rate before the first of them, rad/s.
    sum: f32,
    before: f32,
    near: u8,
    /// Samples for which it is still reported; `None` while it lasts.
    reported_for: Option<u8>,
}

impl Jump {
    pub const fn new() -> Self {
        Self {
            last: [0.0; AXES],
            at: 0,
            known: false,
            squares: [0.0; AXES],
            rejected: 0,
            odd_for: 0,
            odd_ago: 0,
            shift: None,
            suspect: (0.0, 0),
        }
    }

    /// Checks a reading and returns whether it is too far from the last accepted one; otherwise it is accepted.
    pub fn check(&mut self, sample: &ImuSample) -> bool {
        let at = sample.time.0 as u32;
        let ([wx, wy, wz], [fx, fy, fz]) = (
            sample.angular_rate.map(|rate| rate.0 as f32 / AngularRate::PER_RAD_PER_SEC),
            sample.specific_force.map(|force| force.0 as f32 / SpecificForce::PER_METRE_PER_SEC2),
        );
        let reading = [wx, wy, wz, fx, fy, fz];
        self.pass_on();
        let age = (at.wrapping_sub(self.at) as i32).unsigned_abs();
        if self.known && age <= OLD_US {
            let steps: [f32; AXES] = core::array::from_fn(|axis| reading[axis] - self.last[axis]);
            let is_far = self.is_far(&steps);
            if is_far {
                (self.odd_for, self.odd_ago) = (self.odd_for.max(1), 0);
            }
            if self.rejected < JUMP_PATIENCE && is_far {
                self.rejected += 1;
                return true;
            }
            let [_, _, yaw, ..] = steps;
            self.accept(yaw, is_far);
            let [_, _, square, ..] = self.squares;
            if yaw * yaw > SUSPECT * SUSPECT * square {
                let (before, _) = self.suspect;
                self.suspect = (before.max(libm::fabsf(yaw)), SUSPECTED);
            }
            if self.odd_for == 0 || self.odd_for > USUAL_AFTER {
                for (square, step) in self.squares.iter_mut().zip(steps) {
                    *square += (step * step - *square) / STEPS;
                }
            }
        }
        (self.last, self.at, self.known, self.rejected) = (reading, at, true, 0);
        false
    }

    fn pass_on(&mut self) {
        self.odd_ago = self.odd_ago.saturating_add(1);
        let is_odd = self.odd_for > 0 && (self.odd_ago < ODD || self.shift.is_some());
        let (step, left) = self.suspect;
        self.suspect = if left > 0 { (step, left - 1) } else { (0.0, 0) };
        self.odd_for = if is_odd { self.odd_for.saturating_add(1) } else { 0 };
        let reported_for = self.shift.as_mut().and_then(|shift| shift.reported_for.as_mut());
        if reported_for.is_some_and(|left| {
            *left = left.saturating_sub(1);
            *left == 0
        }) {
            self.shift = None;
        }
    }

    /// Adds a step of the yaw rate. A jump that lasts begins a shift, to which more jumps add; it ends once they add
    /// up to less than a jump with the rate near the one before it: a wrong gain makes steps that are no jumps, too.
    fn accept(&mut self, step: f32, is_far: bool) {
        let [.., smallest] = JUMP_RATE;
        let [_, _, yaw, ..] = self.last;
        let Some(shift) = &mut self.shift else {
            if is_far && libm::fabsf(step) > smallest {
                self.shift = Some(Shift { sum: step, before: yaw, near: 0, reported_for: None });
            }
            return;
        };
        if is_far || libm::fabsf(step + shift.sum) < smallest && libm::fabsf(shift.sum) > smallest {
            shift.sum += step;
        }
        let is_near = libm::fabsf(yaw + step - shift.before) < smallest && libm::fabsf(shift.sum) < smallest;
        shift.near = if is_near { shift.near + 1 } else { 0 };
        if shift.near >= BACK {
            self.shift = None;
        }
    }

    /// Notes that the present level of the readings is right.
    pub fn settle(&mut self) {
        if let Some(shift) = &mut self.shift {
            shift.reported_for.get_or_insert(REPORTED);
        }
    }

    /// Returns the yaw rate by which the newest reading is off if the jumps that were accepted are faults, rad/s.
    pub fn shift(&self) -> f32 {
        let [_, _, yaw, ..] = self.last;
        self.shift.map_or(0.0, |shift| libm::fabsf(shift.sum).max(libm::fabsf(yaw - shift.before)))
    }

    pub fn suspect(&self) -> f32 {
        let (step, _) = self.suspect;
        step / RATE_HZ as f32
    }

    fn is_far(&self, steps: &[f32; AXES]) -> bool {
        let [x, y, z] = JUMP_RATE;
        let always = [x, y, z, JUMP_FORCE, JUMP_FORCE, JUMP_FORCE];
        steps.iter().zip(always).zip(self.squares).any(|((step, always), square)| {
            step * step > always * always && step * step > USUAL * USUAL * square
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sample::{PERIOD_US, Validity};
    use crate::units::Micros;

    /// Checks a second of a yaw rate; returns the sums of the rates that pass, less the true ones, and of the shifts, rad.
    fn second(jump: &mut Jump, from: u64, read: impl Fn(f32) -> f32) -> (f32, f32) {
        let (mut wrong, mut reported) = (0.0f32, 0.0);
        for step in from..from + 100 {
            let rate = 0.02 + 0.03 * libm::sinf(step as f32 * 0.9);
            let mut angular_rate = [AngularRate(0); 3];
            angular_rate[2] = AngularRate::from_rad_per_sec(read(rate)).unwrap();
            let specific_force = [SpecificForce(0); 3];
            let (time, validity) = (Micros(step * PERIOD_US), Validity::Good);
            let sample = ImuSample { time, angular_rate, specific_force, temperature: None, validity };
            if !jump.check(&sample) {
                wrong += 0.01 * (read(rate) - rate);
                reported += 0.01 * jump.shift();
            }
        }
        (libm::fabsf(wrong), reported)
    }

    #[test]
    fn a_gain_of_sixty_is_reported_though_every_reading_jumps_back_and_forth() {
        let mut jump = Jump::new();
        assert_eq!(second(&mut jump, 0, |rate| rate), (0.0, 0.0));
        let (wrong, reported) = second(&mut jump, 100, |rate| 60.0 * rate);
        assert!(wrong > 0.1 && reported > 0.5 * wrong, "{wrong} rad, {reported} reported");
        // It is not used to such steps, so what is right again is believed soon.
        second(&mut jump, 200, |rate| rate);
        assert_eq!(second(&mut jump, 300, |rate| rate).0, 0.0);
    }

    #[test]
    fn a_vehicle_that_begins_to_shake_is_believed_after_three_seconds() {
        let mut jump = Jump::new();
        for second_from in [0, 100, 200, 300, 400, 500] {
            second(&mut jump, second_from, |rate| rate + 20.0 * (rate - 0.02));
        }
        assert_eq!(jump.rejected, 0);
        assert!(jump.squares[2] > 0.02, "{}", jump.squares[2]);
    }
}
