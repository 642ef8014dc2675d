//! A leg is a straight or curved piece of a route, or a wait.

#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Leg {
    Stand {
        seconds: f64,
    },
    Road {
        metres: f64,
        /// The speed, m/s.
        speed: f64,
        /// Change of heading over the leg, left positive, rad.
        turn: f64,
    },
}

impl Leg {
    pub fn speed(&self) -> f64 {
        match *self {
            Self::Stand { .. } => 0.0,
            Self::Road { speed, .. } => speed,
        }
    }

    /// Returns the curvature at a distance along the leg, 1/m. It is a sine squared: the driver steers in and back
    /// smoothly.
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
