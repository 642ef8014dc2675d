//! Thins the points of a curve and finds their range.

/// Returns every n-th point so that at most `most` are left, and the last point.
pub fn thinned(
    points: impl ExactSizeIterator<Item = (f64, f64)> + DoubleEndedIterator + Clone,
    most: usize,
) -> impl Iterator<Item = (f64, f64)> + Clone {
    let step = points.len().div_ceil(most).max(1);
    let last = points.clone().next_back();
    points.step_by(step).chain(last)
}

/// Returns the least and the greatest value, with `air` times their difference as margins; 0 to 1 for no values.
pub fn range(values: impl Iterator<Item = f64>, air: f64) -> (f64, f64) {
    let (low, high) = values.fold((f64::MAX, f64::MIN), |(low, high), v| (low.min(v), high.max(v)));
    if low > high {
        return (0.0, 1.0);
    }
    // The range of a level curve must not be empty.
    let air = (air * (high - low)).max(1e-7);
    (low - air, high + air)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn thinning_keeps_the_ends() {
        let points: Vec<(f64, f64)> = (0..10_000).map(|k| (f64::from(k), f64::from(k))).collect();
        let kept: Vec<_> = thinned(points.iter().copied(), 1_200).collect();
        assert!(kept.len() <= 1_201);
        assert_eq!((kept[0], kept[kept.len() - 1]), ((0.0, 0.0), (9_999.0, 9_999.0)));
    }

    #[test]
    fn a_level_curve_has_a_range() {
        let (low, high) = range([3.0, 3.0].into_iter(), 0.05);
        assert!(low < 3.0 && high > 3.0);
        assert_eq!(range(std::iter::empty(), 0.05), (0.0, 1.0));
    }
}
