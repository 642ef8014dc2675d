//! Situations in which vehicles really are, each simulated with its exact truth, and judged by what the bus says.
//!
//! A [`list::Situation`] sets up a [`scene::Scene`]: what the vehicle does ([`ride`]), how it shakes ([`vehicle`]),
//! which errors and faults its sensor ([`sensor`]) and its wheel frames ([`wheels`]) have, what its line does. Bytes go into the
//! [`board`], frames come out to the [`receiver`], and [`judge`] holds them against the truth.

pub mod board;
mod damage;
pub mod icm42688;
pub mod judge;
pub mod list;
pub mod receiver;
pub mod recordings;
pub mod ride;
pub mod scene;
pub mod sensor;
pub mod vehicle;
pub mod wheels;
