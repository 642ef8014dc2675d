//! The weight file: whatever is wrong with one, it is refused with the right reason.

use gyronet::model::blob::{BlobError, CRC, HEADER_LEN, HIDDEN, LINEAR_INPUTS, Shape};
use gyronet::model::window::{FEATURES, WINDOW};
use gyronet::model::{Blob, weights};
use gyronet::nn::Aligned;
use gyronet::nn::lstm::DirectionWeights;
use gyronet_host_tests::models;
use gyronet_host_tests::noise::Noise;

/// A copy of the weights that come with the library, on a word boundary, with room behind.
struct File {
    memory: Box<Aligned<[u8; 160_000]>>,
    len: usize,
}

impl File {
    fn new() -> Self {
        let mut file = Self { memory: Box::new(Aligned([0; _])), len: weights::GYRONET.0.len() };
        file.bytes_mut().copy_from_slice(&weights::GYRONET.0);
        file
    }

    /// The file with these bytes at an offset, and a checksum that fits.
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
    weights::GYRONET.0.len() - Shape::PAPER.file_len(0)
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
    let layers = blob.layers.expect("the paper's network");
    assert_eq!((blob.shape, blob.linear.is_none()), (Shape::PAPER, true));
    assert_eq!((layers[0].forward.units(), layers[1].backward.inputs()), (HIDDEN, 2 * HIDDEN));
    assert!(file.len <= 126 * 1024, "GyroNet's weights must not pass 126 KB: {} bytes", file.len);
}

#[test]
fn each_header_field_is_checked() {
    let len = weights::GYRONET.0.len();
    let topology = |found| BlobError::Topology { found, expected: Shape::LARGEST.topology() };
    let length = |expected, found| BlobError::Length { expected, found };
    let (window, features, hidden) = (WINDOW as u16, FEATURES as u16, HIDDEN as u16);
    let p = provenance_len();
    let file_len = |p| Shape::PAPER.file_len(p);
    let smaller = Shape { units: 56, linear: false };
    for (at, bytes, error) in [
        (0, &b"GYRX"[..], BlobError::Magic(*b"GYRX")),
        (4, &[1, 0], BlobError::Version { found: 1, expected: 5 }),
        (4, &[2, 0], BlobError::Version { found: 2, expected: 5 }),
        (4, &[4, 0], BlobError::Version { found: 4, expected: 5 }),
        (4, &[0, 1], BlobError::Version { found: 256, expected: 5 }),
        (6, &[2, 0], BlobError::Version { found: 5, expected: 4 }),
        (6, &[3, 0], topology([3, window, features, hidden, 2, 0])),
        (8, &(len as u32 + 4).to_le_bytes(), length(len + 4, len)),
        (8, &[0xFF; 4], length(u32::MAX as usize, len)),
        (12, &[60, 0], topology([1, 60, features, hidden, 2, 0])),
        (14, &[9, 0], topology([1, window, 9, hidden, 2, 0])),
        (16, &[90, 0], topology([1, window, features, 90, 2, 0])),
        (16, &[64, 0], topology([1, window, features, 64, 2, 0])),
        (16, &[58, 0], topology([1, window, features, 58, 2, 0])),
        (16, &[0, 0], topology([1, window, features, 0, 2, 0])),
        (16, &[56, 0], length(smaller.file_len(p), len)),
        (18, &[1, 0], topology([1, window, features, hidden, 1, 0])),
        (20, &[9, 0], topology([1, window, features, hidden, 2, 9])),
        (20, &[10, 0, 1, 0], topology([1, window, features, hidden, 2, u16::MAX])),
        (20, &[10, 0, 0, 0], length(Shape::LARGEST.file_len(p), len)),
        (24, &(p as u32 + 4).to_le_bytes(), length(file_len(p + 4), len)),
        (24, &(p as u32 + 1).to_le_bytes(), length(file_len(0), len)),
        (24, &0xFFFF_FFFCu32.to_le_bytes(), length(file_len(0), len)),
        (28, &0i32.to_le_bytes(), BlobError::Scale),
        (28, &(-1i32).to_le_bytes(), BlobError::Scale),
        (28, &32_768i32.to_le_bytes(), BlobError::Scale),
        (HEADER_LEN, &[0xFF], BlobError::Provenance),
    ] {
        assert_eq!(File::with(at, bytes).error(), error, "{bytes:02x?} at {at}");
    }
    assert_eq!(
        file_len(0),
        HEADER_LEN
            + (direction_at(1, 1) - direction_at(1, 0)) * 2
            + 2 * (direction_at(0, 1) - direction_at(0, 0))
            + (4 * HIDDEN + 8)
            + 4
    );
}

#[test]
fn every_other_length_is_refused_and_a_file_off_the_word_boundary() {
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
    let mut file = file;
    file.memory.0.copy_within(..file.len, 1);
    assert_eq!(Blob::new_checked(&file.memory.0[1..=file.len]).err(), Some(BlobError::Misaligned));
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
    let row = Shape::PAPER.file_len(provenance_len()) - 4 - (4 * HIDDEN + 8);
    assert_eq!(File::with(row + 4 * HIDDEN, &i32::MAX.to_le_bytes()).error(), BlobError::Scale);
    assert_eq!(File::with(row, &[0xFF, 0x7F].repeat(2 * HIDDEN)).error(), BlobError::Scale);
}

#[test]
fn a_linear_part_that_could_overflow_is_refused() {
    const SHAPE: Shape = Shape { units: 8, linear: true };
    let mut file = models::file::<{ SHAPE.file_len(0) }>(SHAPE, 3);
    let end = file.len() - 4;
    let mut check = |edit: &dyn Fn(&mut [u8])| {
        edit(&mut file);
        let crc = CRC.checksum(&file[..end]);
        file[end..].copy_from_slice(&crc.to_le_bytes());
        Blob::new_checked(&Aligned(file).0).map(|blob| blob.shape)
    };
    assert_eq!(check(&|_| {}), Ok(SHAPE));
    // Two weights of -2^31 in the last row are as much as a row may have, with the others zero but for one LSB less.
    let row = HEADER_LEN + 4 * (WINDOW - 1) * LINEAR_INPUTS;
    let set = |file: &mut [u8], at: usize, weight: i32| {
        file[row + 4 * at..row + 4 * at + 4].copy_from_slice(&weight.to_le_bytes());
    };
    let largest = |file: &mut [u8]| {
        file[row..row + 4 * LINEAR_INPUTS].fill(0);
        set(file, 0, i32::MIN);
        set(file, 54, i32::MAX);
    };
    assert_eq!(check(&largest), Ok(SHAPE));
    assert_eq!(check(&|file| set(file, 30, 1)), Err(BlobError::LinearBound { output: 9 }));
    assert_eq!(check(&|file| set(file, 30, -1)), Err(BlobError::LinearBound { output: 9 }));
    // Ten weights round by at most ten LSBs; more is an answer to a constant.
    let constant = |sum: i32| {
        move |file: &mut [u8]| {
            file[row..row + 4 * LINEAR_INPUTS].fill(0);
            set(file, 2, 100);
            set(file, 56, sum - 100);
        }
    };
    assert_eq!(check(&constant(-10)), Ok(SHAPE));
    for sum in [11, -11] {
        assert_eq!(check(&constant(sum)), Err(BlobError::Constant { output: 9, input: 2 }));
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
        let is_crc = matches!(file.error(), BlobError::Crc { computed, stored } if computed != stored);
        assert!(is_crc || bit / 8 < 28, "bit {bit}: {}", file.error());
        file.bytes_mut()[bit / 8] ^= 1 << (bit % 8);
    }
    assert!(Blob::new_checked(file.bytes()).is_ok());
}
