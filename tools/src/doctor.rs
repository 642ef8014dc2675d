//! A recording examined before anyone trusts it: what its sensor does, what can be judged on it, and what a calibration or
//! a training could gain.
//!
//! The recording is read row by row and refused by nobody here: what the other commands would refuse it for is one of the
//! findings.

mod allan;
mod findings;
mod page;
mod recording;
mod wheels;

pub use allan::{Allan, Noise};
pub use findings::{Doctor, Finding, Mounting, Verdict};
pub use page::page;
