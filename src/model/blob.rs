//! Checks GyroNet's weight file before use and reads it in place, without a copy.
//!
//! A file holds a linear part, two layers of Bi-LSTMs, or both ([`Shape`]). It begins with the header of
//! `model::file`, followed by:
//!
//! | offset | type | field |
//! |---|---|---|
//! | 80 | P bytes | provenance, UTF-8 JSON |
//! | 80 + P | i32 x 60 x 10 | the linear part, if there is one: a row for each sample's output ([`Blob::linear`]) |
//! | ... | | four directions, if there are units: layer 1 forward, backward, layer 2 forward, backward |
//! | ... | i16 x 2H, i32, i32 | if there are units, gyro error: weights, bias, multiplier to a rate code |

pub use super::file::{BlobError, CRC, GYRONET, MAGIC, Normalisation, Topology, VERSION};

use super::file::{Header, Reader, check_dense, check_rows, dense_len, header_len, layers_len};
use crate::model::window::{FEATURES, WINDOW};
use crate::nn::{bilstm::Layer, dense::Dense, linear::Linear};

/// The paper's GyroNet has this many units a direction (section III-B); a file may have no more.
pub const HIDDEN: usize = 60;
/// The linear part has this many inputs: all features of a window, sample by sample, oldest first.
pub const LINEAR_INPUTS: usize = WINDOW * FEATURES;
pub const HEADER_LEN: usize = header_len(FEATURES);

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Shape {
    /// Units of the Bi-LSTMs a direction, up to [`HIDDEN`] in steps of 4; with 0 there are none.
    pub units: u16,
    pub linear: bool,
}

impl Shape {
    pub const PAPER: Self = Self { units: HIDDEN as u16, linear: false };
    pub const LARGEST: Self = Self { units: HIDDEN as u16, linear: true };

    /// Returns the topology that the file's header must state.
    pub const fn topology(self) -> Topology {
        let outputs = if self.linear { WINDOW as u16 } else { 0 };
        [GYRONET, WINDOW as u16, FEATURES as u16, self.units, 2, outputs]
    }

    /// Returns a window's largest cost on a Cortex-M4, modelled cycles (`cargo bench-target` prints some).
    pub const fn window_cycles(self) -> u32 {
        let units = self.units as u32;
        let layers = if units > 0 { 20_000 + 4_400 * units + 355 * units * units } else { 0 };
        layers + if self.linear { 5_000 } else { 0 }
    }

    /// Returns the number of bytes of a file with `provenance` bytes of padded text.
    pub const fn file_len(self, provenance: usize) -> usize {
        let linear = if self.linear { 4 * WINDOW * LINEAR_INPUTS } else { 0 };
        let units = self.units as usize;
        let network = if units > 0 { layers_len(units, FEATURES) + dense_len(2 * units) } else { 0 };
        HEADER_LEN + provenance + linear + network + 4
    }

    /// Reads a topology; `None` if its sizes are not supported or it has no part.
    fn read(found: Topology) -> Option<Self> {
        let [_, _, _, units, _, outputs] = found;
        let shape = Self { units, linear: outputs > 0 };
        let sized = units.is_multiple_of(4) && units <= Self::LARGEST.units && (units > 0 || shape.linear);
        (sized && shape.topology() == found).then_some(shape)
    }
}

/// Gives access to a weight file that has passed all checks.
#[derive(Debug, Clone, Copy)]
pub struct Blob<'w> {
    pub provenance: &'w str,
    pub shape: Shape,
    pub normalisation: [Normalisation; FEATURES],
    /// Inputs of the Bi-LSTMs are clamped to +- this, Q10.
    pub input_clamp: i16,
    /// The part of the gyro error that is linear in the features: from their codes to rate codes.
    pub linear: Option<Linear<'w>>,
    pub layers: Option<[Layer<'w>; 2]>,
    /// Row of the output layer for a step's gyro error, as a rate code; empty without layers.
    pub gyro_error: Dense<'w>,
    /// The file's own checksum, which identifies this set of weights.
    pub crc: u32,
    pub content: &'w [u8],
}

/// Refuses a linear part that answers a constant input by more than its weights are rounded.
fn differential(linear: Linear<'_>) -> Result<Linear<'_>, BlobError> {
    for (output, row) in linear.rows().enumerate() {
        for input in 0..FEATURES {
            let weights = row.iter().skip(input).step_by(FEATURES);
            if weights.map(|weight| i64::from(*weight)).sum::<i64>().unsigned_abs() > WINDOW as u64 {
                return Err(BlobError::Constant { output: output as u16, input: input as u16 });
            }
        }
    }
    Ok(linear)
}

impl<'w> Blob<'w> {
    /// Checks everything about a weight file, then gives access to it in place.
    pub fn new_checked(bytes: &'w [u8]) -> Result<Self, BlobError> {
        let smallest = Shape { units: 4, linear: false };
        let mut reader = Reader::new(bytes, smallest.file_len(0));
        let (largest, file_len) = (Shape::LARGEST.topology(), |shape: &Shape, len| shape.file_len(len));
        let Header { shape, input_clamp, normalisation, provenance_len, crc } =
            Header::read(&mut reader, largest, Shape::read, file_len)?;
        let provenance = reader.provenance(provenance_len)?;
        let units = usize::from(shape.units);
        let linear = match shape.linear {
            true => Some(differential(reader.linear(WINDOW, LINEAR_INPUTS)?)?),
            false => None,
        };
        let (mut layers, mut gyro_error) = (None, Dense::EMPTY);
        if units > 0 {
            let layers = layers.insert(reader.layers(units, FEATURES)?);
            gyro_error = reader.dense(2 * units)?;
            check_rows(layers, input_clamp.into(), 0)?;
            check_dense(&gyro_error)?;
        }
        // The header has been checked, so the checksum is present.
        let content = bytes.get(..bytes.len().saturating_sub(4)).unwrap_or_default();
        Ok(Self { provenance, shape, normalisation, input_clamp, linear, layers, gyro_error, crc, content })
    }
}
