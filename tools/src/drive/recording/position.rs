//! The course between positions of a GNSS receiver.
//!
//! A position is known to some centimetres against one a second earlier, so the course between them is, after four metres,
//! as good as a receiver's own. It is that of half a second before; of a slow vehicle it would be older, and there is none.

use gyronet::heading::{CourseConfig, Heading};
use gyronet::units::Micros;
use std::collections::VecDeque;
use std::f64::consts::TAU;

/// Least time from one position that is used to the next, us: some recordings repeat or interpolate them.
const APART_US: u64 = 190_000;
/// Least and longest time between the positions of a course, us, and their least distance, m.
const BETWEEN_US: [u64; 2] = [900_000, 2_600_000];
const LEAST_M: f64 = 4.0;
/// Accuracy of the position against a recent one, across the course, 1 sigma, m.
const ACROSS_M: f64 = 0.07;
/// Length of a degree of latitude, m.
const DEGREE_M: f64 = 111_132.0;

/// The way east and north, m, between two places near each other, degrees of latitude and longitude.
pub fn between(from: [f64; 2], to: [f64; 2]) -> [f64; 2] {
    [DEGREE_M * to[0].to_radians().cos() * (to[1] - from[1]), DEGREE_M * (to[0] - from[0])]
}

#[derive(Debug, Default)]
pub struct Track {
    /// The receiver gives courses of its own.
    has_course: bool,
    newest: Option<(f64, f64)>,
    kept: VecDeque<(Micros, [f64; 2])>,
}

impl Track {
    pub(super) fn new(has_course: bool) -> Self {
        Self { has_course, ..Self::default() }
    }

    /// Returns the course that arrives with a row: the receiver's with its accuracy, rad, and the speed, m/s, or in a drive
    /// without one that of the positions, degrees.
    pub fn heading(
        &mut self,
        time: Micros,
        [course, sigma, speed, latitude, longitude]: [Option<f64>; 5],
    ) -> Option<Heading> {
        self.has_course |= course.is_some();
        if !self.has_course {
            return self.add(time, (latitude?, longitude?));
        }
        let course = Some(course?.rem_euclid(TAU) as f32);
        let [course_sigma, speed] = [sigma, speed].map(|value| value.map(|value| value as f32));
        Some(Heading { course, course_sigma, speed, speed_sigma: None })
    }

    /// Adds latitude and longitude, degrees; returns the course that ends there.
    fn add(&mut self, time: Micros, position: (f64, f64)) -> Option<Heading> {
        let is_new = self.newest != Some(position);
        let is_due = self.kept.back().is_none_or(|(last, _)| time.0.saturating_sub(last.0) >= APART_US);
        if !is_new || !is_due {
            return None;
        }
        self.newest = Some(position);
        let here = [position.0, position.1];
        let [least, longest] = BETWEEN_US;
        let age = |then: &Micros| time.0.saturating_sub(then.0);
        while self.kept.front().is_some_and(|(then, _)| age(then) > longest) {
            self.kept.pop_front();
        }
        let found = self.kept.iter().rev().find_map(|(then, there)| {
            let [east, north] = between(*there, here);
            let distance = north.hypot(east);
            (age(then) >= least && distance >= LEAST_M).then(|| Heading {
                course: Some(east.atan2(north).rem_euclid(TAU) as f32),
                course_sigma: Some((ACROSS_M / distance) as f32),
                speed: Some((distance / (age(then) as f64 * 1e-6)) as f32),
                speed_sigma: None,
            })
        });
        let found = found.filter(|found| found.speed >= Some(CourseConfig::DEFAULT.slowest));
        self.kept.push_back((time, here));
        found
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_course_is_clockwise_from_north() {
        // 10 m/s to the north-east at 60 degrees north, five positions a second, each repeated.
        let mut track = Track::default();
        let mut last = None;
        for step in 0..40u64 {
            let along = (step / 2) as f64 * 2.0 * 0.5f64.sqrt() / DEGREE_M;
            last = track.add(Micros(step * 100_000), (60.0 + along, 25.0 + 2.0 * along)).or(last);
        }
        let Some(Heading { course: Some(course), speed: Some(speed), .. }) = last else { panic!("{last:?}") };
        assert!((course - core::f32::consts::FRAC_PI_4).abs() < 1e-3, "{course}");
        assert!((speed - 10.0).abs() < 0.01, "{speed}");
    }

    #[test]
    fn a_standing_vehicle_has_no_course() {
        let mut track = Track::default();
        let flicker = |step: u64| (48.0 + 1e-6 * (step % 3) as f64, 11.0);
        assert!((0..100).all(|step| track.add(Micros(step * 200_000), flicker(step)).is_none()));
    }
}
