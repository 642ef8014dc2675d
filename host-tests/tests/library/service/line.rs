//! Frames on the line: their bytes, and noise between them.

use super::{bare, set};
use gyronet::service::Request;
use gyronet::service::frame::{Deframer, FrameError, MAX_FRAME, emit};
use gyronet::service::message::AllCounters;
use gyronet::store::Configuration;
use gyronet_host_tests::noise::{Noise, cases};
use proptest::prelude::*;

#[test]
fn a_frame_has_its_documented_bytes() {
    // 00, COBS of (number 7, request 0, CRC-32 of 07 00), 00.
    let frame = emit(7, &Request::Info).expect("it fits");
    let crc = gyronet::model::blob::CRC.checksum(&[7, 0]).to_le_bytes();
    assert!(!crc.contains(&0));
    assert_eq!(&frame[..], [&[0, 2, 7, 5][..], &crc, &[0]].concat());
    let number = |request: &Request| emit(0, request).expect("it fits")[3];
    assert_eq!(number(&Request::Restart), 11, "the last request; number 0 is encoded away");
}

proptest! {
    #![proptest_config(cases(300))]

    /// Noise, with requests strewn in: the noise is counted, the requests are answered.
    #[test]
    fn flooded(seed in any::<u64>()) {
        let mut board = bare();
        let mut noise = Noise::new(seed);
        let mut answers = 0;
        for _ in 0..10 {
            let length = noise.int(0, 2_000);
            for _ in 0..length {
                // Noise whose frames would have a right checksum is one in 2^32.
                prop_assert!(board.receive(noise.byte(), &AllCounters::default()).is_none());
            }
            for byte in emit(1, &Request::Info).expect("it fits") {
                answers += usize::from(board.receive(byte, &AllCounters::default()).is_some());
            }
        }
        prop_assert_eq!(answers, 10);
    }

    /// Intact frames of anything: refused or answered, never more than a frame.
    #[test]
    fn intact_frames_of_anything(bytes in proptest::collection::vec(any::<u8>(), 0..40)) {
        let mut board = bare();
        let mut content = vec![3];
        content.extend(&bytes);
        let crc = gyronet::model::blob::CRC.checksum(&content).to_le_bytes();
        content.extend(crc);
        let mut frame = vec![0; content.len() + 4];
        let len = cobs::encode(&content, &mut frame[1..]);
        frame.truncate(len + 2);
        let answers: Vec<_> = frame.iter().filter_map(|b| board.receive(*b, &AllCounters::default())).collect();
        prop_assert_eq!(answers.len(), 1);
        prop_assert!(answers[0].len() <= MAX_FRAME);
    }

    /// A frame with any bit flipped is no frame.
    #[test]
    fn flipped_bits(at in 1usize..200, bit in 0u8..8) {
        let configuration = Configuration::DEFAULT;
        let mut frame = emit(1, &set(configuration)).expect("it fits");
        let at = 1 + at % (frame.len() - 2);
        frame[at] ^= 1 << bit;
        let mut deframer = Deframer::new();
        for byte in frame.iter().chain(&[0]) {
            if let Some(Ok((_, request))) = deframer.receive::<Request>(*byte) {
                prop_assert!(false, "{request:?}");
            }
        }
    }
}

#[test]
fn a_message_that_is_too_long_is_refused() {
    let mut deframer = Deframer::new();
    let long: Vec<_> =
        [0].into_iter().chain([1; 2_000]).chain([0]).filter_map(|b| deframer.receive::<Request>(b)).collect();
    assert_eq!(long, [Err(FrameError::TooLong)]);
}
