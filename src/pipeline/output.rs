//! What comes out.

use crate::bias::StaticError;
use crate::compensate::{Implausible, Settled};
use crate::health::Status;
use crate::units::{AngularRate, Yaw};
use crate::vehicle::VehicleSample;
use crate::window::{Features, WINDOW};

/// The corrected yaw rate of one sample.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct YawRate {
    /// Grid step of the sample.
    pub tick: u32,
    /// Gyro less bias and correction; in [`Status::Init`] the raw gyro.
    pub rate: AngularRate,
    /// What was taken off the gyro less its static bias: the network's estimate, what the zero-rate
    /// updates found, revisions of earlier samples.
    pub correction: AngularRate,
    /// Sum of all these rates since the bias became known.
    pub yaw: Yaw,
    /// Expected error of the mean rate over a second, 1 sigma, once the bias is known.
    pub sigma: Option<AngularRate>,
    /// How good it is.
    pub status: Status,
}

/// What [`YawRate::yaw`] lacks to be the sum of the best estimates.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Owed {
    /// Of the prompt rates: revisions that are not carried yet.
    pub prompt: Yaw,
    /// Of the navigation rates: those, and the samples that wait for their turn.
    pub navigation: Yaw,
}

/// A window that is due, oldest sample first, and the tick of its newest one.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct DueWindow {
    /// Tick of the newest sample.
    pub end: u32,
    /// The samples.
    pub features: [Features; WINDOW],
}

/// What one sample led to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Output {
    /// The rate of this very sample: for a receiver that steers by it.
    pub prompt: YawRate,
    /// The rate of the sample [`crate::compensate::CompensateConfig::lag`] before it: for a
    /// receiver that sums it up to a heading. [`Status::Init`] before there is one.
    pub navigation: YawRate,
    /// Both, with all that is sent beside them, for [`crate::can::feeds::Feeds`].
    pub vehicle: VehicleSample,
    /// The sample whose estimate is final with this one.
    pub settled: Option<Settled>,
    /// Run this through the network and [`super::Pipeline::deliver`] the estimate before the
    /// sample [`crate::compensate::Mode::delay`] steps on.
    pub window: Option<DueWindow>,
    /// Static initialisation was refused with this sample; it has started anew.
    pub refused: Option<StaticError>,
    /// The estimate due with this sample was not believed.
    pub implausible: Option<Implausible>,
}
