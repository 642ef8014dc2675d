//! Computes the absolute trajectory error (ATE) of a dead-reckoned path, with and without alignment.
//!
//! The paper says "using evo" but not whether rmse or mean, so both are computed. Alignment is Umeyama's (IEEE PAMI
//! 13(4), 1991) without scale, in the plane: with the centred points as vectors, the rotation is
//! `atan2(sum of cross products, sum of dot products)`. evo aligns in three dimensions, which is the same on planar
//! paths, except that it may mirror a path and refuses a straight one; a vehicle cannot be mirrored, and drives
//! straight.

use serde::Serialize;

/// A point in the plane, m.
pub type Point = [f64; 2];

#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct TrajectoryError {
    /// Root of the mean squared distance, m.
    pub rmse_m: f64,
    pub mean_m: f64,
}

impl TrajectoryError {
    /// Compares two paths point by point; `None` if there are no points, or the paths differ in length.
    pub fn new(estimate: &[Point], truth: &[Point]) -> Option<Self> {
        if estimate.len() != truth.len() || estimate.is_empty() {
            return None;
        }
        let count = estimate.len() as f64;
        let squares = || {
            estimate.iter().zip(truth).map(|(e, t)| {
                let [x, y] = [e[0] - t[0], e[1] - t[1]];
                x * x + y * y
            })
        };
        let rmse_m = (squares().sum::<f64>() / count).sqrt();
        let mean_m = squares().map(f64::sqrt).sum::<f64>() / count;
        Some(Self { rmse_m, mean_m })
    }

    /// Compares after the estimate is aligned with the truth ([`Alignment`]).
    pub fn aligned(estimate: &[Point], truth: &[Point]) -> Option<Self> {
        let alignment = Alignment::new(estimate, truth)?;
        let laid: Vec<Point> = estimate.iter().map(|point| alignment.apply(*point)).collect();
        Self::new(&laid, truth)
    }
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Alignment {
    /// The rotation to the left, rad.
    pub yaw: f64,
    pub shift: Point,
}

impl Alignment {
    /// Computes the alignment with the least squared distances; its rotation is zero if all points are the same.
    /// Returns `None` if there are no points, or the paths differ in length.
    pub fn new(estimate: &[Point], truth: &[Point]) -> Option<Self> {
        if estimate.len() != truth.len() || estimate.is_empty() {
            return None;
        }
        let (from, to) = (middle(estimate), middle(truth));
        let (mut cross, mut dot) = (0.0, 0.0);
        for (e, t) in estimate.iter().zip(truth) {
            let ([ex, ey], [tx, ty]) = ([e[0] - from[0], e[1] - from[1]], [t[0] - to[0], t[1] - to[1]]);
            cross += ex * ty - ey * tx;
            dot += ex * tx + ey * ty;
        }
        let turned = Self { yaw: libm::atan2(cross, dot), shift: [0.0; 2] };
        let [x, y] = turned.apply(from);
        Some(Self { shift: [to[0] - x, to[1] - y], ..turned })
    }

    pub fn apply(&self, [x, y]: Point) -> Point {
        let (sin, cos) = (libm::sin(self.yaw), libm::cos(self.yaw));
        [x * cos - y * sin + self.shift[0], x * sin + y * cos + self.shift[1]]
    }
}

fn middle(points: &[Point]) -> Point {
    let count = points.len() as f64;
    [0, 1].map(|axis| points.iter().map(|point| point[axis]).sum::<f64>() / count)
}

#[cfg(test)]
mod tests {
    use super::*;

    const ESTIMATE: [Point; 5] = [[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [2.0, 1.0], [2.0, 2.0]];
    const TRUTH: [Point; 5] = [[0.0, 0.0], [1.0, 0.1], [2.0, 0.1], [2.1, 1.1], [2.0, 2.2]];

    fn close(a: f64, b: f64) {
        assert!((a - b).abs() < 1e-8, "{a} is not {b}");
    }

    /// The expected values were computed with evo 1.38.1.
    #[test]
    fn as_evo_has_it() {
        let raw = TrajectoryError::new(&ESTIMATE, &TRUTH).unwrap();
        close(raw.rmse_m, 0.126_491_106);
        close(raw.mean_m, 0.108_284_271);
        let alignment = Alignment::new(&ESTIMATE, &TRUTH).unwrap();
        close(alignment.yaw, 0.024_019_404);
        close(alignment.shift[0], 0.034_814_09);
        close(alignment.shift[1], 0.066_549_14);
        let aligned = TrajectoryError::aligned(&ESTIMATE, &TRUTH).unwrap();
        close(aligned.rmse_m, 0.069_507_857);
        close(aligned.mean_m, 0.065_222_889);
    }

    #[test]
    fn a_turned_path_is_laid_back_and_a_mirrored_one_is_not() {
        let path: Vec<Point> =
            (0..100).map(|k| [0.1 * f64::from(k), libm::sin(0.1 * f64::from(k))]).collect();
        let away = Alignment { yaw: 2.5, shift: [10.0, -3.0] };
        let turned: Vec<Point> = path.iter().map(|point| away.apply(*point)).collect();
        let error = TrajectoryError::aligned(&turned, &path).unwrap();
        assert!(error.rmse_m < 1e-12, "{error:?}");
        let mirrored: Vec<Point> = path.iter().map(|[x, y]| [*x, -y]).collect();
        let error = TrajectoryError::aligned(&mirrored, &path).unwrap();
        assert!(error.rmse_m > 0.3, "{error:?}");
    }

    #[test]
    fn a_straight_line_and_a_point() {
        let line: Vec<Point> = (0..10).map(|k| [f64::from(k), 0.0]).collect();
        let up: Vec<Point> = (0..10).map(|k| [5.0, f64::from(k)]).collect();
        assert!(TrajectoryError::aligned(&line, &up).unwrap().rmse_m < 1e-12);
        assert_eq!(TrajectoryError::aligned(&[[1.0, 2.0]], &[[3.0, 4.0]]).unwrap().rmse_m, 0.0);
        assert_eq!(TrajectoryError::new(&[], &[]), None);
        assert_eq!(TrajectoryError::aligned(&line, &up[1..]), None);
    }
}
