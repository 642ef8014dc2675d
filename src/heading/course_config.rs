//! Settings of the learning by courses.

use super::Heading;

/// A course this inaccurate, rad, teaches nothing; the best accuracy of a speed across that is believed, m/s.
const INACCURATE: f32 = 0.2;
const LEAST_ACROSS: f32 = 0.01;

/// Settings of the learning.
#[derive(Debug, Clone, Copy)]
pub struct CourseConfig {
    /// Slowest speed with a course whose accuracy is not stated, m/s.
    pub slowest: f32,
    /// Accuracy of a course, 1 sigma, besides what the receiver says: slip, wind and the crown of the road, rad.
    pub accuracy: f32,
    /// Accuracy of the speed across the direction of travel, where the receiver says nothing, m/s.
    pub across: f32,
    /// Error of a course in a turn, rad per rad/s, besides the lag's.
    pub turning: f32,
    /// Random walks of the course against the heading (rad) and of the lag (s), per square root of a second.
    pub walks: [f32; 2],
    /// How much the bias at rest and the bias on the road may differ, because the road shakes the sensor, rad/s.
    pub driving: f32,
    /// Gain of a part before anything is learnt, 1 sigma; 0: it is not learnt.
    pub gain: f32,
}

impl CourseConfig {
    /// A road vehicle with a GNSS receiver.
    pub const DEFAULT: Self = Self {
        slowest: 3.0,
        accuracy: 0.02,
        across: 0.1,
        turning: 0.1,
        walks: [2e-3, 0.1],
        driving: 3e-4,
        gain: 0.005,
    };

    /// Returns the accuracy of a course, 1 sigma, rad; `None` where it teaches nothing, because the vehicle is too slow or it
    /// is too inaccurate. Below [`Self::slowest`] it must be stated, and as good as one at that speed that states nothing.
    pub fn sigma(&self, heading: &Heading) -> Option<f32> {
        let (_, speed) = heading.course.zip(heading.speed)?;
        let stated = heading.course_sigma.or(heading.speed_sigma.map(|across| across / speed));
        if speed >= self.slowest {
            Some(stated.unwrap_or(self.across / speed)).filter(|sigma| *sigma < INACCURATE)
        } else {
            let sigma = stated?.max(LEAST_ACROSS / speed);
            (sigma <= self.across / self.slowest).then_some(sigma)
        }
    }
}
