//! Spans are pieces of a drive for which the reference gives the angle turned. Over a second or more the noise of the
//! reference is small compared with the errors that are fitted.
//!
//! A reference yaw rate gives one span per second. A GNSS course is noisy from one second to the next, so its spans
//! reach from the median of ten seconds to the median of the next ten.

use super::{CalibrateError, SHORTEST_S, STRAIGHT_RAD};
use crate::board::Step;
use crate::drive::DT;
use crate::evaluate::heading_error::{BLOCK_S, Blocks, OffCourse};
use gyronet::sample::RATE_HZ;
use gyronet::units::AngularRate;

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
    pub seconds: f64,
}

/// The spans of a drive in progress: by its reference yaw rate, and by its course.
#[derive(Debug, Default)]
pub struct Spans {
    by_rate: ByRate,
    by_course: ByCourse,
}

impl Spans {
    /// Adds a step of the board that has run the drive with this static bias.
    pub fn add(&mut self, step: &Step, bias: &[f64; 3]) {
        if !step.is_compared {
            return;
        }
        let row = &step.input;
        let rates = row.sample.angular_rate.map(AngularRate::rad_per_sec);
        let turns = std::array::from_fn(|axis| (rates[axis] - bias[axis]) * DT);
        let corrected = step.complete.rad_per_sec();
        self.by_rate.add(corrected, turns, row.reference);
        self.by_course.add(corrected, turns, row.course);
    }

    /// The sum of the turns of all seconds, rad, which noise does not add to.
    pub fn turned(&self) -> f64 {
        self.by_rate.turned
    }

    /// The spans by the reference yaw rate, or else by the course.
    pub fn finish(mut self, path: &str) -> Result<Vec<Span>, CalibrateError> {
        let path = || path.to_owned();
        let spans = if self.by_rate.is_known {
            self.by_rate.spans
        } else if self.by_course.is_known {
            self.by_course.end();
            self.by_course.spans
        } else {
            return Err(CalibrateError::NoReference { path: path(), columns: "ref_gyr_z and no ref_yaw" });
        };
        let seconds = spans.iter().map(|span| span.seconds).sum::<f64>();
        if seconds < SHORTEST_S {
            return Err(CalibrateError::TooShort { path: path(), seconds });
        }
        Ok(spans)
    }
}

/// Spans of whole seconds in which every sample has a reference.
#[derive(Debug, Default)]
struct ByRate {
    is_known: bool,
    samples: usize,
    /// The error and the turns of the second in progress.
    error: Option<f64>,
    turns: [f64; 3],
    turned: f64,
    spans: Vec<Span>,
}

impl ByRate {
    fn add(&mut self, corrected: f64, turns: [f64; 3], reference: Option<f64>) {
        self.is_known |= reference.is_some();
        if self.samples == 0 {
            (self.error, self.turns) = (Some(0.0), [0.0; 3]);
        }
        self.error = self.error.zip(reference).map(|(error, truth)| error + (truth - corrected) * DT);
        self.turns.iter_mut().zip(turns).for_each(|(sum, turn)| *sum += turn);
        self.samples += 1;
        if self.samples == RATE_SPAN {
            let (turns, seconds) = (self.turns, RATE_SPAN as f64 * DT);
            self.turned += Some(turns[2].abs()).filter(|turn| *turn >= STRAIGHT_RAD).unwrap_or_default();
            self.spans.extend(self.error.map(|error| Span { error, turns, seconds }));
            self.samples = 0;
        }
    }
}

/// Spans between neighbouring blocks with a known course, between the middles of the blocks.
#[derive(Debug, Default)]
struct ByCourse {
    is_known: bool,
    off: OffCourse,
    blocks: Blocks,
    /// The turn since the start, and its sum over the block in progress, to match the block's median error.
    turned: [f64; 3],
    sum: [f64; 3],
    samples: usize,
    /// The median error and the mean turn of the block before.
    before: Option<(Option<f64>, [f64; 3])>,
    spans: Vec<Span>,
}

impl ByCourse {
    fn add(&mut self, corrected: f64, turns: [f64; 3], course: Option<f64>) {
        self.is_known |= course.is_some();
        for ((sum, turned), turn) in self.sum.iter_mut().zip(&mut self.turned).zip(turns) {
            *turned += turn;
            *sum += *turned;
        }
        self.samples += 1;
        let off = self.off.add(corrected, course);
        if let Some(median) = self.blocks.add(off) {
            self.block(median);
        }
    }

    fn end(&mut self) {
        if let Some(median) = self.blocks.end() {
            self.block(median);
        }
    }

    fn block(&mut self, median: Option<f64>) {
        let samples = std::mem::take(&mut self.samples) as f64;
        let mean = std::mem::take(&mut self.sum).map(|sum| sum / samples);
        if let Some((before, from)) = self.before.replace((median, mean))
            && let Some((before, after)) = before.zip(median)
        {
            let turns = std::array::from_fn(|axis| mean[axis] - from[axis]);
            self.spans.push(Span { error: before - after, turns, seconds: COURSE_SPAN as f64 * DT });
        }
    }
}
