//! Faults of the measurements: in the sensor, in its clock, at the wheels.

use super::drive::Reading;
use super::fault::{Fault, Kind};
use gyronet::units::{AngularRate, SpecificForce};
use gyronet_tools::parts::Part;

/// Applies a fault to the readings of the rows from `first_row` on and returns the time of its first effect.
/// `gyro_bias` is the part of the readings that is not motion; a clock drift does not scale it.
pub fn disturb(
    readings: &mut [Reading],
    first_row: usize,
    fault: &Fault,
    part: Part,
    gyro_bias: [AngularRate; 3],
) -> Option<u64> {
    let begin = *readings.get(fault.from - first_row)?;
    let mut draw = fault.draw_on();
    let mut first = None;
    for (row, reading) in (first_row..).zip(readings.iter_mut()).filter(|(row, _)| fault.holds(*row)) {
        if fault.kind == Kind::NotANumber && row > fault.from && !draw.chance(fault.share) {
            continue;
        }
        let at = reading.at;
        match fault.kind {
            Kind::ClockDrift => drift(reading, &begin, fault.size * 1e-6, part, gyro_bias),
            Kind::ClockJump => reading.stamp_us += fault.size as i64,
            Kind::Stuck => hold(reading, &begin, fault, part),
            Kind::Saturation => {
                let axes = reading.saturated.iter_mut().enumerate();
                axes.for_each(|(axis, saturated)| *saturated |= fault.axes.contains(axis));
            }
            Kind::BiasStep => shift(reading, fault, part),
            Kind::NotANumber => {
                reading.no_number =
                    (0..6).find(|axis| fault.axes.contains(*axis)).map(|axis| (axis, fault.form));
            }
            Kind::WheelSlip => slip(reading, fault),
            Kind::SwappedWheels => {
                let [fl, fr, rl, rr] = reading.wheels;
                reading.wheels = match fault.form {
                    0 => [fr, fl, rr, rl],
                    1 => [rl, rr, fl, fr],
                    2 => [fr, fl, rl, rr],
                    _ => [rr, rl, fr, fl],
                };
            }
            _ => break,
        }
        first.get_or_insert(at);
    }
    first
}

/// A part whose clock is fast by a share samples more often by that share.
///
/// The rows then show a vehicle that moves the same way in less time, and turns faster by that share. Row n of the
/// disturbed drive has thus turned as far as row n of the undisturbed drive, so the two can be compared. Increments
/// are angles and do not depend on the clock: only their stamps drift.
fn drift(reading: &mut Reading, begin: &Reading, share: f64, part: Part, gyro_bias: [AngularRate; 3]) {
    if part == Part::Dsp1760 {
        reading.stamp_us += ((reading.at - begin.at) as f64 * share) as i64;
        return;
    }
    // With two such faults, the second one starts from the already shifted times.
    let since = reading.at.saturating_sub(begin.at) as f64;
    reading.at = begin.at + (since / (1.0 + share)) as u64;
    for (rate, bias) in reading.sample.angular_rate.iter_mut().zip(gyro_bias) {
        let motion = f64::from(rate.0.saturating_sub(bias.0));
        rate.0 = rate.0.saturating_add((motion * share) as i32);
    }
}

/// The fibre-optic gyro if the part has one.
fn gyro(reading: &mut Reading, part: Part) -> &mut [AngularRate; 3] {
    if part == Part::Dsp1760 { &mut reading.fog } else { &mut reading.sample.angular_rate }
}

fn hold(reading: &mut Reading, begin: &Reading, fault: &Fault, part: Part) {
    let mut begin = *begin;
    for axis in 0..3 {
        if fault.axes.contains(axis) {
            gyro(reading, part)[axis] = gyro(&mut begin, part)[axis];
            reading.fog_stuck |= axis == 2;
        }
        if fault.axes.contains(3 + axis) {
            reading.sample.specific_force[axis] = begin.sample.specific_force[axis];
        }
    }
}

/// Shifts gyro axes by rad/s, accelerometer axes by m/s^2.
fn shift(reading: &mut Reading, fault: &Fault, part: Part) {
    for axis in 0..3 {
        if fault.axes.contains(axis) {
            let rate = &mut gyro(reading, part)[axis].0;
            *rate = rate.saturating_add((fault.size * f64::from(AngularRate::PER_RAD_PER_SEC)) as i32);
        }
        if fault.axes.contains(3 + axis) {
            let force = &mut reading.sample.specific_force[axis].0;
            *force = force.saturating_add((fault.size * f64::from(SpecificForce::PER_METRE_PER_SEC2)) as i32);
        }
    }
}

/// Spins or locks all wheels, the rear axle, the front axle, or one wheel.
fn slip(reading: &mut Reading, fault: &Fault) {
    for (wheel, speed) in reading.wheels.iter_mut().enumerate() {
        let slips = match fault.form {
            0 => true,
            1 => wheel >= 2,
            2 => wheel < 2,
            _ => wheel == 0,
        };
        if let (true, Some(speed)) = (slips, speed.as_mut()) {
            // The wheels of a standing vehicle may spin too, at 5 km/h.
            *speed = if fault.size > 0.0 { *speed * fault.size + 5.0 } else { 0.0 };
        }
    }
}
