//! Computes the GNSS course over ground and its uncertainty, for the column `ref_yaw`.
//!
//! A receiver that gives a velocity has the better course, by Doppler. From positions alone, the course at a fix is
//! the direction of the chord between a fix before it and a fix after it. They are so far apart that the chord is
//! long compared with the scatter of neighbouring fixes. The scatter is computed from third differences, to which the
//! motion of the vehicle hardly contributes. An error that neighbouring fixes share, most of a cheap receiver's
//! error, shifts the path without rotating it.

use super::value::Fix;

/// Least speed for a course, m/s; below it the direction is noise.
const SLOWEST: f64 = 1.0;
/// Standard deviation at which a course is rejected, rad.
const WORST: f64 = 0.15;
/// Longest time of a chord, s; a turn makes a longer chord wrong.
const LONGEST: f64 = 4.0;
/// Least scatter, m: the accuracy of RTK.
const LEAST_SCATTER: f64 = 0.01;
/// Metres per degree of latitude.
const METRES: f64 = 111_320.0;

/// The course at one time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Course {
    pub seconds: f64,
    /// Course, rad to the left of an arbitrary direction, unwrapped.
    pub rad: f64,
    /// Standard deviation of the course, rad.
    pub sigma: f64,
    /// Speed, m/s.
    pub speed: f64,
}

pub fn courses(fixes: &[(f64, Fix)]) -> Vec<Course> {
    let doppler = fixes.iter().any(|(_, fix)| fix.velocity.is_some());
    let mut courses: Vec<Course> = if doppler {
        fixes.iter().filter_map(|(seconds, fix)| by_velocity(*seconds, fix)).collect()
    } else {
        by_positions(fixes)
    };
    let mut last: Option<f64> = None;
    for course in &mut courses {
        if let Some(last) = last {
            let turns = ((course.rad - last) / std::f64::consts::TAU).round();
            course.rad -= std::f64::consts::TAU * turns;
        }
        last = Some(course.rad);
    }
    courses
}

fn by_velocity(seconds: f64, fix: &Fix) -> Option<Course> {
    let [speed, clockwise, sigma] = fix.velocity?;
    let good = speed >= SLOWEST && sigma > 0.0 && sigma < WORST && clockwise.is_finite();
    good.then_some(Course { seconds, rad: -clockwise, sigma, speed })
}

fn by_positions(fixes: &[(f64, Fix)]) -> Vec<Course> {
    let Some((_, origin)) = fixes.first() else { return Vec::new() };
    let east = METRES * origin.degrees[0].to_radians().cos();
    let points: Vec<[f64; 2]> = fixes
        .iter()
        .map(|(_, fix)| {
            let [latitude, longitude] = [0, 1].map(|k| fix.degrees[k] - origin.degrees[k]);
            [east * longitude, METRES * latitude]
        })
        .collect();
    let scatter = scatter(&points);
    let chord = |k: usize| {
        let time = fixes[k].0;
        for reach in 1..=k.min(points.len() - 1 - k) {
            let (from, to) = (k - reach, k + reach);
            let seconds = fixes[to].0 - fixes[from].0;
            if seconds > LONGEST {
                return None;
            }
            let [x, y] = [0, 1].map(|axis| points[to][axis] - points[from][axis]);
            let length = x.hypot(y);
            let (sigma, speed) = (std::f64::consts::SQRT_2 * scatter / length, length / seconds);
            // Use the shortest chord that is good enough, since a longer one cuts a bend.
            if speed >= SLOWEST && sigma < 0.5 * WORST {
                return Some(Course { seconds: time, rad: y.atan2(x), sigma, speed });
            }
        }
        None
    };
    (1..points.len().max(1) - 1).filter_map(chord).collect()
}

/// Returns the standard deviation of neighbouring fixes in one direction, m, by the median third difference.
fn scatter(points: &[[f64; 2]]) -> f64 {
    let third = |w: &[[f64; 2]], axis: usize| w[3][axis] - 3.0 * w[2][axis] + 3.0 * w[1][axis] - w[0][axis];
    let mut sizes: Vec<f64> =
        points.windows(4).flat_map(|w| [third(w, 0).abs(), third(w, 1).abs()]).collect();
    if sizes.is_empty() {
        return f64::INFINITY;
    }
    sizes.sort_unstable_by(f64::total_cmp);
    // 1 + 9 + 9 + 1 variances; a median of absolute values is 0.6745 standard deviations.
    (sizes[sizes.len() / 2] / (0.6745 * 20f64.sqrt())).max(LEAST_SCATTER)
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand_chacha::ChaCha8Rng;
    use rand_chacha::rand_core::SeedableRng;
    use rand_distr::{Distribution, Normal};

    /// Returns five fixes per second along a wide bend at 10 m/s, with white noise, and the true course.
    fn bend(noise: f64) -> (Vec<(f64, Fix)>, Vec<f64>) {
        let (mut random, normal) = (ChaCha8Rng::seed_from_u64(7), Normal::new(0.0, 1.0).unwrap());
        let (mut x, mut y, mut heading) = (0.0, 0.0, 0.3f64);
        let (mut fixes, mut truth) = (Vec::new(), Vec::new());
        for k in 0..600 {
            let mut noisy = |at: f64| -> f64 { at + noise * normal.sample(&mut random) };
            let degrees = [50.0 + noisy(y) / METRES, 8.0 + noisy(x) / (METRES * 50f64.to_radians().cos())];
            fixes.push((0.2 * f64::from(k), Fix { degrees, sigma_m: Some(2.5), velocity: None }));
            truth.push(heading);
            (x, y) = (x + 2.0 * heading.cos(), y + 2.0 * heading.sin());
            heading += if (200..300).contains(&k) { 0.04 } else { 0.0 };
        }
        (fixes, truth)
    }

    #[test]
    fn the_uncertainty_is_that_of_the_course() {
        for noise in [0.02, 0.1, 0.3] {
            let (fixes, truth) = bend(noise);
            let courses = courses(&fixes);
            assert!(courses.len() > 500, "{noise} m: {}", courses.len());
            let errors = courses.iter().map(|course| {
                let at = (course.seconds / 0.2).round() as usize;
                // The chord from k - n to k + n has the mean heading, which lags half a step behind the heading at k.
                (course.rad - 0.5 * (truth[at] + truth[at - 1])) / course.sigma
            });
            let rms = (errors.map(|error| error * error).sum::<f64>() / courses.len() as f64).sqrt();
            assert!((0.4..1.6).contains(&rms), "{noise} m: {rms} of the standard deviation");
        }
    }

    #[test]
    fn a_standing_receiver_has_no_course() {
        let (mut fixes, _) = bend(0.3);
        let first = fixes[0].1.degrees;
        for (k, (_, fix)) in fixes.iter_mut().enumerate() {
            fix.degrees = [first[0] + 1e-6 * (k % 3) as f64, first[1]];
        }
        assert_eq!(courses(&fixes), []);
        assert_eq!(courses(&fixes[..1]), []);
        assert_eq!(courses(&[]), []);
    }

    #[test]
    fn doppler_is_taken_where_the_receiver_gives_it() {
        let fix = |speed, course, sigma| Fix {
            degrees: [50.0, 8.0],
            sigma_m: None,
            velocity: Some([speed, course, sigma]),
        };
        let fixes = [
            (0.0, fix(5.0, 3.1, 0.02)),
            (1.0, fix(0.2, 1.0, 0.02)),
            (2.0, fix(5.0, -3.1, 0.02)),
            (3.0, fix(5.0, 1.0, 0.9)),
        ];
        let courses = courses(&fixes);
        assert_eq!(courses.len(), 2);
        assert!((courses[1].rad - courses[0].rad + (std::f64::consts::TAU - 6.2)).abs() < 1e-9);
    }
}
