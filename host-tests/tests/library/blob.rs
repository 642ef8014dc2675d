//! The weight file: whatever is wrong with one, it is refused with the right reason.

use gyronet::model::blob::{BlobError, CRC, HEADER_LEN, HIDDEN, TOPOLOGY, file_len};
use gyronet::model::window::{FEATURES, WINDOW};
use gyronet::model::{Blob, fognet_blob, weights};
use gyronet::nn::Aligned;
use gyronet::nn::lstm::DirectionWeights;
use gyronet_host_tests::noise::Noise;

/// A copy of the weights that come with the library, on a word boundary, with room behind.
struct File {
    memory: Box<Aligned<[u8; 160_000]>>,
    len: usize,
}

impl File {
    fn new() -> Self {
        let mut file = Self { memory: Box::new(Aligned([0; _])), len: weights::DEFAULT.0.len() };
        file.bytes_mut().copy_from_slice(&weights::DEFAULT.0);
        file
    }

    /// Returns the file with these bytes at an offset, and a checksum that fits.
    fn with(at: usize, bytes: &[u8]) -> Self {
        let mut file = Self::new();
        file.bytes_mut()[at..at + bytes.len()].copy_from_slice(bytes);
        let (content, stored) = file.bytes_mut().split_last_chunk_mut().expect("longer than its checksum");
        *stored = CRC.checksum(content).to_le_bytes();
        file
    }

    fn bytes(&self) -> &[u8] {
        &self.memory.0[..self.len]
    }

    fn bytes_mut(&mut self) -> &mut [u8] {
        &mut self.memory.0[..self.len]
    }

    fn error(&self) -> BlobError {
        Blob::new_checked(self.bytes()).expect_err("something is wrong with it")
    }
}

fn provenance_len() -> usize {
    weights::DEFAULT.0.len() - file_len(0)
}

/// Offset of the first record of a layer's direction (0 forward, 1 backward).
fn direction_at(layer: usize, direction: usize) -> usize {
    let len = |inputs| {
        4 * (DirectionWeights::input_words(HIDDEN, inputs) + DirectionWeights::recurrent_words(HIDDEN))
    };
    let (first, second) = (len(FEATURES), len(2 * HIDDEN));
    HEADER_LEN + provenance_len() + [0, 2 * first][layer] + direction * [first, second][layer]
}

#[test]
fn the_default_is_good_and_says_where_it_comes_from() {
    let file = File::new();
    let blob = Blob::new_checked(file.bytes()).expect("it comes with the library");
    assert!(blob.provenance.starts_with('{') && blob.provenance.ends_with('}'), "{}", blob.provenance);
    assert!(blob.provenance.contains("checkpoint_sha256"));
    assert_eq!(blob.crc.to_le_bytes(), file.bytes()[file.len - 4..]);
    assert_eq!(blob.layers[0].forward.units(), HIDDEN);
    assert_eq!(blob.layers[1].backward.inputs(), 2 * HIDDEN);
    assert!(file.len <= 126 * 1024, "GyroNet's weights must not pass 126 KB: {} bytes", file.len);
}

#[test]
fn each_header_field_is_checked() {
    let len = weights::DEFAULT.0.len();
    let topology = |found| BlobError::Topology { found, expected: TOPOLOGY };
    let length = |expected, found| BlobError::Length { expected, found };
    let (window, features, hidden) = (WINDOW as u16, FEATURES as u16, HIDDEN as u16);
    let p = provenance_len();
    for (at, bytes, error) in [
        (0, &b"GYRX"[..], BlobError::Magic(*b"GYRX")),
        (4, &[1, 0], BlobError::Version(1)),
        (4, &[3, 0], BlobError::Version(3)),
        (4, &[0, 1], BlobError::Version(256)),
        (6, &[2, 0], topology([2, window, features, hidden, 2])),
        (8, &(len as u32 + 4).to_le_bytes(), length(len + 4, len)),
        (8, &[0xFF; 4], length(u32::MAX as usize, len)),
        (12, &[60, 0], topology([1, 60, features, hidden, 2])),
        (14, &[9, 0], topology([1, window, 9, hidden, 2])),
        (16, &[90, 0], topology([1, window, features, 90, 2])),
        (18, &[1, 0], topology([1, window, features, hidden, 1])),
        (20, &(p as u32 + 4).to_le_bytes(), length(file_len(p + 4), len)),
        (20, &(p as u32 + 1).to_le_bytes(), length(file_len(0), len)),
        (20, &0xFFFF_FFFCu32.to_le_bytes(), length(file_len(0), len)),
        (24, &0i32.to_le_bytes(), BlobError::Scale),
        (24, &(-1i32).to_le_bytes(), BlobError::Scale),
        (24, &32_768i32.to_le_bytes(), BlobError::Scale),
        (HEADER_LEN, &[0xFF], BlobError::Provenance),
    ] {
        assert_eq!(File::with(at, bytes).error(), error, "{bytes:02x?} at {at}");
    }
    assert_eq!(
        file_len(0),
        HEADER_LEN
            + (direction_at(1, 1) - direction_at(1, 0)) * 2
            + 2 * (direction_at(0, 1) - direction_at(0, 0))
            + 2 * (4 * HIDDEN + 8)
            + 8
    );
}

#[test]
fn every_other_length_is_refused() {
    let file = File::new();
    for len in 0..file.len {
        let error = Blob::new_checked(&file.bytes()[..len]).expect_err("it is cut off");
        assert!(
            matches!(error, BlobError::Length { expected, found } if found == len && expected > len),
            "{error} at {len}"
        );
    }
    for more in [1, 2, 3, 4, 64, 1_000] {
        let error = Blob::new_checked(&file.memory.0[..file.len + more]).expect_err("it is too long");
        assert_eq!(error, BlobError::Length { expected: file.len, found: file.len + more });
    }
}

#[test]
fn a_file_off_the_word_boundary_is_refused() {
    for offset in 1..4 {
        let mut file = File::new();
        let len = file.len;
        file.memory.0.copy_within(..len, offset);
        assert_eq!(
            Blob::new_checked(&file.memory.0[offset..offset + len]).err(),
            Some(BlobError::Misaligned)
        );
    }
}

#[test]
fn rows_that_could_overflow_are_refused() {
    for (layer, direction) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
        let inputs = [FEATURES, 2 * HIDDEN][layer as usize];
        for unit in [0, 17, HIDDEN - 1] {
            let error = BlobError::RowBound { layer, direction, unit: unit as u16 };
            let record = direction_at(layer.into(), direction.into()) + unit * 4 * (4 + inputs);
            // Bias of row i; then of row f, in the upper bytes of the packed word.
            assert_eq!(File::with(record, &i32::MAX.to_le_bytes()).error(), error);
            assert_eq!(File::with(record + 4, &[0, 0, 0, 0x80]).error(), error);
            // All input weights of layer 2 at 127: 120 * 127 * 1024 is more than 2^23.
            if layer == 1 {
                assert_eq!(File::with(record + 16, &[0x7F; 4 * 2 * HIDDEN]).error(), error);
            }
        }
    }
}

#[test]
fn an_output_that_could_overflow_is_refused() {
    let unit = file_len(provenance_len()) - 8;
    for row in [unit - 4 * HIDDEN - 8, unit - 2 * (4 * HIDDEN + 8)] {
        assert_eq!(File::with(row + 4 * HIDDEN, &i32::MAX.to_le_bytes()).error(), BlobError::Scale);
        assert_eq!(File::with(row, &[0xFF, 0x7F].repeat(2 * HIDDEN)).error(), BlobError::Scale);
    }
}

#[test]
fn every_flipped_bit_is_noticed() {
    let mut file = File::new();
    let mut noise = Noise::new(10);
    let bits = 8 * file.len as i64;
    let elsewhere: Vec<usize> = (0..2_000).map(|_| noise.int(1_600, bits - 1) as usize).collect();
    for bit in (0..1_600).chain(elsewhere) {
        file.bytes_mut()[bit / 8] ^= 1 << (bit % 8);
        let error = file.error();
        let expected = match bit / 8 {
            0..4 => matches!(error, BlobError::Magic(_)),
            4..6 => matches!(error, BlobError::Version(_)),
            8..12 | 20..24 => matches!(error, BlobError::Length { .. }),
            6..20 => matches!(error, BlobError::Topology { .. }),
            _ => matches!(error, BlobError::Crc { computed, stored } if computed != stored),
        };
        assert!(expected, "bit {bit}: {error}");
        file.bytes_mut()[bit / 8] ^= 1 << (bit % 8);
    }
    assert!(Blob::new_checked(file.bytes()).is_ok());
}

#[test]
fn refusals_say_why() {
    for (error, text) in [
        (BlobError::Magic(*b"ELF!"), "this is none, it begins with [45, 4c, 46, 21], not [47, 59, 52, 4e]"),
        (BlobError::Version(7), "format version 7, this reads 2"),
        (BlobError::Length { expected: 10, found: 9 }, "9 bytes, should be 10"),
        (BlobError::Misaligned, "not on a 4-byte boundary"),
        (BlobError::Crc { computed: 1, stored: 0xABCD }, "checksum is 00000001, the file says 0000abcd"),
        (BlobError::Provenance, "provenance is not UTF-8"),
        (BlobError::Scale, "input clamp or output scale out of range"),
        (
            BlobError::RowBound { layer: 1, direction: 0, unit: 59 },
            "layer 1, direction 0, unit 59 could overflow its accumulator",
        ),
        (
            BlobError::Topology { found: fognet_blob::TOPOLOGY, expected: TOPOLOGY },
            "network 2 with window 60, 9 inputs, 90 units, 2 layers is not GyroNet (1: 10, 6, 60, 2)",
        ),
    ] {
        assert_eq!(error.to_string(), format!("weight file: {text}"));
    }
}
