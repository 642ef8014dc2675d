//! Code that the host tests share: how a test gets QEMU or the recordings or reports that it is skipped, the virtual board and
//! its image, and every generator of bytes, samples, streams and weights.

pub use gyronet_board::{board, image, recordings, require, wire};

pub mod entrance;
pub mod flash;
pub mod gnss;
pub mod golden;
pub mod kingston;
pub mod models;
pub mod noise;
pub mod packing;
pub mod parallel;
pub mod replay;
pub mod sent;
pub mod sequence;
pub mod settings;
pub mod situations;
pub mod spi;
pub mod stored;
pub mod stream;
pub mod synthetic;
pub mod tester;
pub mod winding;
