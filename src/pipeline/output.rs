//! These types hold the results of one sample: the rates to send, and the window to run.

use crate::bias::StaticError;
use crate::compensate::{Implausible, Settled};
use crate::estimate::VehicleSample;
use crate::model::window::{Features, WINDOW};
use crate::units::Yaw;

/// Holds the corrections that [`crate::estimate::YawEstimate::yaw`] does not contain yet.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Owed {
    /// Missing from the prompt yaw: revisions that have not been carried over yet.
    pub prompt: Yaw,
    /// Missing from the navigation yaw: revisions that have not been carried over yet, and the samples whose rates
    /// are not sent yet.
    pub navigation: Yaw,
}

/// Holds a window that is due for the network.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct DueWindow {
    /// Tick of the newest sample.
    pub end: u32,
    /// Features of the samples, oldest first.
    pub features: [Features; WINDOW],
}

/// Holds the results of one sample.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Output {
    /// Both rates and everything else that is sent, for [`crate::can::encoder::CanEncoder`].
    pub vehicle: VehicleSample,
    /// The sample whose estimate is final with this one.
    pub settled: Option<Settled>,
    /// A window that is due: run it through the network and [`super::Pipeline::deliver`] the estimate before the sample
    /// [`crate::compensate::Mode::delay`] steps later.
    pub window: Option<DueWindow>,
    /// The reason why static initialisation failed with this sample and started again.
    pub refused: Option<StaticError>,
    /// The reason why the estimate due with this sample was rejected.
    pub implausible: Option<Implausible>,
}
