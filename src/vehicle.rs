//! What the pipeline says of the vehicle, once a sample; what is sent is made from it alone.

use crate::health::{Faults, Quality, Source};
use crate::units::{AngularRate, CentiCelsius, SpecificForce, Yaw};

/// The corrected yaw rate and what it is worth.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct YawSample {
    /// Corrected rate.
    pub rate: AngularRate,
    /// What the correction took off.
    pub correction: AngularRate,
    /// Accumulated yaw.
    pub yaw: Yaw,
    /// Expected error of the rate, 1 sigma, where known.
    pub sigma: Option<AngularRate>,
    /// Where the rate comes from.
    pub source: Source,
    /// What it is worth.
    pub quality: Quality,
    /// What is wrong at present.
    pub faults: Faults,
    /// From the sample to the message, microseconds, where known.
    pub latency_us: Option<u32>,
}

/// The yaw rate for receivers that steer by it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct PromptSample {
    /// Corrected rate, of the newest sample.
    pub rate: AngularRate,
    /// What it is worth.
    pub quality: Quality,
}

/// What goes out for one sample: both rates, the other axes, and what they are worth.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct VehicleSample {
    /// At once: for the Bosch messages and VDC2.
    pub prompt: PromptSample,
    /// For navigation, some samples late: for our own messages.
    pub yaw: YawSample,
    /// About x, forward, less its bias.
    pub roll_rate: AngularRate,
    /// About y, left, less its bias.
    pub pitch_rate: AngularRate,
    /// Along x, y, z.
    pub specific_force: [SpecificForce; 3],
    /// Of the part, where known.
    pub temperature: Option<CentiCelsius>,
    /// Step of the grid.
    pub tick: u32,
}

impl VehicleSample {
    /// Made with the built-in configuration because the one of this vehicle is lost: no rate is
    /// better than degraded, whatever the pipeline thinks of it.
    pub fn doubt(&mut self) {
        for quality in [&mut self.prompt.quality, &mut self.yaw.quality] {
            if *quality == Quality::Good {
                *quality = Quality::Degraded;
            }
        }
    }
}
