//! A leg is a piece of the way, straight or bent.

/// Describes a piece of the way.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Leg {
    /// The vehicle waits.
    Stand {
        /// The duration.
        seconds: f64,
    },
    /// The vehicle drives.
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
    /// Returns the highest speed in the leg, m/s.
    #[must_use]
    pub fn speed(&self) -> f64 {
        match *self {
            Self::Stand { .. } => 0.0,
            Self::Road { speed, .. } => speed,
        }
    }

    /// Returns the curvature at a place of the leg, 1/m: the driver steers in and back smoothly, as sine squared.
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
