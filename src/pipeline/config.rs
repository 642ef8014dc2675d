//! The pipeline's configuration is a plain value, separate from the pipeline's state.

use crate::bias::{EarthRate, StaticConfig, ThermalBias, ZeroRateConfig};
use crate::compensate::CompensateConfig;
use crate::fog::FogErrors;
use crate::heading::{CourseConfig, Gain};
use crate::health::slow::Knowledge;
use crate::mounting::{GyroMap, Rotation, Vertical};
use crate::pipeline::UncertaintyConfig;
use crate::units::SpecificForce;

#[derive(Debug, Clone, Copy)]
pub struct PipelineConfig {
    pub mounting: Rotation,
    /// The gyro's bias by temperature, in the sensor's axes, as earlier drives have shown it.
    pub thermal_bias: ThermalBias,
    /// Mean specific force at standstill, in the sensor's axes, where earlier drives have shown it.
    pub rest_force: Option<[SpecificForce; 3]>,
    pub forward: Knowledge,
    /// The correction of the gain and of the remaining mounting error of this unit's gyro.
    pub gyro_map: GyroMap,
    /// What standstills and turns of earlier drives have shown of the vertical, in the sensor's axes.
    pub vertical: Vertical,
    /// True if a tilt beyond the mounting is found and taken off.
    pub levelling: bool,
    pub static_init: StaticConfig,
    pub earth_rate: EarthRate,
    /// Zero-rate updates; `None` leaves the bias as static initialisation found it.
    pub zero_rate: Option<ZeroRateConfig>,
    /// Learning from courses, with the filter of the zero-rate updates.
    pub course: CourseConfig,
    pub gain: Option<Gain>,
    /// The model and map that a gain is found with ([`Gain::of`]).
    pub gain_of: u32,
    /// Settings of the compensation, which applies the estimates to the rates.
    pub compensate: CompensateConfig,
    pub uncertainty: UncertaintyConfig,
}

impl PipelineConfig {
    /// The configuration of a MEMS part on a car, x forward, y left, z up.
    pub const DEFAULT: Self = Self {
        mounting: Rotation::IDENTITY,
        thermal_bias: ThermalBias::UNKNOWN,
        rest_force: None,
        forward: Knowledge::Unknown,
        gyro_map: GyroMap::IDENTITY,
        vertical: Vertical::UNKNOWN,
        levelling: true,
        static_init: StaticConfig::DEFAULT,
        earth_rate: EarthRate::LeftInBias,
        zero_rate: Some(ZeroRateConfig::DEFAULT),
        course: CourseConfig::DEFAULT,
        gain: None,
        gain_of: 0,
        compensate: CompensateConfig::DEFAULT,
        uncertainty: UncertaintyConfig::DEFAULT,
    };

    /// The same for an inertial unit with an optical gyro, by the gyro's data sheet: with the numbers of a MEMS part courses
    /// would move a bias that a standstill has shown better. The bias walks at least as far as the sheet's in an hour, and
    /// neither a standstill nor the road changes it by more. The expected error stays that of a MEMS part.
    #[must_use]
    pub fn with_gyro(self, errors: &FogErrors) -> Self {
        let FogErrors { angle_walk, bias, bias_walk, scale } = *errors;
        let zero_rate = self.zero_rate.map(|own| ZeroRateConfig {
            // Static initialisation takes three seconds.
            initial: 0.577 * angle_walk,
            walk: bias_walk.max(bias / 60.0),
            standstill: bias,
            noise: angle_walk,
            ..own
        });
        Self { zero_rate, course: CourseConfig { driving: bias, gain: scale, ..self.course }, ..self }
    }
}
