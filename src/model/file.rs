//! The weight files of all networks share a header, its checks, and typed access in place, without a copy.
//!
//! All numbers are little-endian, and every field lies on a 4-byte boundary.
//!
//! | offset | type | field |
//! |---|---|---|
//! | 0 | 4 bytes | magic `GYRN` |
//! | 4 | u16 | format version: 5 for GyroNet, 4 for FoGNet |
//! | 6 | u16 | network, 1 = GyroNet, 2 = FoGNet |
//! | 8 | u32 | length of the whole file, checksum included |
//! | 12 | u16 x 4 | window, inputs, hidden units a direction, layers |
//! | 20 | u32 | outputs of the linear part, 0 = no linear part |
//! | 24 | u32 | length P of the provenance text, a multiple of 4 (padded with spaces) |
//! | 28 | i32 | input clamp L, in normalised Q10 |
//! | 32 | (i32, i32) x inputs | offset and multiplier of each input, see [`Normalisation`] |
//! | | | fields of the network: [`super::blob`], [`super::fognet_blob`] |
//! | end - 4 | u32 | CRC-32 (ISO-HDLC, as in zip and Ethernet) of everything before it |
//!
//! A direction has its input records, then its recurrent ones ([`crate::nn::lstm`]); an output row int16 weights,
//! bias, multiplier.

use crate::nn::lstm::{DirectionWeights, ROW_LIMIT, row_bound};
use crate::nn::{HIDDEN_MAX, bilstm::Layer, dense::Dense, linear::Linear};

/// A weight file begins with these bytes.
pub const MAGIC: [u8; 4] = *b"GYRN";
/// The format version of GyroNet's files that this code reads.
pub const VERSION: u16 = 5;
/// The format version of FoGNet's files that this code reads.
pub const FOGNET_VERSION: u16 = 4;
/// This number in the header stands for GyroNet.
pub const GYRONET: u16 = 1;
/// This number in the header stands for FoGNet.
pub const FOGNET: u16 = 2;
/// The lookup table of [`CRC`]: 1 KiB on a microcontroller, the faster 16 KiB on a host.
#[cfg(target_os = "none")]
pub type CrcTable = crc::Table<1>;
#[cfg(not(target_os = "none"))]
pub type CrcTable = crc::Table<16>;
/// Computes CRC-32 as in zip and Ethernet.
pub static CRC: crc::Crc<u32, CrcTable> = crc::Crc::<u32, CrcTable>::new(&crc::CRC_32_ISO_HDLC);

#[cfg(target_endian = "big")]
compile_error!("weights are read in place as little-endian words");

/// The shape that a file states: network, window, inputs, hidden units, layers, outputs of the linear part.
pub type Topology = [u16; 6];

#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error, serde::Serialize, serde::Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[allow(missing_docs, reason = "its messages say it")]
pub enum BlobError {
    #[error("weight file: it begins with {0:02x?}, should be {MAGIC:02x?}")]
    Magic([u8; 4]),
    #[error("weight file: format version {found}, should be {expected}")]
    Version { found: u16, expected: u16 },
    #[error(
        "weight file: network {} with window {}, {} inputs, {} units, {} layers, {} linear outputs is not \
         {} ({}: {}, {}, {}, {}, {}{})",
        .found[0], .found[1], .found[2], .found[3], .found[4], .found[5], network_name(.expected),
        .expected[0], .expected[1], .expected[2], .expected[3], .expected[4], .expected[5], smaller(.expected)
    )]
    Topology {
        found: Topology,
        /// The expected shape; for GyroNet, the largest one.
        expected: Topology,
    },
    #[error("weight file: {found} bytes, should be {expected}")]
    Length { expected: usize, found: usize },
    #[error("weight file: not on a 4-byte boundary")]
    Misaligned,
    #[error("weight file: checksum is {computed:08x}, the file has {stored:08x}")]
    Crc { computed: u32, stored: u32 },
    #[error("weight file: provenance is not UTF-8")]
    Provenance,
    #[error("weight file: input clamp or output row out of range")]
    Scale,
    #[error("weight file: layer {layer}, direction {direction}, unit {unit} could overflow its accumulator")]
    RowBound {
        /// Layer, 0 or 1; FoGNet's LSTM2 has layers 2 and 3.
        layer: u8,
        direction: u8,
        unit: u16,
    },
    #[error("weight file: trained for gyro {0}, which is not supported")]
    Gyro(u16),
    #[error("weight file: output {output} of the linear part could overflow its accumulator")]
    LinearBound { output: u16 },
    #[error(
        "weight file: output {output} of the linear part answers a constant input {input}; mounting and gain belong to the \
         unit, and `calibrate` finds them"
    )]
    Constant { output: u16, input: u16 },
    #[error("weight file: {found} units a direction, memory holds {largest}")]
    Units { found: u16, largest: u16 },
}

fn network_name([network, ..]: &Topology) -> &'static str {
    if *network == FOGNET { "FoGNet" } else { "GyroNet" }
}

/// Returns a clause for the error text that names the smaller sizes a network may have.
fn smaller([network, ..]: &Topology) -> &'static str {
    if *network == FOGNET { "" } else { ", or fewer units in steps of 4, or no linear outputs" }
}

/// Scales a feature to a network input: `(code - offset) * multiplier / 2^31`, rounded.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Normalisation {
    /// The offset in the feature's code.
    pub offset: i32,
    /// Normalised Q10 per code, times 2^31.
    pub multiplier: i32,
}

pub(super) const fn header_len(inputs: usize) -> usize {
    32 + 8 * inputs
}

pub(super) const fn direction_len(units: usize, inputs: usize) -> usize {
    4 * (DirectionWeights::input_words(units, inputs) + DirectionWeights::recurrent_words(units))
}

pub(super) const fn layers_len(units: usize, inputs: usize) -> usize {
    2 * (direction_len(units, inputs) + direction_len(units, 2 * units))
}

pub(super) const fn dense_len(columns: usize) -> usize {
    2 * columns + 8
}

pub(super) struct Header<const INPUTS: usize, S> {
    pub shape: S,
    pub input_clamp: i16,
    pub normalisation: [Normalisation; INPUTS],
    pub provenance_len: usize,
    pub crc: u32,
}

impl<const INPUTS: usize, S> Header<INPUTS, S> {
    /// Checks header, length and checksum; `shape` reads the topology, or the error reports `expected`.
    pub fn read(
        reader: &mut Reader<'_>,
        expected: Topology,
        shape: fn(Topology) -> Option<S>,
        file_len: fn(&S, usize) -> usize,
    ) -> Result<Self, BlobError> {
        let bytes = reader.bytes;
        let magic: [u8; 4] = *reader.array()?;
        if magic != MAGIC {
            return Err(BlobError::Magic(magic));
        }
        let [version, network] = [reader.u16()?, reader.u16()?];
        let known = if network == FOGNET { FOGNET_VERSION } else { VERSION };
        if version != known {
            return Err(BlobError::Version { found: version, expected: known });
        }
        let length = reader.i32()? as u32 as usize;
        if length != bytes.len() {
            return Err(BlobError::Length { expected: length, found: bytes.len() });
        }
        let [window, inputs, units, layers] = [reader.u16()?, reader.u16()?, reader.u16()?, reader.u16()?];
        // The conversion saturates: no shape has u16::MAX outputs.
        let linear = u16::try_from(reader.i32()? as u32).unwrap_or(u16::MAX);
        let found = [network, window, inputs, units, layers, linear];
        let shape = shape(found).ok_or(BlobError::Topology { found, expected })?;
        let provenance_len = reader.i32()? as u32 as usize;
        let fits = provenance_len.is_multiple_of(4) && provenance_len < length;
        let expected = file_len(&shape, if fits { provenance_len } else { 0 });
        if !fits || expected != length {
            return Err(BlobError::Length { expected, found: length });
        }
        let (content, stored) = bytes.split_at(length - 4);
        let stored = stored.iter().rev().fold(0, |crc, byte| crc << 8 | u32::from(*byte));
        let computed = CRC.checksum(content);
        if computed != stored {
            return Err(BlobError::Crc { computed, stored });
        }
        let input_clamp =
            i16::try_from(reader.i32()?).ok().filter(|clamp| *clamp > 0).ok_or(BlobError::Scale)?;
        let mut normalisation = [Normalisation { offset: 0, multiplier: 0 }; INPUTS];
        for n in &mut normalisation {
            *n = Normalisation { offset: reader.i32()?, multiplier: reader.i32()? };
        }
        Ok(Self { shape, input_clamp, normalisation, provenance_len, crc: stored })
    }
}

/// Checks that no input up to `input_max` can overflow a gate's accumulator.
pub(super) fn check_rows(layers: &[Layer<'_>; 2], input_max: i32, first: u8) -> Result<(), BlobError> {
    for ((l, layer), input_max) in (first..).zip(layers).zip([input_max, HIDDEN_MAX]) {
        for (direction, weights) in (0..).zip([&layer.forward, &layer.backward]) {
            for unit in 0..weights.units() {
                let bound = row_bound(weights, unit, input_max);
                if bound.iter().zip(ROW_LIMIT).any(|(bound, limit)| *bound >= limit) {
                    return Err(BlobError::RowBound { layer: l, direction, unit: unit as u16 });
                }
            }
        }
    }
    Ok(())
}

/// Checks that no hidden state can overflow the sum of an output's row.
pub(super) fn check_dense(row: &Dense<'_>) -> Result<(), BlobError> {
    let sum: i64 = row.weights.iter().map(|w| i64::from(*w).abs() * i64::from(HIDDEN_MAX)).sum();
    if sum + i64::from(row.bias).abs() >= 1 << 31 { Err(BlobError::Scale) } else { Ok(()) }
}

pub(super) struct Reader<'w> {
    bytes: &'w [u8],
    len: usize,
    /// Bytes of the shortest file of the network.
    shortest: usize,
}

impl<'w> Reader<'w> {
    pub fn new(bytes: &'w [u8], shortest: usize) -> Self {
        Self { bytes, len: bytes.len(), shortest }
    }

    fn take(&mut self, len: usize) -> Result<&'w [u8], BlobError> {
        let consumed = self.len - self.bytes.len();
        let short = BlobError::Length { expected: (consumed + len).max(self.shortest), found: self.len };
        let (head, tail) = self.bytes.split_at_checked(len).ok_or(short)?;
        self.bytes = tail;
        Ok(head)
    }

    fn array<const N: usize>(&mut self) -> Result<&'w [u8; N], BlobError> {
        self.take(N)?.try_into().map_err(|_| BlobError::Misaligned)
    }

    pub fn u16(&mut self) -> Result<u16, BlobError> {
        self.array().map(|bytes| u16::from_le_bytes(*bytes))
    }

    pub fn i32(&mut self) -> Result<i32, BlobError> {
        self.array().map(|bytes| i32::from_le_bytes(*bytes))
    }

    pub fn slice<T: bytemuck::AnyBitPattern>(&mut self, len: usize) -> Result<&'w [T], BlobError> {
        let bytes = self.take(len * size_of::<T>())?;
        if !bytes.as_ptr().addr().is_multiple_of(4) {
            return Err(BlobError::Misaligned);
        }
        bytemuck::try_cast_slice(bytes).map_err(|_| BlobError::Misaligned)
    }

    pub fn provenance(&mut self, len: usize) -> Result<&'w str, BlobError> {
        let text = core::str::from_utf8(self.take(len)?).map_err(|_| BlobError::Provenance)?;
        Ok(text.trim_end_matches(' '))
    }

    pub fn layers(&mut self, units: usize, inputs: usize) -> Result<[Layer<'w>; 2], BlobError> {
        let mut layer = |inputs| {
            Ok(Layer { forward: self.direction(units, inputs)?, backward: self.direction(units, inputs)? })
        };
        Ok([layer(inputs)?, layer(2 * units)?])
    }

    fn direction(&mut self, units: usize, inputs: usize) -> Result<DirectionWeights<'w>, BlobError> {
        let input = self.slice(DirectionWeights::input_words(units, inputs))?;
        let recurrent = self.slice(DirectionWeights::recurrent_words(units))?;
        DirectionWeights::new(units, inputs, input, recurrent).ok_or(BlobError::Misaligned)
    }

    pub fn linear(&mut self, outputs: usize, inputs: usize) -> Result<Linear<'w>, BlobError> {
        let overflow = |output| BlobError::LinearBound { output: output as u16 };
        Linear::new(inputs, self.slice(outputs * inputs)?).map_err(overflow)
    }

    pub fn dense(&mut self, columns: usize) -> Result<Dense<'w>, BlobError> {
        Ok(Dense { weights: self.slice(columns)?, bias: self.i32()?, multiplier: self.i32()? })
    }
}
