//! Sources of the yaw rate held against each other, second by second.
//!
//! | sources | they agree while |
//! |---|---|
//! | fibre-optic gyro, inertial gyro | their mean rates differ by at most 1 deg/s and 5 % of the larger one |
//! | wheels, gyro | the wheels of an axle differ by 0.4 to 4 m (any track) times the rate, +- 0.1 m/s and 1.5 % of the speed |
//! | accelerometer, gyro | the lateral force is speed times rate, +- 2 m/s^2 and 30 % |
//!
//! In a second with contradiction the source that is alone is doubted: the gyro that the other two (gyro, wheels,
//! accelerometer) contradict, or the wheels that both others contradict. Where two contradict each other and no third
//! one judges, both are doubted. A doubt begins with the second such second in a row (a tyre that slips, a lag in a
//! swerve), and ends with the second one in which its source agrees with another in a turn, or straight on if the
//! doubt began while a gyro showed no turn: then a bias was wrong and not a gain. A fibre-optic gyro that nothing has confirmed yet
//! contradicts no other, and is doubted at once.

use crate::sample::{RATE_HZ, WheelSample};
use crate::units::WheelSpeed;

/// What the sources showed in the newest second in which one was alone: means, each `None` for a source that was silent.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize, serde::Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Contradiction {
    /// Such seconds since the start.
    pub seconds: u32,
    /// Yaw rate of the inertial and of the fibre-optic gyro less their bias, 0.01 deg/s.
    pub gyros: [Option<i16>; 2],
    /// Lateral specific force to the left, 0.01 m/s^2.
    pub lateral: Option<i16>,
    /// Speed of an axle, and how much faster its right wheel is than its left one, 0.01 m/s.
    pub wheels: Option<[i16; 2]>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) struct Doubts {
    pub inertial: bool,
    pub fog: bool,
    pub wheels: bool,
}

impl Doubts {
    pub fn bits(self) -> u8 {
        u8::from(self.inertial) | u8::from(self.fog) << 1 | u8::from(self.wheels) << 2
    }
}

/// The readings of the sources in one step of 10 ms.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Shown {
    /// Yaw rates of the gyros less their bias, rad/s.
    pub inertial: Option<f32>,
    pub fog: Option<f32>,
    /// A standstill or a turn has shown unit and sign of the fibre-optic gyro's output.
    pub confirms_fog: bool,
    /// Lateral specific force, m/s^2, to the left.
    pub lateral: f32,
    /// Speed, and how much faster the right wheel of the rear axle is than the left one, m/s.
    pub wheels: Option<[f32; 2]>,
}

/// Rate of a turn in which gyros that agree have the same unit and sign, rad/s.
const CONFIRMING: f32 = 0.1;
/// Sum of squared rates from which on gains are compared, (rad/s)^2 x s, and the seconds of turning that it remembers.
const COMPARED: f32 = 0.1;
const TURNS: f32 = 100.0;
/// Smallest rate of a turn in which sources show that they agree, rad/s.
const TURN: f32 = 0.035;
/// Wheels and accelerometer are asked above this speed, m/s: below it wheels turn on the spot and slip.
const FAST: f32 = 3.0;
/// A doubt begins and ends with this many seconds in a row.
const SECONDS: u8 = 2;

#[derive(Debug, Clone, Copy)]
pub(super) struct SecondSource {
    steps: u32,
    /// Sums of inertial rate, fibre-optic rate, lateral force, speed, difference of the wheels, and their numbers.
    sums: [(f32, u32); 5],
    /// Seconds in a row in which each source (inertial, fibre-optic, wheels) was alone, and in which it agreed.
    alone: [u8; 3],
    agreed: [u8; 3],
    doubts: [bool; 3],
    /// The gyros' doubts have begun, or gone on, while one of them showed no turn.
    is_bias: bool,
    judged: bool,
    pub confirms_fog: bool,
    /// Sums over turns of the product of both gyros' rates, and of the inertial one's square.
    products: [f32; 2],
    pub contradiction: Contradiction,
}

impl SecondSource {
    pub const START: Self = Self {
        steps: 0,
        sums: [(0.0, 0); 5],
        alone: [0; 3],
        agreed: [0; 3],
        doubts: [false; 3],
        is_bias: false,
        judged: false,
        confirms_fog: false,
        products: [0.0; 2],
        contradiction: Contradiction { seconds: 0, gyros: [None; 2], lateral: None, wheels: None },
    };

    pub fn add(&mut self, shown: &Shown) {
        let Shown { inertial, fog, confirms_fog, lateral, wheels } = *shown;
        self.confirms_fog |= confirms_fog;
        let [speed, difference] = wheels.map_or([None; 2], |values| values.map(Some));
        for (sum, value) in self.sums.iter_mut().zip([inertial, fog, Some(lateral), speed, difference]) {
            if let Some(value) = value {
                *sum = (sum.0 + value, sum.1 + 1);
            }
        }
        self.steps += 1;
        if self.steps >= RATE_HZ {
            let [inertial, fog, lateral, speed, difference] =
                self.sums.map(|(sum, number)| (number == RATE_HZ).then(|| sum / RATE_HZ as f32));
            self.judge([inertial, fog], lateral, speed.zip(difference));
            (self.steps, self.sums) = (0, Self::START.sums);
        }
    }

    /// The doubts; `None` before two sources have shown anything at the same time.
    pub fn doubts(&self) -> Option<Doubts> {
        let [inertial, fog, wheels] = self.doubts;
        self.judged.then_some(Doubts { inertial, fog, wheels })
    }

    /// Returns how much the gains of both gyros differ, once they have been compared in turns.
    pub fn scale(&self) -> Option<f32> {
        let [product, square] = self.products;
        (square > COMPARED).then(|| (product / square - 1.0).abs())
    }

    fn judge(&mut self, gyros: [Option<f32>; 2], lateral: Option<f32>, wheels: Option<(f32, f32)>) {
        let wheels = wheels.filter(|(speed, _)| *speed > FAST);
        let by_wheels = gyros.map(|rate| Some(wheels_agree(rate?, wheels?)));
        let by_force = gyros.map(|rate| Some(force_agrees(rate?, lateral?, wheels?.0)));
        let [inertial, fog] = gyros;
        let gyros_agree = inertial
            .zip(fog)
            .map(|(one, other)| (one - other).abs() <= 0.0175 + 0.05 * one.abs().max(other.abs()));
        if gyros_agree.is_none() && by_wheels == [None; 2] {
            return;
        }
        self.judged = true;
        if let (Some(inertial), Some(fog)) = (inertial, fog)
            && inertial.abs() > CONFIRMING
        {
            let [product, square] = &mut self.products;
            *product += inertial * fog - *product / TURNS;
            *square += inertial * inertial - *square / TURNS;
        }
        let both_turn = gyros.iter().all(|rate| rate.is_some_and(|rate| rate.abs() > CONFIRMING));
        self.confirms_fog |= gyros_agree == Some(true) && both_turn;
        let turns = gyros.map(|rate| rate.is_some_and(|rate| rate.abs() > TURN));
        // How many of the others speak for each gyro, and against it.
        let voices = |by_wheels: Option<bool>, by_force: Option<bool>| {
            let voices = [gyros_agree, by_wheels, by_force];
            [true, false].map(|what| voices.iter().filter(|voice| **voice == Some(what)).count())
        };
        let [for_inertial, against_inertial] = voices(by_wheels[0], by_force[0]);
        let [for_fog, against_fog] = voices(by_wheels[1], by_force[1]);
        let alone = match gyros_agree {
            Some(false) if !self.confirms_fog => {
                self.doubts[1] = true;
                [false, true, false]
            }
            Some(false) => [against_inertial >= against_fog, against_fog >= against_inertial, false],
            _ => {
                let wheels = by_wheels.contains(&Some(false));
                let gyro = against_inertial > 1 && for_inertial == 0;
                [wheels && against_inertial > for_inertial, against_fog > for_fog, wheels && !gyro]
            }
        };
        if alone.contains(&true) {
            // The largest code is that of a silent source on the bus.
            let code = |value: f32| (libm::roundf(100.0 * value) as i16).min(i16::MAX - 1);
            self.contradiction = Contradiction {
                seconds: self.contradiction.seconds.saturating_add(1),
                gyros: gyros.map(|rate| rate.map(|rate| code(rate.to_degrees()))),
                lateral: lateral.map(code),
                wheels: wheels.map(|(speed, difference)| [speed, difference].map(code)),
            };
        }
        if gyros_agree == Some(false) {
            self.is_bias = turns.contains(&false);
        }
        let shows = |turns: bool| turns || self.is_bias && gyros_agree == Some(true);
        let agreed = [
            shows(turns[0]) && for_inertial > against_inertial,
            shows(turns[1]) && for_fog > against_fog,
            turns.contains(&true) && by_wheels.contains(&Some(true)) && !by_wheels.contains(&Some(false)),
        ];
        for source in 0..3 {
            self.alone[source] = if alone[source] { self.alone[source].saturating_add(1) } else { 0 };
            // Seconds that show nothing do not end a row of agreement.
            self.agreed[source] =
                if alone[source] { 0 } else { self.agreed[source] + u8::from(agreed[source]) };
            self.doubts[source] |= self.alone[source] >= SECONDS;
            if self.agreed[source] >= SECONDS {
                (self.doubts[source], self.agreed[source]) = (false, 0);
            }
        }
    }
}

/// Returns true if an axle's wheels may differ so in a turn at this rate.
fn wheels_agree(rate: f32, (speed, difference): (f32, f32)) -> bool {
    let slack = 0.1 + 0.015 * speed;
    let [narrow, wide] = [0.4 * rate, 4.0 * rate];
    difference >= narrow.min(wide) - slack && difference <= narrow.max(wide) + slack
}

/// Returns true if a turn at this rate and speed may have this lateral force, on a street with a bank.
fn force_agrees(rate: f32, lateral: f32, speed: f32) -> bool {
    let expected = rate * speed;
    (lateral - expected).abs() <= 2.0 + 0.3 * expected.abs()
}

/// The mean speed of an axle, m/s, and how much faster its right wheel is.
pub(super) fn axle(wheels: &WheelSample) -> Option<[f32; 2]> {
    let [left, right] = wheels.axle()?.map(|speed| speed.0 as f32 / (1 << WheelSpeed::FRACTION_BITS) as f32);
    Some([(left + right) / 2.0, right - left])
}
