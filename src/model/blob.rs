//! The weight file: one network, ready for the kernels, checked before use.
//!
//! Little-endian; every field on a 4-byte boundary.
//!
//! | offset | type | field |
//! |---|---|---|
//! | 0 | 4 bytes | magic `GYRN` |
//! | 4 | u16 | format version, 2 |
//! | 6 | u16 | network, 1 = GyroNet |
//! | 8 | u32 | length of the whole file, checksum included |
//! | 12 | u16 x 4 | window, inputs, hidden units a direction, layers |
//! | 20 | u32 | length P of the provenance text, a multiple of 4 (padded with spaces) |
//! | 24 | i32 | input clamp L, in normalised Q10 |
//! | 28 | (i32, i32) x inputs | offset and multiplier of each input, see [`Normalisation`] |
//! | 76 | P bytes | provenance, UTF-8 JSON |
//! | 76 + P | | four directions: layer 1 forward, backward, layer 2 forward, backward |
//! | ... | i16 x 2H, i32, i32 | gyro error: weights, bias, multiplier to a rate code |
//! | ... | i16 x 2H, i32, i32 | log2 of its scale: weights, bias, multiplier to Q16 |
//! | ... | u32 | [`Blob::scale_unit`] |
//! | end - 4 | u32 | CRC-32 (ISO-HDLC, as in zip and Ethernet) of everything before it |
//!
//! A direction is its input records, then its recurrent records, as [`crate::nn::lstm`] lays
//! them out.

use crate::nn::lstm::{Direction, ROW_LIMIT, row_bound};
use crate::nn::{HIDDEN_MAX, bilstm::Layer, dense::Dense};
use crate::window::{FEATURES, WINDOW};
use serde::{Deserialize, Serialize};

/// First bytes of a weight file.
pub const MAGIC: [u8; 4] = *b"GYRN";
/// The format version that this code reads.
pub const VERSION: u16 = 2;
/// Network number of GyroNet.
pub const GYRONET: u16 = 1;
/// Units of GyroNet a direction (section III-B of the paper).
pub const HIDDEN: usize = 60;
/// Bytes before the provenance text.
pub const HEADER_LEN: usize = 28 + 8 * FEATURES;
/// CRC-32 as in zip and Ethernet.
pub static CRC: crc::Crc<u32> = crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC);

#[cfg(target_endian = "big")]
compile_error!("weights are read in place as little-endian words");

/// Why a weight file is refused.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum BlobError {
    /// Does not begin with [`MAGIC`].
    Magic([u8; 4]),
    /// A format version that this code does not read.
    Version(u16),
    /// Not the network that was asked for, or not its shape.
    Topology {
        /// Network number, window, inputs, hidden units, layers as found.
        found: [u16; 5],
    },
    /// Shorter or longer than its header and shape say.
    Length {
        /// Bytes there should be.
        expected: usize,
        /// Bytes there are.
        found: usize,
    },
    /// The bytes do not begin on a 4-byte boundary.
    Misaligned,
    /// The checksum does not fit the content.
    Crc {
        /// Computed over the content.
        computed: u32,
        /// Stored at the end.
        stored: u32,
    },
    /// The provenance is not UTF-8.
    Provenance,
    /// The input clamp is not within 1 to 32767, or an output could overflow.
    Scale,
    /// A gate row could overflow its accumulator.
    RowBound {
        /// Layer, 0 or 1.
        layer: u8,
        /// Direction, 0 forward, 1 backward.
        direction: u8,
        /// Unit.
        unit: u16,
    },
}

impl core::fmt::Display for BlobError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match *self {
            Self::Magic(found) => write!(f, "weight file: magic is {found:02x?}, not {MAGIC:02x?}"),
            Self::Version(found) => write!(f, "weight file: format version {found}, this reads {VERSION}"),
            Self::Topology { found: [network, window, inputs, hidden, layers] } => write!(
                f,
                "weight file: network {network} with window {window}, {inputs} inputs, {hidden} units, \
                 {layers} layers is not GyroNet (1: {WINDOW}, {FEATURES}, {HIDDEN}, 2)"
            ),
            Self::Length { expected, found } => {
                write!(f, "weight file: {found} bytes, should be {expected}")
            }
            Self::Misaligned => f.write_str("weight file: not on a 4-byte boundary"),
            Self::Crc { computed, stored } => {
                write!(f, "weight file: checksum is {computed:08x}, the file says {stored:08x}")
            }
            Self::Provenance => f.write_str("weight file: provenance is not UTF-8"),
            Self::Scale => f.write_str("weight file: input clamp or output scale out of range"),
            Self::RowBound { layer, direction, unit } => write!(
                f,
                "weight file: layer {layer}, direction {direction}, unit {unit} could overflow its accumulator"
            ),
        }
    }
}

impl core::error::Error for BlobError {}

/// How a feature becomes a network input: `(code - offset) * multiplier / 2^31`, rounded.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Normalisation {
    /// In the feature's code.
    pub offset: i32,
    /// Normalised Q10 per code, times 2^31.
    pub multiplier: i32,
}

/// A weight file that has passed all checks.
#[derive(Debug, Clone, Copy)]
pub struct Blob<'w> {
    /// Where the weights come from: JSON.
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
}

/// Bytes of a GyroNet file with `provenance` bytes of padded text.
#[must_use]
pub const fn file_len(provenance: usize) -> usize {
    HEADER_LEN
        + provenance
        + 2 * (direction_len(FEATURES) + direction_len(2 * HIDDEN))
        + 2 * DENSE_LEN
        + 4
        + 4
}

/// Bytes of one row of the output layer.
const DENSE_LEN: usize = 2 * (2 * HIDDEN) + 8;

const fn direction_len(inputs: usize) -> usize {
    4 * (Direction::input_words(HIDDEN, inputs) + Direction::recurrent_words(HIDDEN))
}

impl<'w> Blob<'w> {
    /// Checks everything about a weight file, then gives access to it in place.
    ///
    /// # Errors
    /// [`BlobError`], which names the first thing that is wrong.
    pub fn new_checked(bytes: &'w [u8]) -> Result<Self, BlobError> {
        let mut reader = Reader { bytes, len: bytes.len() };
        let magic: [u8; 4] = *reader.array()?;
        if magic != MAGIC {
            return Err(BlobError::Magic(magic));
        }
        let version = reader.u16()?;
        if version != VERSION {
            return Err(BlobError::Version(version));
        }
        let network = reader.u16()?;
        let length = reader.i32()? as u32 as usize;
        if length != bytes.len() {
            return Err(BlobError::Length { expected: length, found: bytes.len() });
        }
        let found = [network, reader.u16()?, reader.u16()?, reader.u16()?, reader.u16()?];
        if found != [GYRONET, WINDOW as u16, FEATURES as u16, HIDDEN as u16, 2] {
            return Err(BlobError::Topology { found });
        }
        let provenance_len = reader.i32()? as u32 as usize;
        let fits = provenance_len.is_multiple_of(4) && provenance_len < length;
        if !fits || file_len(provenance_len) != length {
            let expected = if fits { file_len(provenance_len) } else { file_len(0) };
            return Err(BlobError::Length { expected, found: length });
        }
        let (content, stored) = bytes.split_at(length - 4);
        let stored = stored.iter().rev().fold(0, |crc, byte| crc << 8 | u32::from(*byte));
        let computed = CRC.checksum(content);
        if computed != stored {
            return Err(BlobError::Crc { computed, stored });
        }
        Self::read(&mut reader, provenance_len, stored)
    }

    /// Reads what the header has announced.
    fn read(reader: &mut Reader<'w>, provenance_len: usize, crc: u32) -> Result<Self, BlobError> {
        let input_clamp =
            i16::try_from(reader.i32()?).ok().filter(|clamp| *clamp > 0).ok_or(BlobError::Scale)?;
        let mut normalisation = [Normalisation { offset: 0, multiplier: 0 }; FEATURES];
        for n in &mut normalisation {
            *n = Normalisation { offset: reader.i32()?, multiplier: reader.i32()? };
        }
        let provenance =
            core::str::from_utf8(reader.take(provenance_len)?).map_err(|_| BlobError::Provenance)?;
        let mut layer =
            |inputs| Ok(Layer { forward: reader.direction(inputs)?, backward: reader.direction(inputs)? });
        let layers = [layer(FEATURES)?, layer(2 * HIDDEN)?];
        let (gyro_error, log_scale) = (reader.dense()?, reader.dense()?);
        let scale_unit = reader.i32()? as u32;
        let blob = Self {
            provenance: provenance.trim_end_matches(' '),
            normalisation,
            input_clamp,
            layers,
            gyro_error,
            log_scale,
            scale_unit,
            crc,
        };
        blob.check_bounds()?;
        Ok(blob)
    }

    /// Proves that no input can overflow an accumulator.
    fn check_bounds(&self) -> Result<(), BlobError> {
        for (l, (layer, input_max)) in
            self.layers.iter().zip([i32::from(self.input_clamp), HIDDEN_MAX]).enumerate()
        {
            for (d, direction) in [&layer.forward, &layer.backward].into_iter().enumerate() {
                for unit in 0..HIDDEN {
                    let bound = row_bound(direction, unit, input_max);
                    if bound.iter().zip(ROW_LIMIT).any(|(bound, limit)| *bound >= limit) {
                        return Err(BlobError::RowBound {
                            layer: l as u8,
                            direction: d as u8,
                            unit: unit as u16,
                        });
                    }
                }
            }
        }
        for row in [&self.gyro_error, &self.log_scale] {
            let sum: i64 = row.weights.iter().map(|w| i64::from(*w).abs() * i64::from(HIDDEN_MAX)).sum();
            if sum + i64::from(row.bias).abs() >= 1 << 31 {
                return Err(BlobError::Scale);
            }
        }
        Ok(())
    }
}

/// Takes typed slices off the front of the file.
struct Reader<'w> {
    bytes: &'w [u8],
    len: usize,
}

impl<'w> Reader<'w> {
    fn take(&mut self, len: usize) -> Result<&'w [u8], BlobError> {
        let consumed = self.len - self.bytes.len();
        let short = BlobError::Length { expected: (consumed + len).max(file_len(0)), found: self.len };
        let (head, tail) = self.bytes.split_at_checked(len).ok_or(short)?;
        self.bytes = tail;
        Ok(head)
    }

    fn array<const N: usize>(&mut self) -> Result<&'w [u8; N], BlobError> {
        self.take(N)?.try_into().map_err(|_| BlobError::Misaligned)
    }

    fn u16(&mut self) -> Result<u16, BlobError> {
        self.array().map(|bytes| u16::from_le_bytes(*bytes))
    }

    fn i32(&mut self) -> Result<i32, BlobError> {
        self.array().map(|bytes| i32::from_le_bytes(*bytes))
    }

    /// `len` elements of T, in place.
    fn slice<T: bytemuck::AnyBitPattern>(&mut self, len: usize) -> Result<&'w [T], BlobError> {
        let bytes = self.take(len * size_of::<T>())?;
        if !bytes.as_ptr().addr().is_multiple_of(4) {
            return Err(BlobError::Misaligned);
        }
        bytemuck::try_cast_slice(bytes).map_err(|_| BlobError::Misaligned)
    }

    fn dense(&mut self) -> Result<Dense<'w>, BlobError> {
        Ok(Dense { weights: self.slice(2 * HIDDEN)?, bias: self.i32()?, multiplier: self.i32()? })
    }

    fn direction(&mut self, inputs: usize) -> Result<Direction<'w>, BlobError> {
        let input = self.slice(Direction::input_words(HIDDEN, inputs))?;
        let recurrent = self.slice(Direction::recurrent_words(HIDDEN))?;
        Direction::new(HIDDEN, inputs, input, recurrent).ok_or(BlobError::Misaligned)
    }
}
