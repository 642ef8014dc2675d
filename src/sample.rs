//! A sample is one reading of a sensor; a frame is a sample with its place on the 100 Hz grid.

pub use crate::units::RATE_HZ;
use crate::units::{Angle, AngularRate, CentiCelsius, Micros, SpecificForce, WheelSpeed};

/// The grid's step is 10 ms, in microseconds.
pub const PERIOD_US: u64 = 1_000_000 / RATE_HZ as u64;

/// The time of a reading from a part that sends none: the time of its arrival is used.
pub const NO_STAMP: Micros = Micros(u64::MAX);

/// Holds one reading of an inertial measurement unit: x forward, y left, z up (FLU).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct ImuSample {
    /// Time of the reading by the part's own clock, unwrapped, or [`NO_STAMP`].
    pub time: Micros,
    /// Specific force x, y, z.
    pub specific_force: [SpecificForce; 3],
    /// Angular rate about x, y, z.
    pub angular_rate: [AngularRate; 3],
    /// Temperature of the part, where it reports one.
    pub temperature: Option<CentiCelsius>,
    /// A parser reports [`Validity::Saturated`] where the part does; [`crate::monitor`] finds the rest.
    pub validity: Validity,
}

/// Says whether a reading can be used, and if not, why.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Validity {
    /// The reading can be used.
    #[default]
    Good,
    /// The part reports that one of its axes is saturated.
    Saturated,
    /// The part was saturated less than 50 ms ago, and its filter is still recovering.
    Recovering,
    /// The readings repeat themselves: the part is stuck.
    Stuck,
    /// The reading is further from the last good one than a vehicle moves in 10 ms.
    Implausible,
}

impl Validity {
    /// Returns the validity that a part reports for its own reading.
    pub const fn reported(saturated: bool) -> Self {
        if saturated { Self::Saturated } else { Self::Good }
    }

    /// Returns whether the reading can be used.
    pub const fn is_good(self) -> bool {
        matches!(self, Self::Good)
    }
}

/// Constant readings with noise of one bit, for tests: readings that never change are those of a part that is stuck.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct TestSignal {
    /// Specific force x, y, z.
    pub specific_force: [SpecificForce; 3],
    /// Angular rate about x, y, z.
    pub angular_rate: [AngularRate; 3],
}

impl TestSignal {
    /// A level sensor that turns about the vertical at `deg_per_sec`.
    pub const fn turning(deg_per_sec: f64) -> Self {
        Self {
            specific_force: [SpecificForce(0), SpecificForce(0), SpecificForce::STANDARD_GRAVITY],
            angular_rate: [AngularRate::ZERO, AngularRate::ZERO, AngularRate::from_deg_per_sec(deg_per_sec)],
        }
    }

    /// Returns the sample with this number, 100 a second.
    pub fn sample(&self, number: u32) -> ImuSample {
        let noise = (number % 2) as i32;
        ImuSample {
            time: Micros(u64::from(number) * PERIOD_US),
            specific_force: self.specific_force.map(|force| SpecificForce(force.0.saturating_add(noise))),
            angular_rate: self.angular_rate.map(|rate| AngularRate(rate.0.saturating_add(noise))),
            temperature: None,
            validity: Validity::Good,
        }
    }
}

/// The turn of a fibre-optic gyro since its previous message: x forward, y left, z up (FLU).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct FogSample {
    /// The time at which the increment ended, by the part's own clock, unwrapped.
    pub time: Micros,
    /// Duration of the increment, microseconds.
    pub span: u32,
    /// Messages missing before this one; the angle turned in them is lost.
    pub lost: u32,
    /// Angle turned about x, y, z; `None` where the part marks it invalid or has no such axis.
    pub increment: [Option<Angle>; 3],
    /// Temperature of the part, where it reports one.
    pub temperature: Option<CentiCelsius>,
}

impl ImuSample {
    pub(crate) fn codes(&self) -> [i32; 6] {
        let ([fx, fy, fz], [wx, wy, wz]) = (self.specific_force, self.angular_rate);
        [fx.0, fy.0, fz.0, wx.0, wy.0, wz.0]
    }
}

/// Holds a sample with its place on the 100 Hz grid.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Frame {
    /// Number of the grid step, counted from the first sample.
    pub tick: u32,
    /// Grid steps before this one that no sample filled.
    pub missing: u32,
    /// The sample itself.
    pub sample: ImuSample,
}

/// A vehicle has this many wheels, in the order front left, front right, rear left, rear right.
pub const WHEELS: usize = 4;

/// Says whether the vehicle stands, as its wheels show it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Standstill {
    /// Standstill is not known: wheels are silent, or have only just become slow.
    #[default]
    Unknown,
    /// The wheels turn.
    Moving,
    /// All wheels have stood still for long enough.
    Still,
}

/// Holds the newest speeds of the wheels, and whether they stand.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct WheelSample {
    /// The time by the caller's clock.
    pub time: Micros,
    /// Speed of each wheel, where one is known.
    pub speeds: [Option<WheelSpeed>; WHEELS],
    /// The standstill of the vehicle.
    pub standstill: Standstill,
}

impl WheelSample {
    /// Returns the left and right speed of the rear axle, which is not steered, or else of the front one.
    pub(crate) fn axle(&self) -> Option<[WheelSpeed; 2]> {
        let [front_left, front_right, rear_left, rear_right] = self.speeds;
        Some([rear_left.or(front_left)?, rear_right.or(front_right)?])
    }

    /// Returns whether a wheel has a speed.
    pub fn has_speed(&self) -> bool {
        self.speeds.iter().any(Option::is_some)
    }

    /// Creates a report without speeds.
    pub const fn without_speeds(standstill: Standstill) -> Self {
        Self { time: Micros(0), speeds: [None; WHEELS], standstill }
    }
}

/// Extends 32-bit stamps (71 minutes of us) to 64 bits. One that is smaller by up to half the range steps back.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct StampClock {
    last: Option<(u32, u64)>,
}

impl StampClock {
    pub(crate) const START: Self = Self { last: None };

    pub(crate) fn unwrap(&mut self, stamp: u32) -> u64 {
        let time = match self.last {
            None => u64::from(stamp),
            Some((last, base)) => base.saturating_add_signed(i64::from(stamp.wrapping_sub(last) as i32)),
        };
        self.last = Some((stamp, time));
        time
    }
}
