//! A window holds the last ten samples as the networks see them: integer codes, the angular rate less the static bias.

use crate::units::{AngularRate, SpecificForce};

/// A GyroNet window has this many samples: 0.1 s at 100 Hz (section III-B of the paper).
pub const WINDOW: usize = 10;
/// A sample has this many features: specific force x, y, z, then angular rate x, y, z.
pub const FEATURES: usize = 6;

/// Holds the features of one sample, in the codes of [`crate::units`].
pub type Features = [i32; FEATURES];

/// Returns the features of a sample; `rates` is its angular rate less the static bias.
pub fn features([fx, fy, fz]: [SpecificForce; 3], [x, y, z]: [AngularRate; 3]) -> Features {
    [fx.0, fy.0, fz.0, x.0, y.0, z.0]
}

pub type Window = Ring<Features, WINDOW>;

impl Window {
    pub const EMPTY: Self = Self::without_elements([0; FEATURES]);
}

#[derive(Debug, Clone)]
pub struct Ring<T, const N: usize> {
    places: [T; N],
    /// The place of the next element: in a full ring, that of the oldest one.
    next: usize,
    filled: usize,
}

impl<T: Copy, const N: usize> Ring<T, N> {
    pub(super) const fn without_elements(filling: T) -> Self {
        Self { places: [filling; N], next: 0, filled: 0 }
    }

    pub fn clear(&mut self) {
        (self.next, self.filled) = (0, 0);
    }

    pub fn add(&mut self, element: T) {
        if let Some(place) = self.places.get_mut(self.next) {
            *place = element;
        }
        self.next = (self.next + 1) % N;
        self.filled = (self.filled + 1).min(N);
    }

    pub(super) const fn len(&self) -> usize {
        self.filled
    }

    pub(super) fn get(&self, number: usize) -> Option<&T> {
        // A ring that is not full begins at place 0.
        self.places.get(if self.filled == N { (self.next + number) % N } else { number })
    }

    pub fn snapshot(&self) -> Option<[T; N]> {
        (self.filled == N).then(|| core::array::from_fn(|number| self.places[(self.next + number) % N]))
    }
}

/// Holds estimates of the yaw gyro's error, one for each sample of a window, oldest first.
pub type Corrections = [AngularRate; WINDOW];

/// Turns a window into corrections; the integer network and the f32 reference implement it.
pub trait WindowNetwork {
    fn estimate(&mut self, window: &[Features; WINDOW]) -> Estimate;
}

impl<N: WindowNetwork + ?Sized> WindowNetwork for &mut N {
    fn estimate(&mut self, window: &[Features; WINDOW]) -> Estimate {
        (**self).estimate(window)
    }
}

/// Holds the result of a window: the gyro's error in each sample.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Estimate {
    pub corrections: Corrections,
    /// Input values that had to be clamped to the network's range.
    pub clamped_inputs: u16,
    /// Sum of the linear parts of the corrections, codes. It contains no constant, because a linear part answers none.
    pub linear_sum: i64,
}

impl Estimate {
    pub const NONE: Self =
        Self { corrections: [AngularRate::ZERO; WINDOW], clamped_inputs: 0, linear_sum: 0 };
}
