//! Dead reckoning computes a path from wheel speeds and a yaw rate (equations 3 to 5 of the paper).
//!
//! The heading is that in the middle of the step: the heading at the beginning of the step, as in equation 4, lags by
//! half a step and shifts the path by v dt / 2 times the change of heading in every turn.

/// Position, m, and heading, rad, not wrapped: x ahead and y to the left of heading 0.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Track {
    pub position: [f64; 2],
    pub yaw: f64,
}

impl Track {
    /// Advances by one step: the distance of the left and the right wheel, m, and the turn of the vehicle, rad.
    pub fn step(&mut self, wheels: [f64; 2], turned: f64) {
        let [left, right] = wheels;
        let middle = self.yaw + turned / 2.0;
        let distance = (left + right) / 2.0;
        self.position[0] += distance * libm::cos(middle);
        self.position[1] += distance * libm::sin(middle);
        self.yaw += turned;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn straight_lines_and_circles_end_where_they_must() {
        let mut track = Track::default();
        // The mean of both wheels.
        (0..100).for_each(|_| track.step([0.05, 0.15], 0.0));
        assert!((track.position[0] - 10.0).abs() < 1e-12 && track.position[1] == 0.0);
        // A circle of 10 m radius to the left, in 0.01 rad steps: each is the chord of an arc, which the heading in
        // the middle of the step makes exact in direction.
        let mut track = Track::default();
        (0..157).for_each(|_| track.step([0.1; 2], 0.01));
        let (sin, cos) = f64::sin_cos(1.57);
        assert!((track.position[0] - 10.0 * sin).abs() < 1e-4 && (track.yaw - 1.57).abs() < 1e-12);
        assert!((track.position[1] - 10.0 * (1.0 - cos)).abs() < 1e-4);
    }
}
