//! Gyros on the wheels of a recorded drive, taken for the wheel speeds of a vehicle bus.

use crate::recording::{Recording, Row, WHEEL_STANDS};
use gyronet::sample::{WHEELS, WheelSample};
use gyronet::units::WheelSpeed;
use gyronet::wheels::{StandstillRule, Wheels};

/// Radius of a wheel of the recorded car, m.
pub const RADIUS: f64 = 0.289;
/// Front right, rear right, front left, rear left, as places of [`WheelSample::speeds`].
pub const PLACES: [usize; WHEELS] = [1, 3, 0, 2];
const FRONT: [usize; 2] = [0, 2];
const REAR: [usize; 2] = [1, 3];
/// A gyro on a standing wheel shows up to 0.04 rad/s; what is too slow to tell is not moving.
const RULE: StandstillRule =
    StandstillRule { timeout_us: 100_000, still_speed: speed(WHEEL_STANDS), still_for_us: 1_000_000 };

/// The wheels of one recording.
#[derive(Debug)]
pub struct WheelRates(Wheels);

impl WheelRates {
    /// `None` of a recording without wheels.
    #[must_use]
    pub fn new(recording: &Recording) -> Option<Self> {
        let mut expected = [false; WHEELS];
        for row in &recording.rows {
            for (wheel, place) in row.wheels.iter().zip(PLACES) {
                expected[place] |= wheel.is_some();
            }
        }
        expected.contains(&true).then(|| Self(Wheels::new(RULE, expected)))
    }

    /// What the bus says by the time of a row.
    pub fn at(&mut self, row: &Row) -> WheelSample {
        let Self(wheels) = self;
        let now = row.sample.time;
        wheels.expire(now);
        for (wheel, place) in row.wheels.iter().zip(PLACES) {
            if let Some(rate) = wheel {
                wheels.set(place, Some(speed(*rate)), now);
            }
        }
        wheels.judge(now);
        wheels.sample(now)
    }
}

/// Speed of the vehicle at each row of a recording, for dead reckoning.
#[derive(Debug, Clone, PartialEq)]
pub struct Speeds {
    /// Wheels that it is the mean of.
    pub wheels: usize,
    /// At each row, m/s, forward positive; a wheel's last known rate holds on.
    pub metre_per_sec: Vec<f64>,
}

impl Speeds {
    /// Of the rear wheels, which do not steer; of the front ones where no other is recorded. `None`
    /// of a recording without wheels.
    #[must_use]
    pub fn new(recording: &Recording) -> Option<Self> {
        let recorded = |wheel: &usize| recording.rows.iter().any(|row| row.wheels[*wheel].is_some());
        let axle = |axle: [usize; 2]| axle.into_iter().filter(recorded).collect::<Vec<usize>>();
        let wheels = [REAR, FRONT].map(axle).into_iter().find(|wheels| !wheels.is_empty())?;
        let mut last = [0.0; WHEELS];
        let speed = |row: &Row| {
            for wheel in &wheels {
                last[*wheel] = row.wheels[*wheel].unwrap_or(last[*wheel]);
            }
            RADIUS * wheels.iter().map(|wheel| last[*wheel]).sum::<f64>() / wheels.len() as f64
        };
        let metre_per_sec = recording.rows.iter().map(speed).collect();
        Some(Self { wheels: wheels.len(), metre_per_sec })
    }
}

/// Speed over ground of a wheel that turns at `rate` rad/s.
const fn speed(rate: f64) -> WheelSpeed {
    // A cast saturates.
    WheelSpeed((rate * RADIUS * (1u32 << WheelSpeed::FRACTION_BITS) as f64) as i32)
}

#[cfg(test)]
mod tests {
    use super::*;
    use gyronet::sample::Standstill;

    fn standstills(wheel2: impl Fn(usize) -> String) -> Vec<Standstill> {
        let mut text = String::from("t_s,acc_x,acc_y,acc_z,gyr_x,gyr_y,gyr_z,wheel1_rate,wheel2_rate\n");
        for k in 0..500 {
            text += &format!("{:.2},0,0,9.8,0,0,0,0.04,{}\n", 0.01 * k as f64, wheel2(k));
        }
        let recording = Recording::parse("a.csv", text.as_bytes()).unwrap();
        let mut wheels = WheelRates::new(&recording).unwrap();
        recording.rows.iter().map(|row| wheels.at(row).standstill).collect()
    }

    #[test]
    fn still_after_a_second_until_one_wheel_turns() {
        let seen = standstills(|k| if k < 400 { "-0.2" } else { "0.4" }.into());
        assert!(seen[..100].iter().all(|s| *s == Standstill::Unknown));
        assert!(seen[100..400].iter().all(|s| *s == Standstill::Still));
        assert!(seen[400..].iter().all(|s| *s == Standstill::Moving));
    }

    #[test]
    fn the_rear_wheels_say_how_fast() {
        let text = "t_s,acc_x,acc_y,acc_z,gyr_x,gyr_y,gyr_z,wheel1_rate,wheel2_rate,wheel4_rate\n".to_owned();
        let row = |k: usize| {
            let (one, two, four) =
                if k < 400 { ("0", "0", "0") } else { ("9", "2", if k == 400 { "4" } else { "" }) };
            format!("{:.2},0,0,9.8,0,0,0,{one},{two},{four}\n", 0.01 * k as f64)
        };
        let text = (0..402).map(row).fold(text, |text, row| text + &row);
        let speeds = Speeds::new(&Recording::parse("a.csv", text.as_bytes()).unwrap()).unwrap();
        assert_eq!((speeds.wheels, speeds.metre_per_sec[399]), (2, 0.0));
        assert_eq!(speeds.metre_per_sec[400..], [3.0 * RADIUS; 2]);
    }

    #[test]
    fn a_silent_wheel_is_not_still() {
        let seen = standstills(|k| if k < 400 { "0" } else { "" }.into());
        assert_eq!((seen[409], seen[410]), (Standstill::Still, Standstill::Unknown));
    }
}
