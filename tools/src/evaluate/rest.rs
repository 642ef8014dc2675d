//! A simulated standstill before a drive that begins in motion and has a course as reference.
//!
//! Static initialisation fails on such a drive. To compare the corrections after a good start, 3 s at rest are
//! inserted before the drive. In them each axis reads its mean over the drive; from the yaw gyro's mean the turn of the
//! course is subtracted. This is the best constant bias that an initialisation can find.

use crate::drive::error::DataError;
use crate::drive::recording::Row;
use crate::drive::stream::Drive;
use crate::evaluate::heading_error::BiasByCourse;
use gyronet::bias::STATIC_SAMPLES;
use gyronet::sample::{ImuSample, PERIOD_US};
use gyronet::units::{AngularRate, Micros, SpecificForce};

/// Amplitude by which each axis varies, because equal readings count as stuck.
const FLICKER: f64 = 1e-3;

/// Reads the drive for its means, and returns it with the simulated standstill before it; `None` without 20 s of
/// course.
pub fn before<'a>(drive: &Drive<'a>) -> Result<Option<Drive<'a>>, DataError> {
    let (mut first, mut count, mut force, mut rate) = (None, 0.0, [0.0; 3], [0.0; 3]);
    let mut course = BiasByCourse::default();
    for row in drive.rows()? {
        let row = row?;
        first = first.or(Some(row));
        count += 1.0;
        for axis in 0..3 {
            force[axis] += row.sample.specific_force[axis].metre_per_sec2();
            rate[axis] += row.sample.angular_rate[axis].rad_per_sec();
        }
        course.add(row.sample.angular_rate[2].rad_per_sec(), row.course);
    }
    let Some((first, bias)) = first.zip(course.get()) else { return Ok(None) };
    let bias = [rate[0] / count, rate[1] / count, bias];
    let before = (0..STATIC_SAMPLES).map(|k| at_rest(&first, k, force.map(|sum| sum / count), bias));
    Ok(before.collect::<Option<_>>().map(|before| drive.after(before)))
}

/// Sample `k` of the standstill; `None` beyond the range of a sensor.
fn at_rest(first: &Row, k: u32, force: [f64; 3], bias: [f64; 3]) -> Option<Row> {
    let flicker = FLICKER * (f64::from(k % 3) - 1.0);
    let [fx, fy, fz] =
        force.map(|force| SpecificForce::from_metre_per_sec2((force + 10.0 * flicker) as f32).ok());
    let [wx, wy, wz] = bias.map(|bias| AngularRate::from_rad_per_sec((bias + flicker) as f32).ok());
    let sample = ImuSample {
        time: Micros(first.sample.time.0 + u64::from(k) * PERIOD_US),
        specific_force: [fx?, fy?, fz?],
        angular_rate: [wx?, wy?, wz?],
        ..first.sample
    };
    let wheels = first.wheels.map(|rate| rate.map(|_| 0.0));
    Some(Row { wheels, ..Row::of(first.line, sample) })
}
