//! Builds FoGNet's input: the last minute in steps of a second.
//!
//! Over a second, increments (gyro, wheels) are summed and the inertial sensor is averaged, in integers, so that no bit
//! of the gyro's angle is lost. A second that has inertial samples in less than half of its frames ends the window.

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
    /// Angle turned about z (up) since the frame before.
    pub turn: Angle,
    /// Reading of the inertial sensor, its gyro less the static bias ([`window::Features`]).
    pub inertial: Option<window::Features>,
    pub wheels: [WheelSpeed; 2],
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Second {
    /// Means in the codes of [`crate::units`]. A wheel's mean speed over a second is also its distance.
    pub features: [i32; FEATURES],
    pub turn: Angle,
}

/// A second that lacks inertial samples.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Incomplete;

#[derive(Debug, Clone, Copy)]
pub struct SecondSums {
    frames: u32,
    turn: i64,
    /// Sums of the inertial features and of the wheels' speeds.
    sums: [i64; FEATURES],
    inertial: u32,
}

impl SecondSums {
    pub const ZERO: Self = Self { frames: 0, turn: 0, sums: [0; _], inertial: 0 };

    /// Adds a frame; returns the second that it completes. After an error the next frame begins a new second.
    pub fn add(&mut self, frame: &FogFrame) -> Result<Option<Second>, Incomplete> {
        self.frames += 1;
        self.turn = self.turn.saturating_add(frame.turn.0);
        let codes = frame.inertial.unwrap_or_default().into_iter().chain(frame.wheels.map(|speed| speed.0));
        self.sums.iter_mut().zip(codes).for_each(|(sum, code)| *sum += i64::from(code));
        self.inertial += u32::from(frame.inertial.is_some());
        if self.frames < FRAMES {
            return Ok(None);
        }
        let Self { turn, sums, inertial, .. } = core::mem::replace(self, Self::ZERO);
        if 2 * inertial < FRAMES {
            return Err(Incomplete);
        }
        let features = core::array::from_fn(|k| {
            let count = i64::from(if k < window::FEATURES { inertial } else { FRAMES });
            // To the nearest code. A mean of int32s fits an int32.
            (sums[k] + count / 2).div_euclid(count) as i32
        });
        Ok(Some(Second { features, turn: Angle(turn) }))
    }
}

#[derive(Debug, Clone)]
pub struct Minute {
    seconds: Ring<Second, STEPS>,
}

impl Minute {
    pub const EMPTY: Self =
        Self { seconds: Ring::without_elements(Second { features: [0; FEATURES], turn: Angle::ZERO }) };

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
