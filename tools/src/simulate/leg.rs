//! A piece of the way, and its bends.

/// A piece of the way.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Leg {
    /// Waiting.
    Stand {
        /// The duration.
        seconds: f64,
    },
    /// Driving.
    Road {
        /// Length.
        metres: f64,
        /// The speed, m/s.
        speed: f64,
        /// Change of heading on the way, left positive, rad.
        turn: f64,
    },
}

impl Leg {
    /// Highest speed in it, m/s.
    #[must_use]
    pub fn speed(&self) -> f64 {
        match *self {
            Self::Stand { .. } => 0.0,
            Self::Road { speed, .. } => speed,
        }
    }

    /// 1/m at a place of the leg: the wheel is turned in and back smoothly, as sine squared.
    #[must_use]
    pub fn curvature(&self, along: f64) -> f64 {
        match *self {
            Self::Stand { .. } => 0.0,
            Self::Road { metres, turn, .. } => {
                let sine = libm::sin(std::f64::consts::PI * (along / metres).clamp(0.0, 1.0));
                2.0 * turn / metres * sine * sine
            }
        }
    }
}
