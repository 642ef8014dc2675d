//! Finds the sensor's forward direction with the library's estimator, from wheels and accelerometer.

use super::finding::Finding;
use super::recording::Rows;
use super::{Mounting, remedy};
use gyronet::mounting::{Forward, ForwardEstimator, Rotation};
use gyronet::sample::{ImuSample, Standstill, Validity, WheelSample};
use gyronet::units::{AngularRate, Micros, SpecificForce, WheelSpeed};

/// Mounting yaw that costs accuracy, and sigma from which an estimate is unusable, degrees.
const WRONG: f32 = 25.0;
const VAGUE: f32 = 10.0;

/// The angle from x to forward, to the left, after levelling, and its sigma, degrees; `None` if they are not known.
pub fn find(rows: &Rows, mounting: Option<&Mounting>) -> Option<[f32; 2]> {
    let Mounting { roll_deg, pitch_deg, rest, .. } = mounting?;
    let (rest, level) = (force(*rest)?, Rotation::from_mounting(*roll_deg as f32, *pitch_deg as f32, 0.0)?);
    let forward = estimate(rows, &rest)?;
    Some([forward.yaw(&level, rest), forward.sigma].map(f32::to_degrees)).filter(|[_, sigma]| *sigma <= VAGUE)
}

/// The angle by which x must be turned, degrees; 0 if it is near forward or forward is not known.
pub fn wrong(found: Option<[f32; 2]>) -> f64 {
    found.filter(|[yaw, _]| yaw.abs() > WRONG).map_or(0.0, |[yaw, _]| yaw.into())
}

pub fn finding(rows: &Rows, mounting: Option<&Mounting>, found: Option<[f32; 2]>) -> Finding {
    let what = "forward";
    let Some((mounting, [yaw, sigma])) = mounting.zip(found) else {
        return Finding::note(what, "Wheels and accelerometer do not show the forward direction.");
    };
    let side = if yaw > 0.0 { "right" } else { "left" };
    let text = format!(
        "x points {:.0} +- {sigma:.0} deg to the {side} of forward, by wheels and accelerometer",
        yaw.abs()
    );
    if yaw.abs() <= WRONG {
        Finding::good(what, format!("{text}."))
    } else {
        let remedy = remedy::mounting(rows, mounting, yaw.into());
        Finding::note(what, format!("{text}: train and drive with the same mounting, or {remedy}."))
    }
}

fn estimate(rows: &Rows, rest: &[SpecificForce; 3]) -> Option<Forward> {
    let mut estimator = ForwardEstimator::START;
    let radius = rows.vehicle.radius_m();
    for row in 0..rows.len() {
        let angular_rate = rows.rate[row].map(|rate| AngularRate::from_rad_per_sec(rate as f32));
        let [Ok(x), Ok(y), Ok(z)] = angular_rate else { continue };
        let sample = ImuSample {
            time: Micros(0),
            specific_force: force(rows.force[row])?,
            angular_rate: [x, y, z],
            temperature: None,
            validity: Validity::Good,
        };
        let speeds = rows.wheels.each_ref().map(|wheel| {
            let speed = wheel[row]?.abs() * radius;
            Some(WheelSpeed((speed * f64::from(1 << WheelSpeed::FRACTION_BITS)) as i32))
        });
        let wheels = WheelSample { speeds, ..WheelSample::without_speeds(Standstill::Moving) };
        estimator.add(Some(&sample), &wheels, rest);
    }
    estimator.forward()
}

fn force(force: [f64; 3]) -> Option<[SpecificForce; 3]> {
    let [x, y, z] = force.map(|axis| SpecificForce::from_metre_per_sec2(axis as f32).ok());
    Some([x?, y?, z?])
}
