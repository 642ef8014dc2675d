//! What is told of a sample beside its rates: faults, source, quality, the other axes.

use super::{Pipeline, YawRate};
use crate::bias::ZeroRate;
use crate::health::{Faults, judge};
use crate::sample::{Frame, ImuSample, PERIOD_US, WheelSample};
use crate::units::AngularRate;
use crate::vehicle::{PromptSample, VehicleSample, YawSample};

impl Pipeline {
    /// What is wrong with this sample.
    fn faults(&self, sample: &ImuSample) -> Faults {
        let fault = |present: bool, fault| if present { fault } else { Faults::NONE };
        self.estimate_faults
            .with(fault(self.gap_within > 0, Faults::GAP))
            .with(fault(sample.clipped, Faults::CLIPPED))
            .with(fault(self.compensator.owes_much(), Faults::IMPLAUSIBLE))
            .with(fault(self.wheels_silent() || self.contradicted(), Faults::WHEELS))
    }

    fn contradicted(&self) -> bool {
        self.zero_rate().is_some_and(ZeroRate::contradicted)
    }

    /// A wheel that has had a speed has none, or none has ever had one.
    fn wheels_silent(&self) -> bool {
        let Some(WheelSample { speeds, .. }) = self.wheels else { return false };
        let lost = |(speed, seen): (&Option<_>, bool)| seen && speed.is_none();
        speeds.iter().all(Option::is_none) || speeds.iter().zip(self.wheels_seen).any(lost)
    }

    #[inline(never)]
    pub(super) fn vehicle(&self, prompt: &YawRate, navigation: &YawRate, frame: &Frame) -> VehicleSample {
        let (_, prompt_quality) = judge(prompt.status);
        let (source, quality) = judge(navigation.status);
        let zero = self.known.as_ref().map_or([AngularRate::ZERO; 3], |known| known.zero.reading());
        let [roll_rate, pitch_rate, _] = frame.sample.angular_rate;
        let less = |rate: AngularRate, zero: AngularRate| AngularRate(rate.0.saturating_sub(zero.0));
        let samples_late = frame.tick.wrapping_sub(navigation.tick);
        VehicleSample {
            prompt: PromptSample { rate: prompt.rate, quality: prompt_quality },
            yaw: YawSample {
                rate: navigation.rate,
                correction: navigation.correction,
                yaw: navigation.yaw,
                sigma: navigation.sigma,
                source,
                quality,
                faults: self.faults(&frame.sample),
                // From sample to sample: the pipeline has no clock to add its own time by.
                latency_us: Some(samples_late.saturating_mul(PERIOD_US as u32)),
            },
            roll_rate: less(roll_rate, zero[0]),
            pitch_rate: less(pitch_rate, zero[1]),
            specific_force: frame.sample.specific_force,
            temperature: frame.sample.temperature,
            tick: frame.tick,
        }
    }
}
