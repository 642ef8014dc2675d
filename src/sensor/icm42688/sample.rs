//! From a packet's counts to the pipeline's units, and from the part's clock to one that never
//! wraps.

use super::packet::{Packet, Resolution};
use crate::sample::ImuSample;
use crate::units::{AngularRate, CentiCelsius, Micros, STANDARD_GRAVITY, SpecificForce};

impl Resolution {
    /// Counts per deg/s, at the range that the driver sets.
    #[must_use]
    pub const fn counts_per_dps(self) -> f32 {
        match self {
            // At 250 deg/s eight times the 16.4 counts per deg/s that there are at 2000.
            Self::Bits16 => 131.0,
            // Halved they are 131 counts per deg/s.
            Self::Bits20 => 262.0,
        }
    }

    /// Counts per g.
    #[must_use]
    pub const fn counts_per_g(self) -> f32 {
        match self {
            // 16 g.
            Self::Bits16 => 2048.0,
            // Quartered they are 8192 per g.
            Self::Bits20 => 32_768.0,
        }
    }

    /// Counts per deg C above 25.
    const fn counts_per_degree(self) -> f32 {
        match self {
            Self::Bits16 => 2.07,
            Self::Bits20 => 132.48,
        }
    }
}

impl Packet {
    /// The readings in the pipeline's units, taken at `time`; `None` where an axis has no
    /// reading.
    #[must_use]
    pub fn sample(&self, time: Micros) -> Option<ImuSample> {
        let (per_dps, per_g) = (self.resolution.counts_per_dps(), self.resolution.counts_per_g());
        let rate = |reading: Option<i32>| {
            AngularRate::from_rad_per_sec((reading? as f32 / per_dps).to_radians()).ok()
        };
        let force = |reading: Option<i32>| {
            SpecificForce::from_metre_per_sec2(reading? as f32 / per_g * STANDARD_GRAVITY).ok()
        };
        let ([ax, ay, az], [gx, gy, gz]) = (self.acceleration, self.rate);
        let per_degree = self.resolution.counts_per_degree();
        let readings = || self.acceleration.iter().chain(&self.rate).flatten();
        Some(ImuSample {
            time,
            specific_force: [force(ax)?, force(ay)?, force(az)?],
            angular_rate: [rate(gx)?, rate(gy)?, rate(gz)?],
            temperature: self.temperature.map(|code| {
                // At most 27,000.
                CentiCelsius(libm::roundf(f32::from(code) * (100.0 / per_degree) + 2500.0) as i16)
            }),
            clipped: readings().any(|reading| clipped(self.resolution, *reading)),
        })
    }
}

/// The ends of the range. The bits below 16 say nothing there.
const fn clipped(resolution: Resolution, reading: i32) -> bool {
    let high = match resolution {
        Resolution::Bits16 => reading,
        Resolution::Bits20 => reading >> 4,
    };
    high >= 32_767 || high <= -32_767
}

/// The part's 16-bit microseconds, unwrapped: right as long as two samples are less than
/// 65 ms apart. A longer silence is told by the arrival times ([`crate::align`]).
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Clock {
    last: Option<(u16, u64)>,
}

impl Clock {
    pub(super) fn unwrap(&mut self, time: u16) -> Micros {
        let now = self.last.map_or(u64::from(time), |(last, at)| at + u64::from(time.wrapping_sub(last)));
        self.last = Some((time, now));
        Micros(now)
    }
}
