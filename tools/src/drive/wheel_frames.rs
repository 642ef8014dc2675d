//! Creates wheel speed CAN frames, of a recorded drive or of given speeds.

use crate::drive::recording::{Row, WHEEL_STANDS};
use embedded_can::{Frame, StandardId};
use gyronet::can::DataFrame;
use gyronet::can::wheel::{WheelReceiver, WheelSettings};
use gyronet::sample::WHEELS;

/// Index in [`gyronet::sample::WheelSample::speeds`] of each recorded wheel (front right, rear right, front left,
/// rear left).
const PLACES: [usize; WHEELS] = [1, 3, 0, 2];
const FRONT: [usize; 2] = [0, 2];
const REAR: [usize; 2] = [1, 3];
/// Rows from one frame to the next: 20 ms.
pub const FRAME_ROWS: usize = 2;
/// Rows without a new rate after which a wheel is silent: 100 ms.
const SILENT_ROWS: usize = 10;

/// Returns the receiver of these frames, with the same settings as in the image.
///
/// # Panics
/// Never: the settings are constants of the library.
pub fn receiver() -> WheelReceiver {
    WheelReceiver::new(WheelSettings::TOYOTA).expect("settings that come with the library")
}

/// Encodes four wheel speeds in km/h (front left, front right, rear left, rear right) as a frame in the layout of
/// [`WheelSettings::TOYOTA`]; `None` if one is unknown.
pub fn frame([front_left, front_right, rear_left, rear_right]: [Option<f64>; WHEELS]) -> Option<DataFrame> {
    let mut data = [0; 8];
    for (bytes, speed) in data.chunks_exact_mut(2).zip([front_right, front_left, rear_right, rear_left]) {
        // Units of 0.01 km/h, offset -67.67 km/h.
        bytes.copy_from_slice(&((libm::round((speed? + 67.67) * 100.0)) as u16).to_be_bytes());
    }
    DataFrame::new(StandardId::new(0xAA)?, &data)
}

#[derive(Debug, Clone)]
pub struct WheelFrames {
    /// The recorded wheel that each wheel's speed is taken from: the wheel itself, or another if it was not recorded.
    source: [usize; WHEELS],
    /// The newest speed of each recorded wheel in km/h, and its row number.
    newest: [Option<(f64, usize)>; WHEELS],
    row: usize,
    /// Rolling radius, m.
    radius: f64,
}

impl WheelFrames {
    /// Creates the encoder, before the first row; `None` if the drive has no wheels.
    pub fn of(wheels: [bool; WHEELS], radius: f64) -> Option<Self> {
        let recorded = |wheel: &usize| wheels[*wheel];
        let any = (0..WHEELS).find(recorded)?;
        let mut source = [any; WHEELS];
        for (wheel, place) in PLACES.iter().enumerate() {
            let axle = if FRONT.contains(&wheel) { FRONT } else { REAR };
            let own = [wheel, axle[0], axle[1]].into_iter().find(recorded);
            source[*place] = own.unwrap_or(any);
        }
        Some(Self { source, newest: [None; WHEELS], row: 0, radius })
    }

    /// Advances by a row and returns the known speed of each wheel in km/h. A wheel that turns too slowly to be told
    /// from a standing one reads zero, as with passive sensors.
    pub fn speeds(&mut self, row: &Row) -> [Option<f64>; WHEELS] {
        for (newest, rate) in self.newest.iter_mut().zip(row.wheels) {
            let shown = |rate: f64| if rate.abs() > WHEEL_STANDS { rate.abs() } else { 0.0 };
            *newest = rate.map(|rate| (shown(rate) * self.radius * 3.6, self.row)).or(*newest);
        }
        let now = self.row;
        self.row += 1;
        self.source
            .map(|wheel| self.newest[wheel].filter(|(_, at)| now - at < SILENT_ROWS).map(|(speed, _)| speed))
    }

    pub fn next(&mut self, row: &Row) -> Option<DataFrame> {
        let is_due = self.row.is_multiple_of(FRAME_ROWS);
        let speeds = self.speeds(row);
        frame(speeds).filter(|_| is_due)
    }
}

/// The speed of the vehicle at each row of a drive, for dead reckoning: the mean of the rear wheels, which do not
/// steer, or else of the front ones.
#[derive(Debug, Clone, PartialEq)]
pub struct Speeds {
    wheels: Vec<usize>,
    /// A wheel keeps its last known rate.
    last: [f64; WHEELS],
    radius: f64,
}

impl Speeds {
    pub fn of(wheels: [bool; WHEELS], radius: f64) -> Option<Self> {
        let axle = |axle: [usize; 2]| axle.into_iter().filter(|wheel| wheels[*wheel]).collect::<Vec<usize>>();
        let wheels = [REAR, FRONT].map(axle).into_iter().find(|wheels| !wheels.is_empty())?;
        Some(Self { wheels, last: [0.0; WHEELS], radius })
    }

    pub fn wheels(&self) -> usize {
        self.wheels.len()
    }

    /// The speed at the next row, m/s, forward positive.
    pub fn next(&mut self, row: &Row) -> f64 {
        for wheel in &self.wheels {
            self.last[*wheel] = row.wheels[*wheel].unwrap_or(self.last[*wheel]);
        }
        let sum = self.wheels.iter().map(|wheel| self.last[*wheel]).sum::<f64>();
        self.radius * sum / self.wheels.len() as f64
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::drive::recording::Reader;
    use crate::drive::vehicle::RADIUS;
    use gyronet::sample::Standstill;

    fn rows(text: &str) -> impl Iterator<Item = Row> {
        Reader::new("a.csv", text.as_bytes()).unwrap().map(Result::unwrap)
    }

    fn standstills(wheel2: impl Fn(usize) -> String) -> Vec<Standstill> {
        let mut text = String::from("t_s,acc_x,acc_y,acc_z,gyr_x,gyr_y,gyr_z,wheel1_rate,wheel2_rate\n");
        for k in 0..500 {
            text += &format!("{:.2},0,0,9.8,0,0,0,0.04,{}\n", 0.01 * k as f64, wheel2(k));
        }
        let mut frames = WheelFrames::of([true, true, false, false], RADIUS).unwrap();
        let mut receiver = receiver();
        let known = rows(&text).map(|row| {
            let now = row.sample.time;
            if let Some(frame) = frames.next(&row) {
                receiver.decode(&frame, now).unwrap().unwrap();
            }
            receiver.poll(now).map_or(Standstill::Unknown, |wheels| wheels.standstill)
        });
        known.collect()
    }

    #[test]
    fn still_after_half_a_second_until_one_wheel_turns() {
        let seen = standstills(|k| if k < 400 { "-0.2" } else { "0.4" }.into());
        assert!(seen[..50].iter().all(|s| *s == Standstill::Unknown));
        assert!(seen[50..400].iter().all(|s| *s == Standstill::Still));
        assert!(seen[400..].iter().all(|s| *s == Standstill::Moving));
    }

    #[test]
    fn the_rear_wheels_give_the_speed() {
        let text = "t_s,acc_x,acc_y,acc_z,gyr_x,gyr_y,gyr_z,wheel1_rate,wheel2_rate,wheel4_rate\n".to_owned();
        let row = |k: usize| {
            let (one, two, four) =
                if k < 400 { ("0", "0", "0") } else { ("9", "2", if k == 400 { "4" } else { "" }) };
            format!("{:.2},0,0,9.8,0,0,0,{one},{two},{four}\n", 0.01 * k as f64)
        };
        let text = (0..402).map(row).fold(text, |text, row| text + &row);
        let mut speeds = Speeds::of([true, true, false, true], RADIUS).unwrap();
        let all: Vec<f64> = rows(&text).map(|row| speeds.next(&row)).collect();
        assert_eq!((speeds.wheels(), all[399]), (2, 0.0));
        assert_eq!(all[400..], [RADIUS * 6.0 / 2.0; 2]);
    }

    #[test]
    fn a_silent_wheel_is_not_still() {
        let seen = standstills(|k| if k < 400 { "0" } else { "" }.into());
        // The last frame is sent 0.1 s after the wheel's last rate, and is valid for 0.1 s.
        assert_eq!((seen[399], seen[425]), (Standstill::Still, Standstill::Unknown));
    }
}
