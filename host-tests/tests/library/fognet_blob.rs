//! FoGNet's weight file: whatever is wrong with one, it is refused with the right reason.

use gyronet::model::fognet_blob::{
    BlobError, COLUMNS, FogBlob, HEADER_LEN, HIDDEN1, HIDDEN2, INPUTS, TOPOLOGY, file_len,
};
use gyronet::model::{Blob, blob, weights};
use gyronet::nn::lstm::DirectionWeights;

const LEN: usize = weights::FOGNET.0.len();

/// Why the file is refused with these bytes at an offset, and a checksum that fits.
fn with(at: usize, bytes: &[u8]) -> BlobError {
    let mut file = Box::new(weights::FOGNET);
    file.0[at..at + bytes.len()].copy_from_slice(bytes);
    let (content, stored) = file.0.split_last_chunk_mut().expect("longer than its checksum");
    *stored = blob::CRC.checksum(content).to_le_bytes();
    FogBlob::new_checked(&file.0).expect_err("something is wrong with it")
}

fn direction_len(units: usize, inputs: usize) -> usize {
    4 * (DirectionWeights::input_words(units, inputs) + DirectionWeights::recurrent_words(units))
}

#[test]
fn the_default_is_good_and_another_or_a_part_of_it_is_refused() {
    let blob = FogBlob::new_checked(&weights::FOGNET.0).expect("it comes with the library");
    assert!(blob.provenance.contains("checkpoint_sha256"));
    assert!(blob.provenance.contains("\"simulated\":true"), "{}", blob.provenance);
    let error = Blob::new_checked(&weights::FOGNET.0).expect_err("it is FoGNet's");
    assert_eq!(error, BlobError::Topology { found: TOPOLOGY, expected: blob::Shape::LARGEST.topology() });
    let error = FogBlob::new_checked(&weights::GYRONET.0).expect_err("it is GyroNet's");
    assert_eq!(error, BlobError::Topology { found: blob::Shape::PAPER.topology(), expected: TOPOLOGY });
    for len in [0, file_len(0) - 1, LEN - 4] {
        let error = FogBlob::new_checked(&weights::FOGNET.0[..len]).expect_err("it is cut off");
        assert!(matches!(error, BlobError::Length { expected, found } if found == len && expected > len));
    }
}

#[test]
fn rows_that_could_overflow_are_refused() {
    let provenance = LEN - file_len(0);
    let first = HEADER_LEN + provenance;
    let fc1 = first + 2 * (direction_len(HIDDEN1, COLUMNS) + direction_len(HIDDEN1, 2 * HIDDEN1));
    let second = fc1 + 4 * HIDDEN1 + 8;
    let fc2 = second + 2 * (direction_len(HIDDEN2, 2) + direction_len(HIDDEN2, 2 * HIDDEN2));
    assert_eq!(fc2 + 4 * HIDDEN2 + 8 + 4, LEN);
    for (layer, at) in [(0, first), (2, second)] {
        let error = BlobError::RowBound { layer, direction: 0, unit: 0 };
        assert_eq!(with(at, &i32::MAX.to_le_bytes()), error);
        assert_eq!(with(at + 4, &[0, 0, 0, 0x80]), error);
    }
    for (row, columns) in [(fc1, 2 * HIDDEN1), (fc2, 2 * HIDDEN2)] {
        assert_eq!(with(row, &[0xFF, 0x7F].repeat(columns)), BlobError::Scale);
        assert_eq!(with(row + 2 * columns, &i32::MAX.to_le_bytes()), BlobError::Scale);
    }
    assert_eq!(with(28, &0i32.to_le_bytes()), BlobError::Scale);
    assert_eq!(with(352, &[4, 0]), BlobError::Gyro(4));
    assert_eq!(with(352, &[0, 0]), BlobError::Gyro(0));
    assert_eq!(with(4, &[3, 0]), BlobError::Version { found: 3, expected: 4 });
    assert_eq!(HEADER_LEN, 32 + 8 * INPUTS + 4 * 60 + 8 + 8);
}
