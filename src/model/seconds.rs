//! Builds FoGNet's input: the last minute in steps of a second.
//!
//! Over a second, increments (gyro, wheels) are summed and the inertial sensor is averaged, in integers, so that no bit
//! of the gyro's angle is lost. A gap in the gyro ends the window, because the angle turned in it would be missing from
//! the sum; so does a second that has inertial samples or wheel speeds in less than half of its frames.

use super::window::Ring;
use crate::model::window;
use crate::sample::RATE_HZ;
use crate::units::{Angle, WheelSpeed};

/// A FoGNet window has this many steps: a minute (section III-C of the paper).
pub const STEPS: usize = 60;
/// A step has this many features besides the gyro's increment: specific force x, y, z; angular rate x, y, z less the
/// static bias; distance of the left and of the right wheel.
pub const FEATURES: usize = 8;
pub const FRAMES: u32 = RATE_HZ;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FogFrame {
    /// Angle turned about z (up) since the frame before; `None` if part of it is unknown.
    pub turn: Option<Angle>,
    /// Reading of the inertial sensor, its gyro less the static bias ([`window::Features`]).
    pub inertial: Option<window::Features>,
    pub wheels: Option<[WheelSpeed; 2]>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Second {
    /// Means in the codes of [`crate::units`]. A wheel's mean speed over a second is also its distance.
    pub features: [i32; FEATURES],
    pub turn: Angle,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Incomplete {
    Gyro,
    Inertial,
    Wheels,
}

#[derive(Debug, Clone, Copy)]
pub struct SecondSums {
    frames: u32,
    turn: i64,
    inertial: Mean<{ window::FEATURES }>,
    wheels: Mean<2>,
}

#[derive(Debug, Clone, Copy)]
struct Mean<const N: usize> {
    sums: [i64; N],
    count: u32,
}

impl<const N: usize> Mean<N> {
    const ZERO: Self = Self { sums: [0; N], count: 0 };

    fn add(&mut self, codes: Option<[i32; N]>) {
        for (sum, code) in self.sums.iter_mut().zip(codes.unwrap_or([0; N])) {
            *sum += i64::from(code);
        }
        self.count += u32::from(codes.is_some());
    }

    /// Returns the means to the nearest code; `None` when less than half of the second's frames had a value.
    fn take(&self) -> Option<[i32; N]> {
        let count = i64::from(self.count.max(1));
        // A mean of int32s fits an int32.
        (2 * self.count >= FRAMES).then(|| self.sums.map(|sum| (sum + count / 2).div_euclid(count) as i32))
    }
}

impl SecondSums {
    pub const ZERO: Self = Self { frames: 0, turn: 0, inertial: Mean::ZERO, wheels: Mean::ZERO };

    /// Adds a frame; returns the second that it completes. After an error the next frame begins a new second.
    pub fn add(&mut self, frame: &FogFrame) -> Result<Option<Second>, Incomplete> {
        let Some(turn) = frame.turn else {
            *self = Self::ZERO;
            return Err(Incomplete::Gyro);
        };
        self.frames += 1;
        self.turn = self.turn.saturating_add(turn.0);
        self.inertial.add(frame.inertial);
        self.wheels.add(frame.wheels.map(|wheels| wheels.map(|speed| speed.0)));
        if self.frames < FRAMES {
            return Ok(None);
        }
        let Self { turn, inertial, wheels, .. } = core::mem::replace(self, Self::ZERO);
        let [fx, fy, fz, rx, ry, rz] = inertial.take().ok_or(Incomplete::Inertial)?;
        let [left, right] = wheels.take().ok_or(Incomplete::Wheels)?;
        Ok(Some(Second { features: [fx, fy, fz, rx, ry, rz, left, right], turn: Angle(turn) }))
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct NewSecond {
    /// Number of the second, and of the window that it ends.
    pub number: u32,
    /// Says whether it begins a new window: the first one, or the first one after a gap.
    pub is_first: bool,
    pub second: Second,
}

#[derive(Debug, Clone)]
pub struct Minute {
    seconds: Ring<Second, STEPS>,
    newest: u32,
}

impl Minute {
    pub const EMPTY: Self = Self {
        seconds: Ring::without_elements(Second { features: [0; FEATURES], turn: Angle::ZERO }),
        newest: 0,
    };

    /// Adds the next second; returns the window that it ends. A second that was missed begins a new window.
    pub fn follow(&mut self, new: NewSecond) -> SecondsWindow<'_> {
        if new.is_first || new.number != self.newest.wrapping_add(1) {
            self.seconds.clear();
        }
        self.newest = new.number;
        self.add(new.second);
        SecondsWindow { seconds: &self.seconds }
    }

    pub fn add(&mut self, second: Second) {
        self.seconds.add(second);
    }

    /// Returns the window that ends with the newest second; `None` without a second.
    pub fn window(&self) -> Option<SecondsWindow<'_>> {
        (self.seconds.len() > 0).then_some(SecondsWindow { seconds: &self.seconds })
    }
}

/// Gives access to the [`STEPS`] seconds of a window, in place. Before there are as many, the seconds so far are
/// repeated in their order; Fig. 8 of the paper shows that a window is padded, but not with what.
#[derive(Debug, Clone, Copy)]
pub struct SecondsWindow<'m> {
    seconds: &'m Ring<Second, STEPS>,
}

impl<'m> SecondsWindow<'m> {
    pub const fn is_whole(&self) -> bool {
        self.seconds.len() == STEPS
    }

    pub fn iter(&self) -> impl Iterator<Item = &'m Second> + use<'m> {
        let seconds = self.seconds;
        let filled = seconds.len();
        let missing = STEPS - filled;
        (0..STEPS).filter_map(move |step| {
            // Counted from the newest end, so that the repetition ends where the data begin.
            let repeated = (filled.max(1) - missing % filled.max(1) + step) % filled.max(1);
            seconds.get(step.checked_sub(missing).unwrap_or(repeated))
        })
    }
}
