//! Spans are pieces of a drive for which the reference gives the angle turned. Over a second or more the noise of the
//! reference is small compared with the errors that are fitted.
//!
//! A reference yaw rate gives one span per second. A GNSS course is noisy from one second to the next, so its spans
//! reach from the median of ten seconds to the median of the next ten.

use super::{CalibrateError, Drive, SHORTEST_S};
use crate::drive::DT;
use crate::evaluate::heading_error::{BLOCK_S, medians, off_course};
use gyronet::sample::RATE_HZ;

/// Samples of a span with a yaw rate as reference: one second.
const RATE_SPAN: usize = RATE_HZ as usize;
/// Samples of a span with a course as reference.
const COURSE_SPAN: usize = BLOCK_S * RATE_HZ as usize;

/// The turns and the error of one piece of a drive.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Span {
    /// The true turn less that of the corrected yaw rate, rad.
    pub error: f64,
    /// The turns about x, y and z by the gyro, rad.
    pub turns: [f64; 3],
    /// Length of the span, s.
    pub seconds: f64,
}

/// One sample of a drive.
struct Sample {
    /// Corrected yaw rate, rad/s.
    corrected: f64,
    /// Turns about x, y and z by the gyro, rad.
    turns: [f64; 3],
    /// The true yaw rate, rad/s.
    reference: Option<f64>,
    /// The true course, rad.
    course: Option<f64>,
}

/// Cuts a drive into spans by its reference yaw rate, or else by its course.
///
/// # Errors
/// [`CalibrateError::NoReference`], [`CalibrateError::TooShort`].
pub fn of(Drive { recording, replay }: &Drive<'_>) -> Result<Vec<Span>, CalibrateError> {
    let path = || recording.path.clone();
    let bias = replay.gyro_bias.map(|bias| bias.rad_per_sec());
    let samples = replay.steps[replay.compared()].iter().map(|step| {
        let row = &recording.rows[step.row];
        let rates = row.sample.angular_rate.map(|rate| rate.rad_per_sec());
        Sample {
            corrected: step.settled.rad_per_sec(),
            turns: std::array::from_fn(|axis| (rates[axis] - bias[axis]) * DT),
            reference: row.reference,
            course: row.course,
        }
    });
    let samples: Vec<Sample> = samples.collect();
    let spans = if samples.iter().any(|sample| sample.reference.is_some()) {
        samples.chunks_exact(RATE_SPAN).filter_map(by_rate).collect()
    } else if samples.iter().any(|sample| sample.course.is_some()) {
        by_course(&samples)
    } else {
        return Err(CalibrateError::NoReference { path: path(), columns: "ref_gyr_z and no ref_yaw" });
    };
    let seconds = spans.iter().map(|span| span.seconds).sum::<f64>();
    if seconds < SHORTEST_S {
        return Err(CalibrateError::TooShort { path: path(), seconds });
    }
    Ok(spans)
}

/// Sums up the samples of a span; `None` if one of them has no reference.
fn by_rate(samples: &[Sample]) -> Option<Span> {
    let mut span = Span { error: 0.0, turns: [0.0; 3], seconds: samples.len() as f64 * DT };
    for Sample { corrected, turns, reference, .. } in samples {
        span.error += ((*reference)? - corrected) * DT;
        span.turns.iter_mut().zip(turns).for_each(|(sum, turn)| *sum += turn);
    }
    Some(span)
}

/// Returns the spans between neighbouring blocks with a known course, between the middles of the blocks.
fn by_course(samples: &[Sample]) -> Vec<Span> {
    let corrected: Vec<f64> = samples.iter().map(|sample| sample.corrected).collect();
    let course: Vec<Option<f64>> = samples.iter().map(|sample| sample.course).collect();
    let off: Vec<Option<f64>> = medians(&off_course(&corrected, &course)).collect();
    // The mean over each block of the turn since the start, to match the blocks' median errors.
    let mut sum = [0.0; 3];
    let turned: Vec<[f64; 3]> = samples
        .chunks(COURSE_SPAN)
        .map(|block| {
            let mut mean = [0.0; 3];
            for sample in block {
                for axis in 0..3 {
                    sum[axis] += sample.turns[axis];
                    mean[axis] += sum[axis] / block.len() as f64;
                }
            }
            mean
        })
        .collect();
    let between = |(off, turned): (&[Option<f64>], &[[f64; 3]])| {
        let ([before, after], [from, to]) = (off, turned) else { return None };
        let turns = std::array::from_fn(|axis| to[axis] - from[axis]);
        Some(Span { error: (*before)? - (*after)?, turns, seconds: COURSE_SPAN as f64 * DT })
    };
    off.windows(2).zip(turned.windows(2)).filter_map(between).collect()
}
