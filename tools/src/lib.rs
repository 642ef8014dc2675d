//! Host tools of gyronet: they run recorded and simulated drives through the library and measure the results.
//!
//! Each tool is one module; an arrow below means "uses". The commands of the `gyronet` binary are thin adapters over
//! these modules.
//!
//! ```text
//! board <- drive <- parts
//! drive <- calibrate
//! drive <- doctor -> plot
//! drive <- evaluate
//! target -> simulate      network      client <- reference      wheels      python
//! demo -> everything above
//! ```

pub mod board;
pub mod bundled;
pub mod calibrate;
pub mod client;
pub mod demo;
pub mod doctor;
pub mod drive;
pub mod evaluate;
pub mod network;
pub mod plot;
pub mod python;
pub mod random;
pub mod reference;
pub mod signing;
pub mod simulate;
pub mod target;
pub mod wheels;
