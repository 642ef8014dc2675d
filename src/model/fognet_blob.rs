//! Checks FoGNet's weight file before use and reads it in place, without a copy.
//!
//! The file begins with the header of `model::file`, followed by:
//!
//! | offset | type | field |
//! |---|---|---|
//! | 104 | i32 x 60 | [`FogBlob::gains`] |
//! | 344 | i32, i32 | lower and upper half of [`FogBlob::offset`] |
//! | 352 | u16 | the gyro: 1 = KVH DSP-1760, 2 = KVH DSP-3000, 3 = the rate of GyroNet |
//! | 354 | u16 | 1 where the training drives are simulated, else 0 |
//! | 356 | u32 | serial number of the gyro that it was trained for; 0 = any of that part |
//! | 360 | P bytes | provenance, UTF-8 JSON |
//! | 360 + P | | LSTM1's four directions, of 10 inputs: the tenth is not used |
//! | ... | i16 x 180, i32, i32 | FC1: weights, bias, multiplier to a normalised Q10 |
//! | ... | | LSTM2's four directions, of 2 inputs |
//! | ... | i16 x 120, i32, i32 | FC2 times FC4: weights, bias, multiplier |

pub use super::file::{BlobError, FOGNET, FOGNET_VERSION, Normalisation, Topology};

use super::file::{Header, Reader, check_dense, check_rows, dense_len, header_len, layers_len};
use crate::model::seconds::{self, STEPS};
use crate::nn::{bilstm::Layer, dense::Dense};
use crate::units::Angle;

/// LSTM1 has this many units a direction (section III-C of the paper).
pub const HIDDEN1: usize = 90;
/// LSTM2 has as many units a direction as the window has steps: "N units" in the paper.
pub const HIDDEN2: usize = STEPS;
/// A step has this many features: those of [`crate::model::seconds`], and the gyro's increment.
pub const INPUTS: usize = seconds::FEATURES + 1;
/// LSTM1's input has this many columns: the features, and a zero that makes their number even.
pub const COLUMNS: usize = INPUTS + 1;
/// Fraction bits of the factor that turns FC2's sum into an angle.
pub const CORRECTION_SHIFT: u32 = 16;
pub const HEADER_LEN: usize = header_len(INPUTS) + 4 * STEPS + 8 + 8;
pub const TOPOLOGY: Topology = [FOGNET, STEPS as u16, INPUTS as u16, HIDDEN1 as u16, 2, 1];

#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Gyro {
    Dsp1760,
    Dsp3000,
    /// GyroNet, the paper's pseudo-FoG.
    PseudoFog,
}

impl Gyro {
    /// All sources, in the order of their numbers in a file, which begin at 1.
    pub const ALL: [Self; 3] = [Self::Dsp1760, Self::Dsp3000, Self::PseudoFog];
}

impl core::fmt::Display for Gyro {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Self::Dsp1760 => "DSP-1760",
            Self::Dsp3000 => "DSP-3000",
            Self::PseudoFog => "pseudo-FoG",
        })
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Training {
    pub gyro: Gyro,
    /// Serial number of the gyro that the network was trained for; 0 stands for any of that part.
    pub serial: u32,
    pub simulated: bool,
}

impl core::fmt::Display for Training {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        let simulated = if self.simulated { "simulated " } else { "" };
        write!(f, "{simulated}{}", self.gyro)?;
        if self.serial == 0 { Ok(()) } else { write!(f, " number {}", self.serial) }
    }
}

/// Gives access to a weight file that has passed all checks.
#[derive(Debug, Clone, Copy)]
pub struct FogBlob<'w> {
    pub provenance: &'w str,
    pub training: Training,
    pub normalisation: [Normalisation; INPUTS],
    /// Network inputs are clamped to +- this, Q10.
    pub input_clamp: i16,
    /// The gain that FC3, FC4 and all scales give an increment: correction over increment, Q31.
    pub gains: &'w [i32],
    /// The constant part of the correction: all biases of FC2, FC3 and FC4.
    pub offset: Angle,
    pub lstm1: [Layer<'w>; 2],
    pub fc1: Dense<'w>,
    pub lstm2: [Layer<'w>; 2],
    /// The weights of FC2 times FC4's factor for FC2.
    pub fc2: Dense<'w>,
}

pub const fn file_len(provenance: usize) -> usize {
    HEADER_LEN
        + provenance
        + layers_len(HIDDEN1, COLUMNS)
        + dense_len(2 * HIDDEN1)
        + layers_len(HIDDEN2, 2)
        + dense_len(2 * HIDDEN2)
        + 4
}

impl<'w> FogBlob<'w> {
    /// Checks everything about a weight file, then gives access to it in place.
    pub fn new_checked(bytes: &'w [u8]) -> Result<Self, BlobError> {
        let mut reader = Reader::new(bytes, file_len(0));
        let shape = |found| (found == TOPOLOGY).then_some(());
        let Header { shape: (), input_clamp, normalisation, provenance_len, .. } =
            Header::read(&mut reader, TOPOLOGY, shape, |(), provenance| file_len(provenance))?;
        let gains = reader.slice(STEPS)?;
        let (low, high) = (reader.i32()? as u32, reader.i32()?);
        let offset = Angle(i64::from(high) << 32 | i64::from(low));
        let [number, simulated] = [reader.u16()?, reader.u16()?];
        let gyro = usize::from(number).checked_sub(1).and_then(|place| Gyro::ALL.get(place));
        let training = Training {
            gyro: *gyro.ok_or(BlobError::Gyro(number))?,
            serial: reader.i32()? as u32,
            simulated: simulated != 0,
        };
        let provenance = reader.provenance(provenance_len)?;
        let (lstm1, fc1) = (reader.layers(HIDDEN1, COLUMNS)?, reader.dense(2 * HIDDEN1)?);
        let (lstm2, fc2) = (reader.layers(HIDDEN2, 2)?, reader.dense(2 * HIDDEN2)?);
        check_rows(&lstm1, input_clamp.into(), 0)?;
        check_rows(&lstm2, input_clamp.into(), 2)?;
        check_dense(&fc1)?;
        check_dense(&fc2)?;
        Ok(Self { provenance, training, normalisation, input_clamp, gains, offset, lstm1, fc1, lstm2, fc2 })
    }

    /// Returns the correction for a complete sum of [`FogBlob::fc2`], without the linear part.
    pub fn spread(&self, sum: i32) -> Angle {
        let product = i64::from(sum) * i64::from(self.fc2.multiplier) + (1 << (CORRECTION_SHIFT - 1));
        Angle(self.offset.0.saturating_add(product >> CORRECTION_SHIFT))
    }

    pub fn mean_gain(&self) -> i32 {
        let sum: i64 = self.gains.iter().map(|gain| i64::from(*gain)).sum();
        // A mean of int32s fits an int32.
        sum.div_euclid(STEPS as i64) as i32
    }
}
