//! An estimate is the corrected yaw rate with its quality; every CAN frame is made from these values alone.

mod accumulated;

pub(crate) use accumulated::AccumulatedYaw;
pub use accumulated::Missed;

use crate::health::{Faults, Quality, Source, Status};
use crate::units::{AngularRate, CentiCelsius, SpecificForce, Yaw};

/// Holds the corrected yaw rate of one sample.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct YawEstimate {
    /// Grid step of the sample that the rate belongs to.
    pub tick: u32,
    /// The corrected rate: the gyro's own reading in [`Status::Init`], zero while the sensor is silent.
    pub rate: AngularRate,
    /// Subtracted from the gyro beyond its static bias: the network's estimate, zero-rate updates, revisions.
    pub correction: AngularRate,
    /// Sum of these rates since the bias is known, over steps of the sensor's clock ([`crate::align::clock_ratio`]).
    pub yaw: Yaw,
    /// The expected error of the mean rate over one second, 1 sigma, once the bias is known.
    pub sigma: Option<AngularRate>,
    /// The state of the rate.
    pub status: Status,
    /// The origin of the rate.
    pub source: Source,
    /// The quality of the rate for a receiver.
    pub quality: Quality,
    /// The faults that are present.
    pub faults: Faults,
    /// The age of the sample when its message is made, without the delays of sensor, line and bus, us; where known.
    pub latency_us: Option<u32>,
}

impl YawEstimate {
    /// Takes over, for a mean of both, what it must not lose of an earlier estimate: the worst quality with its status
    /// and source, the largest sigma, and every fault. An unknown sigma is larger than any.
    #[must_use]
    pub fn with_earlier(self, earlier: &Self) -> Self {
        let worst = if earlier.quality as u8 > self.quality as u8 { *earlier } else { self };
        let Self { status, source, quality, .. } = worst;
        let sigma = self.sigma.zip(earlier.sigma).map(|(one, other)| one.max(other));
        Self { status, source, quality, sigma, faults: self.faults.with(earlier.faults), ..self }
    }
}

impl VehicleSample {
    /// Notes how late the sample came, us; its rates are those of its time, if it `is_stale` not the present ones.
    pub(crate) fn come_late(&mut self, late_us: u32, is_stale: bool) {
        for estimate in [&mut self.live, &mut self.delayed] {
            estimate.latency_us = estimate.latency_us.map(|latency| latency.saturating_add(late_us));
            if !is_stale {
                continue;
            }
            estimate.faults = estimate.faults.with(Faults::GAP);
            if estimate.quality == Quality::Good {
                estimate.quality = Quality::Degraded;
            }
        }
    }
}

/// Holds everything that is sent for one sample of the inertial sensor.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct VehicleSample {
    /// The rate of this sample, for receivers that use it for control: the Bosch messages.
    pub live: YawEstimate,
    /// The rate [`crate::compensate::CompensateConfig::lag`] samples earlier, to be integrated: our own messages.
    pub delayed: YawEstimate,
    /// The rate about x (forward) less its bias.
    pub roll_rate: AngularRate,
    /// The rate about y (left) less its bias.
    pub pitch_rate: AngularRate,
    /// The specific force along x, y, z.
    pub specific_force: [SpecificForce; 3],
    /// The temperature of the part, where it reports one.
    pub temperature: Option<CentiCelsius>,
    /// Grid step of this sample.
    pub tick: u32,
}
