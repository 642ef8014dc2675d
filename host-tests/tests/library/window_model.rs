//! The window model in all its sizes: the paper's shape keeps its outputs to the bit, a smaller one gives the same in
//! any memory that holds it, and the linear part is exact; the default one is linear and answers nothing that is constant.

use gyronet::model::blob::{LINEAR_INPUTS, Shape};
use gyronet::model::gyronet::{GyroNetState, LargestState};
use gyronet::model::window::{FEATURES, Features, WINDOW};
use gyronet::model::{Blob, BlobError, GyroNet, WindowNetwork, weights};
use gyronet::nn::Aligned;
use gyronet::nn::lstm::DirectionWeights;
use gyronet::units::AngularRate;
use gyronet_host_tests::models;
use gyronet_host_tests::noise::Noise;

/// A CRC-32 over the estimates of 64 random windows, at all sizes of input.
fn digest(network: &mut impl WindowNetwork) -> u32 {
    let mut digest = gyronet::model::blob::CRC.digest();
    let mut noise = Noise::new(19);
    for round in 0..64 {
        let size = [1 << 16, 1 << 22, 1 << 25, i64::from(i32::MAX)][round % 4];
        let window: [Features; WINDOW] =
            std::array::from_fn(|_| std::array::from_fn(|_| noise.int(-size, size) as i32));
        let estimate = network.estimate(&window);
        for rate in estimate.corrections {
            digest.update(&rate.0.to_le_bytes());
        }
        digest.update(&estimate.clamped_inputs.to_le_bytes());
    }
    digest.finalize()
}

/// The digest of the network that comes with the library, as the code for the paper's shape alone computed it.
#[test]
fn the_papers_shape_keeps_its_outputs() {
    let blob = Blob::new_checked(&weights::GYRONET.0).expect("the built-in weights");
    assert_eq!(digest(&mut GyroNet::new(blob)), 3_501_887_089);
}

/// Runs a random model in memory of its own size and in the largest one, whose arrays the paper's network used before:
/// the same estimates, piece by piece and at once, and the newest one alone.
fn check<const LEN: usize, const U: usize, const W: usize, const R: usize>(shape: Shape) {
    let file = Aligned(models::file::<LEN>(shape, 4));
    let blob = Blob::new_checked(&file.0).expect("a random model");
    assert_eq!((blob.shape, usize::from(shape.units)), (shape, U));
    let mut used = LargestState::ZERO;
    let paper = Blob::new_checked(&weights::GYRONET.0).expect("the built-in weights");
    digest(&mut GyroNet::with_state(paper, &mut used).expect("it is the largest"));
    let mut large = GyroNet::with_state(blob, &mut used).expect("it is smaller");
    let mut own = GyroNet::with_state(blob, GyroNetState::<U, W, R>::ZERO).expect("it is of this size");
    let mut different = 0;
    for round in 0..40 {
        let window = models::window(&mut models::Numbers::new(1 + round), round);
        let estimate = own.estimate(&window);
        assert_eq!(estimate, large.estimate(&window), "{shape:?}");
        let linear = exact(&blob, &window);
        different += u32::from(estimate.corrections.map(|rate| rate.0) != linear);
        assert!(shape.units > 0 || estimate.clamped_inputs == 0);
    }
    assert_eq!(different > 0, shape.units > 0, "the linear part alone is exact; the Bi-LSTMs add to it");
}

fn exact(blob: &Blob<'_>, window: &[Features; WINDOW]) -> [i32; WINDOW] {
    let mut outputs = [0; WINDOW];
    for (output, row) in outputs.iter_mut().zip(blob.linear.iter().flat_map(|linear| linear.rows())) {
        assert_eq!(row.len(), LINEAR_INPUTS);
        let products = row.iter().zip(window.as_flattened()).map(|(w, x)| i128::from(*w) * i128::from(*x));
        let sum = (products.sum::<i128>() + (1 << 23)) >> 24;
        *output = sum.clamp(i32::MIN.into(), i32::MAX.into()) as i32;
    }
    outputs
}

#[test]
fn a_model_gives_the_same_in_any_memory_that_holds_it() {
    macro_rules! each {
        ($($units:literal $linear:literal),*) => {$({
            const SHAPE: Shape = Shape { units: $units, linear: $linear };
            const LEN: usize = SHAPE.file_len(0);
            check::<LEN, $units, { $units / 2 }, { DirectionWeights::recurrent_words($units) }>(SHAPE);
        })*};
    }
    each!(0 true, 4 true, 4 false, 8 true, 16 false, 32 true, 44 true, 60 true, 60 false);
}

#[test]
fn a_model_that_the_memory_does_not_hold_is_refused() {
    let paper = Blob::new_checked(&weights::GYRONET.0).expect("the built-in weights");
    let error = GyroNet::with_state(paper, <GyroNetState>::ZERO).map(|_| ());
    assert_eq!(error, Err(BlobError::Units { found: 60, largest: 0 }));
}

#[test]
fn the_linear_part_saturates() {
    const SHAPE: Shape = Shape { units: 0, linear: true };
    let mut file = Aligned(models::file::<{ SHAPE.file_len(0) }>(SHAPE, 4));
    let (header, end) = (gyronet::model::blob::HEADER_LEN, SHAPE.file_len(0) - 4);
    for (at, weight) in file.0[header..end].as_chunks_mut::<4>().0.iter_mut().enumerate() {
        // Differences of the first and the last sample in two inputs.
        *weight = match at % LINEAR_INPUTS {
            0 => i32::MAX,
            54 => -i32::MAX,
            _ => 0,
        }
        .to_le_bytes();
    }
    let crc = gyronet::model::blob::CRC.checksum(&file.0[..end]).to_le_bytes();
    file.0[end..].copy_from_slice(&crc);
    let blob = Blob::new_checked(&file.0).expect("it is within its bound");
    let mut network = GyroNet::with_state(blob, <GyroNetState>::ZERO).expect("it has no units");
    for (input, output) in [(i32::MAX, i32::MAX), (i32::MIN, i32::MIN), (0, 0)] {
        let mut window = [[0; 6]; WINDOW];
        (window[0], window[WINDOW - 1]) = ([input; 6], [input.saturating_neg(); 6]);
        let estimate = network.estimate(&window);
        assert_eq!(estimate.corrections.map(|rate| rate.0), [output; WINDOW]);
        assert_eq!(estimate.clamped_inputs, 0);
    }
}

/// Every row's weights of an input add up to zero, and roll and pitch rate have none: bias, gain and mounting belong to the
/// unit, which the board and `gyronet calibrate` find.
#[test]
fn nothing_constant_is_corrected() {
    let blob = Blob::new_checked(&weights::DEFAULT.0).expect("they come with the library");
    let linear = blob.linear.expect("it is one");
    assert_eq!((blob.shape.units, linear.rows().count()), (0, WINDOW));
    for row in linear.rows() {
        for feature in 0..FEATURES {
            let weights = row.iter().skip(feature).step_by(FEATURES);
            let is_used = weights.clone().any(|weight| *weight != 0);
            assert_eq!(is_used, ![3, 4].contains(&feature), "feature {feature}");
            assert_eq!(weights.map(|weight| i64::from(*weight)).sum::<i64>(), 0, "feature {feature}");
        }
    }
    let (mut network, mut noise) = (GyroNet::new(blob), Noise::new(11));
    for _ in 0..200 {
        let constant: [i32; FEATURES] =
            std::array::from_fn(|_| noise.int(i32::MIN.into(), i32::MAX.into()) as i32);
        let estimate = network.estimate(&[constant; WINDOW]);
        assert_eq!(estimate.corrections, [AngularRate::ZERO; WINDOW], "{constant:?}");
    }
}
