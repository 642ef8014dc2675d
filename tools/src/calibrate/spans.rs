//! Spans are pieces of a drive for which the reference gives the angle turned; over a second or more its noise is small
//! beside the errors to be fitted.

use super::{CalibrateError, Drive, SHORTEST_S};
use crate::drive::DT;
use gyronet::sample::RATE_HZ;

/// With a yaw rate as reference, a span has this many samples: a second.
const RATE_SPAN: usize = RATE_HZ as usize;

/// Holds a piece of a drive.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Span {
    /// The true turn less that of the corrected yaw rate, rad.
    pub error: f64,
    /// The turns about x, y and z by the gyro, rad.
    pub turns: [f64; 3],
    /// Its length, s.
    pub seconds: f64,
}

/// Cuts a drive into spans.
///
/// # Errors
/// [`CalibrateError::NoReference`], [`CalibrateError::TooShort`].
pub fn of(Drive { recording, replay }: &Drive<'_>) -> Result<Vec<Span>, CalibrateError> {
    let path = || recording.path.clone();
    let bias = replay.gyro_bias.map(|bias| bias.rad_per_sec());
    let samples = replay.steps[replay.compared()].iter().map(|step| {
        let row = &recording.rows[step.row];
        let rates = row.sample.angular_rate.map(|rate| rate.rad_per_sec());
        let turns: [f64; 3] = std::array::from_fn(|axis| (rates[axis] - bias[axis]) * DT);
        row.reference.map(|reference| ((reference - step.settled.rad_per_sec()) * DT, turns))
    });
    let samples: Vec<Option<(f64, [f64; 3])>> = samples.collect();
    if samples.iter().all(Option::is_none) {
        return Err(CalibrateError::NoReference { path: path(), columns: "ref_gyr_z" });
    }
    let spans: Vec<Span> = samples.chunks_exact(RATE_SPAN).filter_map(whole).collect();
    let seconds = spans.iter().map(|span| span.seconds).sum::<f64>();
    if seconds < SHORTEST_S {
        return Err(CalibrateError::TooShort { path: path(), seconds });
    }
    Ok(spans)
}

/// Sums up a span; `None` if the reference is not known throughout.
fn whole(samples: &[Option<(f64, [f64; 3])>]) -> Option<Span> {
    let mut span = Span { error: 0.0, turns: [0.0; 3], seconds: samples.len() as f64 * DT };
    for sample in samples {
        let (error, turns) = (*sample)?;
        span.error += error;
        span.turns.iter_mut().zip(turns).for_each(|(sum, turn)| *sum += turn);
    }
    Some(span)
}
