//! These modules simulate the sensor parts that a vehicle may have, byte by byte.
//!
//! The samples of a recording are encoded as the part would send them, and decoded by the parser that the board runs.
//! The fault harness of `host-tests` corrupts the same bytes.
//!
//! | part | what is sent | what is rounded |
//! |---|---|---|
//! | Xsens MTi | one MTData2 message per row, single precision | nothing: every code is an f32 |
//! | KVH DSP-1760 | ten increments per row about each axis; accelerometer as recorded | f32 increments, the code of their sum |
//! | ICM-42688-P | one 20-bit FIFO packet per row, over a simulated SPI bus | 1/131 deg/s, 1/8192 g |
//! | ADIS16465-2 | one burst per row, over a simulated SPI bus | 1/40 deg/s, 1/4000 g |

pub mod adis16465;
pub mod dsp1760;
pub mod icm42688;
pub mod xsens;

use crate::drive::recording::{Recording, Row};
use gyronet::sample::ImuSample;
use gyronet::units::{AngularRate, SpecificForce};

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

/// The steps to which a part's readings are rounded; 0 without rounding.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Quantisation {
    /// Step of the rate, rad/s.
    pub rate: f64,
    /// Step of the specific force, m/s^2.
    pub force: f64,
}

/// The reason why a recording cannot be sent through a part.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ViaError {
    /// The bytes of a row gave no sample.
    #[error("{path}: line {line}: the {part} delivers no sample: {why}")]
    NoSample {
        path: String,
        /// The row's line.
        line: u64,
        /// The part.
        part: Part,
        /// The parser's error.
        why: String,
    },
    /// The part did not start.
    #[error("the {part} does not start: {why}")]
    NoStart {
        /// The part.
        part: Part,
        /// The driver's error.
        why: String,
    },
}

/// A recording that was sent through a part.
#[derive(Debug, Clone)]
pub struct Via {
    /// The rows with the samples that the part's parser delivered.
    pub recording: Recording,
    /// The rounding of the part's readings.
    pub quantisation: Quantisation,
    /// Number of bytes that the parser received.
    pub bytes: u64,
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

    pub fn send(self, recording: &Recording) -> Result<Via, ViaError> {
        let (samples, bytes) = match self {
            Self::Xsens => xsens::send(recording)?,
            Self::Dsp1760 => dsp1760::send(recording)?,
            Self::Icm42688 => icm42688::send(recording)?,
            Self::Adis16465 => adis16465::send(recording)?,
        };
        let rows = recording.rows.iter().zip(samples).map(|(row, sample)| Row { sample, ..*row }).collect();
        Ok(Via {
            recording: Recording { rows, ..recording.clone() },
            quantisation: self.quantisation(recording),
            bytes,
        })
    }

    /// Returns the rounding of the part's readings in this recording: the part's steps, our codes, and f32.
    fn quantisation(self, recording: &Recording) -> Quantisation {
        let rates = recording.rows.iter().flat_map(|row| row.sample.angular_rate);
        let peak = rates.map(|rate| rate.rad_per_sec().abs()).fold(0.0, f64::max);
        let forces = recording.rows.iter().flat_map(|row| row.sample.specific_force);
        let peak_force = forces.map(|force| force.metre_per_sec2().abs()).fold(0.0, f64::max);
        let rate_code = AngularRate(1).rad_per_sec();
        let force_code = SpecificForce(1).metre_per_sec2();
        let ulp = f64::from(f32::EPSILON);
        match self {
            Self::Xsens => Quantisation::default(),
            // An increment is rounded once; ten equal increments have equal errors.
            Self::Dsp1760 => Quantisation { rate: rate_code + ulp * peak, force: 0.0 },
            // The driver divides and multiplies in f32, which adds two roundings.
            Self::Icm42688 => Quantisation {
                rate: icm42688::RATE_STEP + rate_code + 3.0 * ulp * peak,
                force: icm42688::FORCE_STEP + force_code + 3.0 * ulp * peak_force,
            },
            Self::Adis16465 => {
                let [rate, force] = adis16465::steps();
                Quantisation {
                    rate: rate + rate_code + 3.0 * ulp * peak,
                    force: force + force_code + 3.0 * ulp * peak_force,
                }
            }
        }
    }

    fn no_sample(self, recording: &Recording, row: &Row, why: impl std::fmt::Display) -> ViaError {
        let (path, line) = (recording.path.clone(), row.line);
        ViaError::NoSample { path, line, part: self, why: why.to_string() }
    }
}

/// Returns the message that an Xsens MTi would send for each row of a recording.
pub fn mti_bytes(recording: &Recording) -> Vec<Vec<u8>> {
    xsens::messages(recording).collect()
}

/// The sample of each row from a part, and the number of bytes that were sent.
type Sent = (Vec<ImuSample>, u64);
