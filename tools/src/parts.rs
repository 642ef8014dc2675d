//! The sensor parts that a vehicle may have: a sample as the bytes that the part would send.
//!
//! | part | what is sent | what is rounded |
//! |---|---|---|
//! | Xsens MTi | one MTData2 message, single precision | nothing: every code is an f32 |
//! | KVH DSP-1760 | ten increments about each axis | f32 increments, the code of their sum |
//! | ICM-42688-P | one 20-bit FIFO packet, over a simulated SPI bus | 1/131 deg/s, 1/8192 g |
//! | ADIS16465-2 | one burst, over a simulated SPI bus | 1/40 deg/s, 1/4000 g |

pub mod adis16465;
pub mod dsp1760;
pub mod icm42688;
pub mod xsens;

/// A sensor part of the vehicle.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Part {
    /// Xsens MTi: MTData2 in single precision, an 8-bit sum.
    Xsens,
    /// KVH DSP-1760: increments at 1 kHz with a CRC-32, beside the recorded accelerometer.
    Dsp1760,
    /// TDK ICM-42688-P: FIFO packets of 20 bits over SPI, no checksum.
    Icm42688,
    /// ADIS16465-2: bursts of 16 bits over SPI, a 16-bit sum.
    Adis16465,
}

impl std::fmt::Display for Part {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let maker = if *self == Self::Dsp1760 { "KVH " } else { "" };
        write!(f, "{maker}{}", self.name())
    }
}

impl Part {
    /// All parts.
    pub const ALL: [Self; 4] = [Self::Xsens, Self::Dsp1760, Self::Icm42688, Self::Adis16465];

    /// Returns the name in tables.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Xsens => "Xsens MTi",
            Self::Dsp1760 => "DSP-1760",
            Self::Icm42688 => "ICM-42688-P",
            Self::Adis16465 => "ADIS16465",
        }
    }
}
