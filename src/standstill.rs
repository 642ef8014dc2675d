//! The judge of standstill: whether the vehicle stands, by wheels and inertial sensor, and how probably.
//!
//! - **Wheels** that stand prove it, unless the inertial sensor contradicts: the vehicle shakes for seconds as only a
//!   driven one does, or the wheels came to rest faster than a vehicle can brake (locked, or frames frozen at zero).
//!   They are believed again once they have turned, or the sensor is quiet; wheels that stand while the vehicle speeds
//!   up, only once they have turned.
//! - **A quiet inertial sensor** (`inertial`) shows it where no wheel tells. A smooth road can be as quiet, so it
//!   counts as a stop only since the start, or after the vehicle has slowed down: by a force against the one by which
//!   it pulled away, that has ended at the level of that standstill. Without that the probability is zero, and a half
//!   after ten seconds. Wheels that turn or stand during a quiet second change the probability for this vehicle.

mod inertial;

use inertial::WINDOW;
pub use inertial::{Axes, Inertial, Motion};

use crate::sample::{ImuSample, Standstill, WheelSample};
use crate::units::WheelSpeed;
use crate::vector::{dot, norm};

/// Largest shake of a vehicle at rest, rad/s, above an engine's, for gyros below 0.02 deg/s/sqrt(Hz). It and the next
/// two were chosen on training drives (test `standstills_of_every_recording_with_a_speed`).
const QUIET: f32 = 2e-3;
/// Largest change of speed within two seconds at rest, m/s.
pub const SPEED_CHANGE: f32 = 0.15;
/// Least speed that the vehicle loses before a stop, m/s.
const BRAKED: f32 = 0.6;
/// Shake that contradicts standing wheels when it lasts for [`SHAKEN`], rad/s. Loading shakes a truck by 0.013.
const DRIVEN_SHAKE: f32 = 6e-3;
/// The number of judgements in a row, 100 ms each.
const SHAKEN: u8 = 50;
/// Change of the force since the vehicle stands that only speeding up explains (or a tilt by 3 deg), and change of speed
/// within two seconds, m/s^2 and m/s; and the tenths of a second for which a vehicle rocks after it has stopped.
const CARRIED: (f32, f32) = (0.5, 0.5);
const ROCKS: u8 = 15;
/// Part of a loss of speed that is against the pull, and the force along it that a slope explains, m/s^2.
const AGAINST: f32 = 0.5;
const SLOPE: f32 = 0.6;
/// Speed of a wheel of a vehicle that drives, and does not creep at the wheels' threshold: 1 m/s.
const DRIVES: u32 = 65_536;
/// A change of the gyro's mean does not end a standstill while the speed changes by less than this share of the limit.
const STILL: f32 = 0.15;
/// Shake of a vehicle that an engine shakes as much as any, rad/s.
const CALM: f32 = 1.2e-2;
/// Least force that shows where a vehicle pulls away to, m/s^2.
const PULL: f32 = 0.3;
/// A speed of a wheel that shows motion: 0.3 m/s.
const TURNS: u32 = 19_661;
/// Largest loss of speed in 10 ms, 12 m/s^2, and the speed at which passive sensors go silent, 2 m/s; codes.
const BRAKING: u32 = 7_864;
const DEAD_BAND: u32 = 131_072;
/// Probability that standing wheels are a standing vehicle.
const BY_WHEELS: f32 = 0.9999;
/// Tenths of a second of quiet after which a road is excluded, and the probability from then on.
const LASTING: (u8, f32) = (100, 0.5);
/// Quiet seconds of this vehicle at rest and in motion, before its wheels have shown any; counted in tenths.
const BEFORE: [f32; 2] = [490.0, 10.0];

#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum StandstillSource {
    #[default]
    None,
    Wheels,
    Inertial,
}

#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Standing {
    pub source: StandstillSource,
    /// Probability that the vehicle stands, 0 to 1; 0 without evidence.
    pub probability: f32,
    /// The wheels stand, and another source contradicts them.
    pub is_contradicted: bool,
}

impl Standing {
    pub const UNKNOWN: Self =
        Self { source: StandstillSource::None, probability: 0.0, is_contradicted: false };
    pub const WHEELS: Self =
        Self { source: StandstillSource::Wheels, probability: BY_WHEELS, is_contradicted: false };
    const CONTRADICTED: Self = Self { is_contradicted: true, ..Self::UNKNOWN };

    /// Returns whether the vehicle probably stands: more than nine times in ten.
    pub fn is_likely(&self) -> bool {
        self.probability > 0.9
    }

    /// Returns whether a road is excluded, so that the output may be interrupted.
    pub fn is_lasting(&self) -> bool {
        self.probability >= LASTING.1
    }

    pub fn is_by_wheels(&self) -> bool {
        self.source == StandstillSource::Wheels
    }
}

#[derive(Debug, Clone)]
pub struct Judge {
    inertial: Inertial,
    /// Judgements in a row that are quiet, and those after them in which only the gyro's mean has changed.
    quiet_for: u8,
    lingers: u8,
    /// The quiet belongs to a stop, and whether the speed has changed since the last quiet.
    is_stop: bool,
    has_moved: bool,
    /// Judgements in a row that contradict standing wheels by their shake.
    shaken: u8,
    are_wheels_doubted: bool,
    /// The vehicle has sped up while the wheels stood.
    is_carried: bool,
    /// The newest motion: the wheels turn fast, the speed changes, or nothing but an engine shakes the vehicle.
    drives: bool,
    speeds_up: bool,
    pub is_calm: bool,
    still_for: u8,
    /// Force at the last standstill, and the one by which the vehicle left it, m/s^2.
    rest: Option<Axes>,
    pull: Option<Axes>,
    /// The least speed that the vehicle still has, however hard it brakes, codes.
    speed: u32,
    /// Quiet tenths of a second at rest and in motion, by the wheels.
    quiet: [f32; 2],
}

impl Judge {
    pub const START: Self = Self {
        inertial: Inertial::START,
        quiet_for: 0,
        lingers: 0,
        is_stop: true,
        has_moved: false,
        shaken: 0,
        are_wheels_doubted: false,
        is_carried: false,
        drives: false,
        speeds_up: false,
        is_calm: false,
        still_for: 0,
        rest: None,
        pull: None,
        speed: 0,
        quiet: BEFORE,
    };

    pub fn restart(&mut self) {
        (self.inertial, self.quiet_for) = (Inertial::START, 0);
    }

    /// Returns whether wheels faster than a creep, or a force or change of speed in 2 s, show that it drives.
    pub fn has_driven_off(&self) -> bool {
        self.drives || self.speeds_up
    }

    /// Judges a sample of the 100 Hz grid; `wheels` is `None` where there are none.
    pub fn observe(&mut self, sample: &ImuSample, wheels: Option<&WheelSample>) -> Standing {
        let standstill = wheels.map_or(Standstill::Unknown, |wheels| self.wheels(wheels));
        if !sample.validity.is_good() {
            self.restart();
        } else if let Some(motion) = self.inertial.add(sample) {
            self.inertial_evidence(&motion, standstill);
        }
        match standstill {
            Standstill::Still if self.are_wheels_doubted || self.is_carried => Standing::CONTRADICTED,
            Standstill::Still => Standing::WHEELS,
            Standstill::Moving => Standing::UNKNOWN,
            // A wheel that still tells has not decided yet.
            Standstill::Unknown if wheels.is_some_and(WheelSample::has_speed) => Standing::UNKNOWN,
            Standstill::Unknown if self.quiet_for > 0 => {
                let source = StandstillSource::Inertial;
                Standing { source, probability: self.probability(), is_contradicted: false }
            }
            Standstill::Unknown => Standing::UNKNOWN,
        }
    }

    fn probability(&self) -> f32 {
        let [rest, motion] = self.quiet;
        match self.quiet_for {
            _ if self.is_stop => rest / (rest + motion),
            lasting if lasting >= LASTING.0 => LASTING.1,
            _ => 0.0,
        }
    }

    /// Returns what the wheels show; a single wheel that turns shows motion. Doubts wheels that stopped too fast.
    fn wheels(&mut self, wheels: &WheelSample) -> Standstill {
        let speeds = wheels.speeds.iter().flatten();
        let fastest = speeds.map(|WheelSpeed(speed)| speed.unsigned_abs()).max().unwrap_or(0);
        let standstill = if fastest > TURNS { Standstill::Moving } else { wheels.standstill };
        // Some frames say that the vehicle moves, and not how fast.
        self.drives = standstill == Standstill::Moving && (!wheels.has_speed() || fastest >= DRIVES);
        self.speed = fastest.max(self.speed.saturating_sub(BRAKING));
        match standstill {
            Standstill::Still => self.are_wheels_doubted |= self.speed > DEAD_BAND,
            Standstill::Moving => (self.are_wheels_doubted, self.is_carried) = (false, false),
            Standstill::Unknown => {}
        }
        if standstill != Standstill::Still {
            self.still_for = 0;
        }
        standstill
    }

    /// Returns whether a change of speed before quiet is a braking that has ended.
    fn is_against_the_pull(&self, lost: Axes, force: Axes) -> bool {
        let (Some(pull), Some(rest)) = (self.pull, self.rest) else { return true };
        let size = norm(&pull);
        dot(&lost, &pull) <= -AGAINST * norm(&lost) * size && dot(&minus(force, rest), &pull) <= SLOPE * size
    }

    fn inertial_evidence(&mut self, motion: &Motion, wheels: Standstill) {
        let left = self.rest.map(|rest| minus(motion.newest, rest));
        let carried = left.is_some_and(|left| norm(&left) >= CARRIED.0);
        let speeds_up = motion.speed_change >= CARRIED.1;
        self.speeds_up = speeds_up || carried;
        self.is_calm = !speeds_up && motion.shake < CALM;
        if motion.speed_change >= SPEED_CHANGE || carried && self.is_stop {
            (self.is_stop, self.has_moved) = (false, true);
        }
        let is_quiet = motion.shake < QUIET && motion.speed_change < SPEED_CHANGE;
        // A gyro that jumps, and a deck that begins to turn, change no speed.
        let is_still = self.is_stop && self.quiet_for > 0 && motion.speed_change < STILL * SPEED_CHANGE;
        let is_turned = is_still && self.is_calm && self.lingers < WINDOW as u8;
        self.lingers = if is_turned && !is_quiet { self.lingers + 1 } else { 0 };
        self.quiet_for = if is_quiet || is_turned { self.quiet_for.saturating_add(1) } else { 0 };
        if is_quiet && core::mem::take(&mut self.has_moved) {
            self.is_stop |= motion
                .speed_lost
                .is_some_and(|lost| norm(&lost) >= BRAKED && self.is_against_the_pull(lost, motion.force));
        }
        if wheels == Standstill::Still {
            self.still_for = self.still_for.saturating_add(1);
            let sped_up = self.still_for > 2 * ROCKS && speeds_up;
            self.is_carried |= self.still_for > ROCKS && carried || sped_up;
        }
        let stands = match wheels {
            Standstill::Still => !self.is_carried && (self.still_for == ROCKS || self.rest.is_none()),
            Standstill::Moving => false,
            Standstill::Unknown => is_quiet && self.is_stop,
        };
        if stands {
            // Passive wheel sensors show zero while the vehicle still brakes.
            let force = if wheels == Standstill::Still { motion.newest } else { motion.force };
            (self.rest, self.pull) = (Some(force), None);
        } else if let (None, Some(rest)) = (self.pull, self.rest) {
            let pull = minus(motion.force, rest);
            self.pull = (norm(&pull) >= PULL).then_some(pull);
        }
        self.shaken = if wheels == Standstill::Still && motion.shake > DRIVEN_SHAKE {
            self.shaken.saturating_add(1)
        } else {
            0
        };
        self.are_wheels_doubted = (self.are_wheels_doubted || self.shaken >= SHAKEN) && !is_quiet;
        if is_quiet && self.is_stop {
            let [rest, moving] = &mut self.quiet;
            match wheels {
                Standstill::Still => *rest += 1.0,
                Standstill::Moving => *moving += 1.0,
                Standstill::Unknown => {}
            }
        }
    }
}

fn minus(one: Axes, other: Axes) -> Axes {
    core::array::from_fn(|axis| one[axis] - other[axis])
}
