//! A drive of another rate than 100 Hz, on the grid that the board makes of it.

use super::Row;
use crate::drive::error::{DataError, DataFault};
use gyronet::align::{AlignError, Aligner};
use gyronet::sample::{ImuSample, Validity};
use gyronet::units::AngularRate;

pub type Result = std::result::Result<Row, DataError>;

/// Brings rows to 100 Hz. A reference rate is averaged as the sensor is; course and wheels are those of the newest row,
/// and a heading reference belongs to the first step after it.
pub fn resampled(path: &str, rows: impl Iterator<Item = Result>) -> impl Iterator<Item = Result> {
    let (mut sensor, mut reference, mut heading) = (Aligner::START, Aligner::START, None);
    rows.flat_map(move |row| {
        match row.map(|row| {
            heading = row.heading.or(heading);
            steps(&row, &mut sensor, &mut reference)
        }) {
            Ok(Ok(rows)) => rows.into_iter().map(|row| Ok(Row { heading: heading.take(), ..row })).collect(),
            // The grid restarts, as on the board.
            Ok(Err(AlignError::Jump { .. })) => Vec::new(),
            Ok(Err(AlignError::Rate { period_us })) => {
                vec![Err(DataError::of(path, DataFault::Rate { hz: 1e6 / period_us as f64 }))]
            }
            Ok(Err(error)) => vec![Err(DataError::of(path, DataFault::Other(Box::new(error))))],
            Err(error) => vec![Err(error)],
        }
    })
}

fn steps(
    row: &Row,
    sensor: &mut Aligner,
    reference: &mut Aligner,
) -> std::result::Result<Vec<Row>, AlignError> {
    let rate = row.reference.and_then(|rate| AngularRate::from_rad_per_sec(rate as f32).ok());
    let known = ImuSample {
        angular_rate: [rate.unwrap_or(AngularRate::ZERO); 3],
        validity: Validity::reported(rate.is_none()),
        ..row.sample
    };
    sensor.add(row.sample)?;
    reference.add(known)?;
    let mut rows = Vec::new();
    while let (Some(step), Some(known)) = (sensor.next_frame(), reference.next_frame()) {
        let [rate, ..] = known.sample.angular_rate;
        let reference = known.sample.validity.is_good().then(|| rate.rad_per_sec());
        rows.push(Row { sample: step.sample, reference, ..*row });
    }
    Ok(rows)
}
