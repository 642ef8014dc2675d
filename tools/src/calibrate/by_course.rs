//! The gain of a unit by the courses of a drive: the board itself learns it from them while it runs the drive.

use super::{SHORTEST_S, too_short};
use crate::board::Board;
use crate::drive::error::DataError;
use crate::drive::recording::Row;
use crate::drive::stream::Drive;
use gyronet::heading::{CourseConfig, CourseCounters, Heading};
use gyronet::model::WindowNetwork;
use gyronet::units::AngularRate;
use std::f64::consts::TAU;

/// Accuracy of a course of the reference (`ref_yaw`), 1 sigma, rad.
const REFERENCE: f32 = 0.05;

/// What the board has learnt by the end of a drive.
#[derive(Debug, Clone, Copy)]
pub struct Learnt {
    /// The share of the yaw rate that the map adds, and its sigma.
    pub gain: [f64; 2],
    /// The gyro's bias, and what courses have added to it about z, rad/s.
    pub gyro_bias: [f64; 3],
    pub bias: f64,
}

/// Runs a drive on the board, with its courses or else those of its reference.
pub fn learn(
    drive: &Drive<'_>,
    mut board: Board<impl WindowNetwork>,
    mut tick: impl FnMut(),
) -> Result<Learnt, DataError> {
    board.take_courses();
    let (mut seconds, mut next, mut is_reference) = (0.0, 0, false);
    for row in drive.rows()? {
        let row = row?;
        tick();
        let heading = row.course.map(reference).or(row.heading.filter(|_| !is_reference));
        is_reference |= row.course.is_some();
        let has_begun = board.coprocessor().pipeline().gyro_bias().is_some();
        if has_begun && heading.is_some() && row.sample.time.0 >= next {
            (seconds, next) = (seconds + 1.0, row.sample.time.0 + 1_000_000);
        }
        // A start that is refused in motion is no error here.
        let _ = board.row(&Row { heading, ..row });
    }
    let pipeline = board.coprocessor().pipeline();
    let CourseCounters { used, refused, .. } = pipeline.course_counters();
    if !is_reference && !drive.facts.has_course {
        let reason = "no ref_gyr_z, ref_yaw or course: a calibration needs one of these columns";
        return Err(DataError::because(&drive.path, reason));
    } else if seconds < SHORTEST_S {
        return Err(too_short(&drive.path, seconds));
    } else if refused > used {
        let reason = format!(
            "the gyro contradicts {refused} of the courses and fits {used}: `gyronet doctor` says why"
        );
        return Err(DataError::because(&drive.path, reason));
    }
    let (share, sigma) = pipeline.gain();
    let gyro_bias = pipeline.gyro_bias().unwrap_or_default().map(AngularRate::rad_per_sec);
    let sigma = sigma.map_or(f64::INFINITY, f64::from);
    Ok(Learnt { gain: [-f64::from(share), sigma], gyro_bias, bias: -pipeline.bias().rad_per_sec() })
}

fn reference(course: f64) -> Heading {
    let (course, speed) = (Some((-course).rem_euclid(TAU) as f32), Some(CourseConfig::DEFAULT.slowest));
    Heading { course, course_sigma: Some(REFERENCE), speed, speed_sigma: None }
}
