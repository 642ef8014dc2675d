//! This module checks GyroNet's weight file before use, and reads it in place.
//!
//! The header of [`super::file`], then:
//!
//! | offset | type | field |
//! |---|---|---|
//! | 76 | P bytes | provenance, UTF-8 JSON |
//! | 76 + P | | four directions: layer 1 forward, backward, layer 2 forward, backward |
//! | ... | i16 x 2H, i32, i32 | gyro error: weights, bias, multiplier to a rate code |
//! | ... | i16 x 2H, i32, i32 | log2 of its scale: weights, bias, multiplier to Q16 |
//! | ... | u32 | [`Blob::scale_unit`] |

pub use super::file::{BlobError, CRC, GYRONET, MAGIC, Normalisation, Topology, VERSION};

use super::file::{Header, Reader, check_dense, check_rows, dense_len, header_len, layers_len};
use crate::model::window::{FEATURES, WINDOW};
use crate::nn::{bilstm::Layer, dense::Dense};

/// Units of GyroNet a direction (section III-B of the paper).
pub const HIDDEN: usize = 60;
/// Bytes before the provenance text.
pub const HEADER_LEN: usize = header_len(FEATURES);
/// The content that the header must have.
pub const TOPOLOGY: Topology = [GYRONET, WINDOW as u16, FEATURES as u16, HIDDEN as u16, 2];

/// A weight file that has passed all checks.
#[derive(Debug, Clone, Copy)]
pub struct Blob<'w> {
    /// The provenance of the weights: JSON.
    pub provenance: &'w str,
    /// One for each feature.
    pub normalisation: [Normalisation; FEATURES],
    /// Network inputs are clamped to +- this, Q10.
    pub input_clamp: i16,
    /// The two Bi-LSTM layers.
    pub layers: [Layer<'w>; 2],
    /// Row of the output layer that gives a step's gyro error, as a rate code.
    pub gyro_error: Dense<'w>,
    /// Row whose sum over the steps is log2 of the scale over [`Blob::scale_unit`], in Q16.
    pub log_scale: Dense<'w>,
    /// The scale whose log is zero, as a rate code.
    pub scale_unit: u32,
    /// The file's own checksum: the name of this set of weights.
    pub crc: u32,
    /// The bytes that it is of.
    pub content: &'w [u8],
}

/// Returns the number of bytes of a GyroNet file with `provenance` bytes of padded text.
#[must_use]
pub const fn file_len(provenance: usize) -> usize {
    HEADER_LEN + provenance + layers_len(HIDDEN, FEATURES) + 2 * dense_len(2 * HIDDEN) + 4 + 4
}

impl<'w> Blob<'w> {
    /// Checks everything about a weight file, then gives access to it in place.
    ///
    /// # Errors
    /// [`BlobError`], which names the first thing that is wrong.
    pub fn new_checked(bytes: &'w [u8]) -> Result<Self, BlobError> {
        let mut reader = Reader::new(bytes, file_len(0));
        let Header { input_clamp, normalisation, provenance_len, crc } =
            Header::read(&mut reader, TOPOLOGY, file_len)?;
        let provenance = reader.provenance(provenance_len)?;
        let layers = reader.layers(HIDDEN, FEATURES)?;
        let (gyro_error, log_scale) = (reader.dense(2 * HIDDEN)?, reader.dense(2 * HIDDEN)?);
        let scale_unit = reader.i32()? as u32;
        check_rows(&layers, input_clamp.into(), 0)?;
        check_dense(&gyro_error)?;
        check_dense(&log_scale)?;
        // The header has been read: the checksum is there.
        let content = bytes.get(..bytes.len().saturating_sub(4)).unwrap_or_default();
        Ok(Self {
            provenance,
            normalisation,
            input_clamp,
            layers,
            gyro_error,
            log_scale,
            scale_unit,
            crc,
            content,
        })
    }
}
