//! These types are the results of one sample.

use crate::bias::StaticError;
use crate::compensate::{Implausible, Settled};
use crate::estimate::VehicleSample;
use crate::model::window::{Features, WINDOW};
use crate::units::Yaw;

/// The part that [`crate::estimate::YawEstimate::yaw`] lacks to be the sum of the best estimates.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Owed {
    /// The part that the prompt rates lack: revisions that are not carried yet.
    pub prompt: Yaw,
    /// The part that the navigation rates lack: those, and the samples that wait for their turn.
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

/// The results of one sample.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Output {
    /// Both rates, and all else that is sent, for [`crate::can::encoder::CanEncoder`].
    pub vehicle: VehicleSample,
    /// The sample whose estimate is final with this one.
    pub settled: Option<Settled>,
    /// A window that is due: run it through the network and [`super::Pipeline::deliver`] the estimate before
    /// the sample [`crate::compensate::Mode::delay`] steps on.
    pub window: Option<DueWindow>,
    /// Static initialisation was refused with this sample; it has started again.
    pub refused: Option<StaticError>,
    /// The estimate due with this sample was rejected.
    pub implausible: Option<Implausible>,
}
