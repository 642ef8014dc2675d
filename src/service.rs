//! The device holds what a user configures or examines: stored data, weights and calibration.
//!
//! [`Device`] owns the flash; testers reach it over diagnosis ([`crate::uds`]). Every request is checked completely
//! before anything is written; a refusal has a reason ([`message::Refusal`]).

mod conditions;
#[doc(hidden)]
pub mod crash;
pub mod device;
pub mod event;
mod learner;
pub mod message;
mod not_good;
#[doc(hidden)]
pub mod spi_imu;
#[doc(hidden)]
mod text;

pub use conditions::Conditions;
pub use device::{Device, MappedSlots, SupportedHardware};
pub use learner::Learner;
