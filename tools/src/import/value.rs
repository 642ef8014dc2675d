//! A measurement from a log, in SI units.

/// A measurement of one channel. Axes are x forward, y left, z up, unless the log says otherwise.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Value {
    /// Specific force, m/s^2, and angular rate, rad/s.
    Imu([f64; 3], [f64; 3]),
    /// Speed forward, m/s, and yaw rate to the left, rad/s.
    Odometry(f64, f64),
    /// A GNSS fix.
    Position(Fix),
    /// A plain number in the unit of the channel's name.
    Number(f64),
}

/// A GNSS fix.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Fix {
    /// Latitude and longitude, degrees.
    pub degrees: [f64; 2],
    /// Standard deviation of the position in each horizontal direction, m, if the receiver gives one.
    pub sigma_m: Option<f64>,
    /// Speed over ground, m/s, course, rad clockwise from north, and standard deviation of the course, rad.
    pub velocity: Option<[f64; 3]>,
}

/// The kind of a channel.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Kind {
    /// Gyro and accelerometer.
    Imu,
    /// Speed and yaw rate of a vehicle's odometry.
    Odometry,
    /// GNSS.
    Position,
    /// A plain number.
    Number,
}

impl Kind {
    pub fn name(self) -> &'static str {
        match self {
            Self::Imu => "IMU",
            Self::Odometry => "odometry",
            Self::Position => "position",
            Self::Number => "signal",
        }
    }
}

impl Value {
    /// Returns the kind of channel that has such values.
    pub fn kind(&self) -> Kind {
        match self {
            Self::Imu(..) => Kind::Imu,
            Self::Odometry(..) => Kind::Odometry,
            Self::Position(_) => Kind::Position,
            Self::Number(_) => Kind::Number,
        }
    }

    pub(super) fn is_finite(&self) -> bool {
        match self {
            Self::Imu(force, rate) => force.iter().chain(rate).all(|value| value.is_finite()),
            Self::Odometry(speed, rate) => speed.is_finite() && rate.is_finite(),
            Self::Position(fix) => {
                let [latitude, longitude] = fix.degrees;
                latitude.abs() <= 90.0 && longitude.abs() <= 360.0
            }
            Self::Number(value) => value.is_finite(),
        }
    }
}

/// A measurement and its time on the clock of its file, s.
pub type Sample = (f64, Value);
