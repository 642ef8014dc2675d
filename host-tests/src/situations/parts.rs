//! The sensor parts that a vehicle may have. The MTi's and the DSP-1760's messages are built in `sensor`, by hand; those of
//! an ICM-42688-P here, by the library's encoder, on a simulated bus.
//!
//! | part | what is sent | what is rounded |
//! |---|---|---|
//! | ICM-42688-P | one 20-bit FIFO packet | 1/131 deg/s, 1/8192 g |

pub mod icm42688;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Part {
    Xsens,
    /// KVH DSP-1760, beside an MTi.
    Dsp1760,
    Icm42688,
}
