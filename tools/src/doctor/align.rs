//! Finds the offset between the clocks of two files, by cross-correlation of a yaw rate in each.
//!
//! Both rates are resampled to 2 Hz, and every lag with enough overlap is tried. Around the best lag they are
//! compared again at 100 Hz, and a parabola through the best three lags gives the fraction. The correlation
//! coefficient does not depend on scale and bias, so units and sensors may differ.

/// A yaw rate over time: pairs of time, s, and rate.
pub type Rate = [(f64, f64)];

/// Coarse step, s, and fine step, s.
const STEPS: [f64; 2] = [0.5, 0.01];
/// Least overlap, s, and as a share of the shorter rate.
const COMMON: (f64, f64) = (20.0, 0.5);
const LEAST: f64 = 0.8;
/// A second peak that is further from the first than this, s, must be lower by this much.
const RIVAL: (f64, f64) = (3.0, 0.05);
/// Time of each rate that is compared, from its beginning, s: all lags of a longer time would take minutes.
pub const LONGEST: f64 = 8_192.0;

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Offset {
    /// Time to add to the times of the second clock, s.
    pub seconds: f64,
    pub coefficient: f64,
}

pub fn offset(first: &Rate, second: &Rate) -> Result<Offset, String> {
    let (first, second) = (beginning(first), beginning(second));
    let (Some(one), Some(two)) = (on_grid(first, STEPS[0]), on_grid(second, STEPS[0])) else {
        return Err("the yaw rates are too short".to_owned());
    };
    let least = COMMON.0.max(COMMON.1 * STEPS[0] * one.values.len().min(two.values.len()) as f64) / STEPS[0];
    let lags = -(two.values.len() as isize)..one.values.len() as isize;
    let all: Vec<(isize, f64)> = lags
        .filter_map(|lag| Some((lag, correlation(&one.values, &two.values, lag, least as usize)?)))
        .collect();
    let best = all.iter().copied().max_by(|a, b| a.1.total_cmp(&b.1));
    let Some((lag, coarse)) = best else { return Err("the yaw rates overlap too little in time".to_owned()) };
    let far = |other: isize| (other - lag).unsigned_abs() as f64 * STEPS[0] > RIVAL.0;
    let rival = all.iter().filter(|(other, _)| far(*other)).map(|(_, value)| *value).fold(0.0, f64::max);
    let near = one.start - two.start + STEPS[0] * lag as f64;
    let Offset { seconds, coefficient } =
        fine(first, second, near).unwrap_or(Offset { seconds: near, coefficient: coarse });
    if coefficient < LEAST {
        return Err(format!(
            "the yaw rates do not match: correlation {coefficient:.2}, at least {LEAST} is needed"
        ));
    }
    if rival > coarse - RIVAL.1 {
        return Err(format!("two offsets match equally well: correlations {coarse:.3} and {rival:.3}"));
    }
    Ok(Offset { seconds, coefficient })
}

fn beginning(rate: &Rate) -> &Rate {
    let start = rate.first().map_or(0.0, |(seconds, _)| *seconds);
    &rate[..rate.partition_point(|(seconds, _)| seconds - start < LONGEST)]
}

fn fine(first: &Rate, second: &Rate, near: f64) -> Option<Offset> {
    let (one, two) = (on_grid(first, STEPS[1])?, on_grid(second, STEPS[1])?);
    let middle = ((near + two.start - one.start) / STEPS[1]).round() as isize;
    let reach = (1.5 * STEPS[0] / STEPS[1]) as isize;
    let least = (COMMON.0 / STEPS[1] / 2.0) as usize;
    let value = |lag: isize| correlation(&one.values, &two.values, lag, least);
    let best = (middle - reach..=middle + reach)
        .filter_map(|lag| Some((lag, value(lag)?)))
        .max_by(|a, b| a.1.total_cmp(&b.1))?;
    let (lag, peak) = best;
    let fraction = match (value(lag - 1), value(lag + 1)) {
        (Some(left), Some(right)) if left + right < 2.0 * peak => {
            0.5 * (right - left) / (2.0 * peak - left - right)
        }
        _ => 0.0,
    };
    let seconds = one.start - two.start + STEPS[1] * (lag as f64 + fraction);
    Some(Offset { seconds, coefficient: peak })
}

struct Grid {
    start: f64,
    values: Vec<f64>,
}

/// Resamples a rate to equal steps, by means, or by interpolation in a step with fewer than two samples; `None` for
/// fewer than two samples, or for less than a step.
fn on_grid(rate: &Rate, step: f64) -> Option<Grid> {
    let (first, last) = (rate.first()?.0, rate.last()?.0);
    let count = ((last - first) / step) as usize;
    if rate.len() < 2 || count == 0 {
        return None;
    }
    let mut at = 0;
    let value = |k: usize| {
        let time = first + step * k as f64;
        while at + 1 < rate.len() && rate[at + 1].0 < time - 0.5 * step {
            at += 1;
        }
        let near = rate[at..].iter().skip_while(|(t, _)| *t < time - 0.5 * step);
        let near = near.take_while(|(t, _)| *t < time + 0.5 * step);
        let (sum, seen) = near.fold((0.0, 0u32), |(sum, seen), (_, value)| (sum + value, seen + 1));
        if seen > 1 {
            return sum / f64::from(seen);
        }
        let behind = rate[at..].iter().position(|(t, _)| *t >= time).map_or(rate.len() - 1, |k| at + k);
        let ((t0, v0), (t1, v1)) = (rate[behind.saturating_sub(1)], rate[behind]);
        if t1 > t0 { v0 + (v1 - v0) * ((time - t0) / (t1 - t0)).clamp(0.0, 1.0) } else { v1 }
    };
    Some(Grid { start: first, values: (0..count).map(value).collect() })
}

/// Returns the correlation coefficient with `two` shifted by `lag`; `None` for fewer than `least` values, or if one
/// of the rates never changes.
fn correlation(one: &[f64], two: &[f64], lag: isize, least: usize) -> Option<f64> {
    let (skip_one, skip_two) = (lag.max(0) as usize, (-lag).max(0) as usize);
    let (one, two) = (one.get(skip_one..)?, two.get(skip_two..)?);
    let len = one.len().min(two.len());
    if len < least.max(2) {
        return None;
    }
    let (one, two) = (&one[..len], &two[..len]);
    let mean = |values: &[f64]| values.iter().sum::<f64>() / len as f64;
    let (m1, m2) = (mean(one), mean(two));
    let (mut both, mut first, mut second) = (0.0, 0.0, 0.0);
    for (a, b) in one.iter().zip(two) {
        let (a, b) = (a - m1, b - m2);
        both += a * b;
        first += a * a;
        second += b * b;
    }
    let norm = (first * second).sqrt();
    (norm > 1e-12).then(|| both / norm)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Turns at uneven times, so that only one offset fits.
    fn turns(time: f64) -> f64 {
        (0.31 * time).sin() * (0.077 * time + 1.0).cos() + 0.3 * (0.9 * time + 0.003 * time * time).sin()
    }

    fn sampled(hz: f64, from: f64, to: f64, clock: f64, scale: f64) -> Vec<(f64, f64)> {
        let count = ((to - from) * hz) as usize;
        let time = |k: usize| from + k as f64 / hz;
        (0..count).map(|k| (time(k) + clock, scale * turns(time(k)) + 0.01)).collect()
    }

    #[test]
    fn another_clock_rate_unit_and_span_is_found_to_two_milliseconds() {
        let first = sampled(100.0, 0.0, 120.0, 1.7e9, 1.0);
        for (hz, clock) in [(50.0, 0.0), (20.0, 1_234.567), (100.0, 1.7e9 + 5.25)] {
            let second = sampled(hz, 15.0, 110.0, clock, 57.3);
            let Offset { seconds, coefficient } = offset(&first, &second).unwrap();
            assert!((seconds - (1.7e9 - clock)).abs() < 2e-3, "{hz} Hz: {}", seconds - (1.7e9 - clock));
            assert!(coefficient > 0.99, "{coefficient}");
        }
    }

    #[test]
    fn files_of_two_drives_are_not_laid_on_each_other() {
        let first = sampled(100.0, 0.0, 120.0, 0.0, 1.0);
        let other: Vec<_> = (0..10_000u32)
            .map(|k| (0.01 * f64::from(k), (0.01 * f64::from(k) * (1.0 + 0.0002 * f64::from(k))).sin()))
            .collect();
        assert!(offset(&first, &other).unwrap_err().contains("do not match"));
        let still: Vec<_> = (0..1_000).map(|k| (0.1 * f64::from(k), 0.0)).collect();
        assert!(offset(&first, &still).is_err());
        let circle = |clock: f64| {
            (0..12_000)
                .map(|k| (0.01 * f64::from(k) + clock, (0.01 * f64::from(k)).sin()))
                .collect::<Vec<_>>()
        };
        assert!(offset(&circle(0.0), &circle(7.0)).unwrap_err().contains("match equally well"));
    }
}
