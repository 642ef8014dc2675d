//! This module inserts a simulated standstill before a recording that begins in motion and has a course as reference.
//!
//! Static initialisation fails on such a drive. To compare the corrections after a good start, 3 s at rest are
//! inserted before the recording. In them each axis reads its mean over the drive; from the yaw gyro's mean the turn
//! of the course is subtracted. This is the best constant bias that an initialisation can find.

use crate::drive::recording::{Recording, Row};
use crate::evaluate::heading_error::bias_by_course;
use gyronet::bias::STATIC_SAMPLES;
use gyronet::sample::{ImuSample, PERIOD_US};
use gyronet::units::{AngularRate, Micros, SpecificForce};

/// Amplitude by which each axis varies, because equal readings count as stuck.
const FLICKER: f64 = 1e-3;

/// Returns the recording with the simulated standstill before it; `None` without 20 s of course.
#[must_use]
pub fn before(recording: &Recording) -> Option<Recording> {
    let rows = &recording.rows;
    let start = rows.first()?.sample.time.0;
    let [gyro_x, gyro_y, gyro_z] =
        [0, 1, 2].map(|axis| rows.iter().map(move |row| row.sample.angular_rate[axis].rad_per_sec()));
    let force = [0, 1, 2].map(|axis| {
        rows.iter().map(move |row| row.sample.specific_force[axis].metre_per_sec2()).sum::<f64>()
    });
    let course: Vec<Option<f64>> = rows.iter().map(|row| row.course).collect();
    let count = rows.len() as f64;
    let bias = bias_by_course(&gyro_z.collect::<Vec<f64>>(), &course)?;
    let bias = [gyro_x.sum::<f64>() / count, gyro_y.sum::<f64>() / count, bias];
    let samples = u64::from(STATIC_SAMPLES);
    let rest = (0..samples).map(|k| {
        let flicker = FLICKER * ((k % 3) as f64 - 1.0);
        let [fx, fy, fz] =
            force.map(|sum| SpecificForce::from_metre_per_sec2((sum / count + 10.0 * flicker) as f32));
        let [wx, wy, wz] = bias.map(|bias| AngularRate::from_rad_per_sec((bias + flicker) as f32));
        let sample = ImuSample {
            time: Micros(start + k * PERIOD_US),
            specific_force: [fx.ok()?, fy.ok()?, fz.ok()?],
            angular_rate: [wx.ok()?, wy.ok()?, wz.ok()?],
            ..rows.first()?.sample
        };
        Some(Row { sample, reference: None, course: None, ..*rows.first()? })
    });
    let drive = rows.iter().map(|row| {
        let time = Micros(row.sample.time.0 + samples * PERIOD_US);
        Some(Row { sample: ImuSample { time, ..row.sample }, ..*row })
    });
    Some(Recording { rows: rest.chain(drive).collect::<Option<_>>()?, ..recording.clone() })
}
