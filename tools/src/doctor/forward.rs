//! Finds the sensor's forward direction with the library's estimator, from wheels and accelerometer.

use super::Mounting;
use super::finding::Finding;
use super::recording::Rows;
use gyronet::mounting::{Forward, ForwardEstimator, Rotation};
use gyronet::sample::{ImuSample, Standstill, Validity, WheelSample};
use gyronet::units::{AngularRate, Micros, SpecificForce, WheelSpeed};

/// Mounting yaw that costs accuracy, and sigma from which an estimate is unusable, degrees.
const WRONG: f32 = 25.0;
const VAGUE: f32 = 10.0;

/// Returns the finding; `mounting` gives the vertical.
pub fn finding(rows: &Rows, mounting: Option<&Mounting>) -> Finding {
    let what = "forward";
    let found = mounting.and_then(|mounting| {
        let rest = force(mounting.rest)?;
        let forward = estimate(rows, &rest)?;
        Some([forward.yaw(&Rotation::IDENTITY, rest), forward.sigma].map(f32::to_degrees))
    });
    let Some([yaw, sigma]) = found.filter(|[_, sigma]| *sigma <= VAGUE) else {
        return Finding::note(what, "Wheels and accelerometer do not show the forward direction.");
    };
    let text = format!("{yaw:+.0} +- {sigma:.0} deg to the left of x, by wheels and accelerometer");
    if yaw.abs() <= WRONG {
        Finding::good(what, format!("{text}."))
    } else {
        let named = rows.vehicle.mounting.yaw_deg - f64::from(yaw);
        let named = (named + 180.0).rem_euclid(360.0) - 180.0;
        Finding::note(
            what,
            format!(
                "{text}: x is not forward. Train and drive with the same mounting, or set yaw_deg = {named:.0} in the vehicle file."
            ),
        )
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
