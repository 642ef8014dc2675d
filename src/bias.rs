//! These modules estimate the gyro's reading at rest, and the uncertainty of that estimate.
//!
//! `static_init` takes the mean of three seconds at the start. `zero_rate` goes on whenever the vehicle stands: it
//! estimates the remaining rate behind the network, so that the loop is closed around gyro and network together. The
//! wheels show that the vehicle stands; where there are none, `quiet` looks at the inertial sensors, within limits that
//! are tighter than those of the start. `curve` keeps what standstills have shown by temperature. `earth` keeps the rotation of the Earth from being taken off twice.

mod curve;
pub(crate) mod earth;
mod quiet;
mod spread;
mod static_init;
mod zero_rate;

pub use curve::{BiasCurve, CurveBias, CurveFilter};
pub use earth::{EarthRate, Latitude, ZeroPoint};
pub use quiet::{QuietConfig, QuietDetector};
pub use static_init::{Rest, STATIC_SAMPLES, StaticConfig, StaticError, StaticInit};
pub use zero_rate::{StandstillSource, ZeroRate, ZeroRateConfig, ZeroRateOutcome};
