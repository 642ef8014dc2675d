//! The path of every method since the start of an outage, from its rates and the speed of the wheels, or by GNSS.

use crate::drive::DT;
use crate::evaluate::methods::Method;

/// The compared methods, in the order of the table.
pub const METHODS: [Method; 6] =
    [Method::STATIC, Method::STATIC_ZERO_RATE, Method::VQF, Method::EKF, Method::NO_MODEL, Method::DELAYED];
pub type ByMethod<T> = [T; METHODS.len()];

/// Where the methods are at one time of an outage.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Point {
    pub heading: ByMethod<f64>,
    /// The distance driven, and that of each method's place from the reference's, m; absent without a speed.
    pub position: Option<(f64, ByMethod<f64>)>,
}

#[derive(Debug, Clone, Copy, Default)]
pub struct Path {
    /// Angles by each method, and by the gyro alone, rad.
    angles: ByMethod<f64>,
    gyro: f64,
    /// Ends by each method, and by the reference, m; the distance, m.
    ends: ByMethod<[f64; 2]>,
    reference: [f64; 2],
    distance: f64,
    /// By how much the gyro's sum is ahead of the truth, rad.
    off: f64,
}

impl Path {
    /// Adds a sample: the rates, the gyro's own, by how much its sum is ahead of the truth, rad, and the speed, m/s.
    pub fn add(&mut self, rates: ByMethod<f64>, gyro: f64, off: f64, speed: Option<f64>) {
        self.gyro += gyro * DT;
        let by = speed.unwrap_or(0.0) * DT;
        self.distance += by.abs();
        let go = |place: &mut [f64; 2], angle: f64| {
            place[0] += by * angle.cos();
            place[1] += by * angle.sin();
        };
        for ((angle, rate), end) in self.angles.iter_mut().zip(rates).zip(&mut self.ends) {
            *angle += rate * DT;
            go(end, *angle);
        }
        go(&mut self.reference, self.gyro - off);
        self.off = off;
    }

    pub fn point(&self, has_speed: bool) -> Point {
        let truth = self.gyro - self.off;
        Point {
            heading: self.angles.map(|angle| angle - truth),
            position: has_speed.then(|| self.position()),
        }
    }

    /// Returns the distance, and what each heading moves the end by, m.
    fn position(&self) -> (f64, ByMethod<f64>) {
        let [x, y] = self.reference;
        (self.distance, self.ends.map(|end| (end[0] - x).hypot(end[1] - y)))
    }
}
