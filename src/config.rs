//! The parts of a [`Config`](crate::Config), in one place: each stage owns the type that configures it.

pub use crate::bias::{EarthRate, Latitude, StaticConfig, ZeroRateConfig};
pub use crate::compensate::{CompensateConfig, Lag, Stride};
pub use crate::coprocessor::StorageFaults;
pub use crate::fog::{FogConfig, FogErrors, Tilt};
pub use crate::mounting::{Rotation, Vertical};
pub use crate::pipeline::{PipelineConfig, UncertaintyConfig};
