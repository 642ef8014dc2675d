//! Frames out of a byte stream, for a protocol whose longest frame fills the framer.

use gyronet::sensor::framer::{Framer, Protocol};

/// A header, a value and its complement.
struct Pair;

impl Protocol for Pair {
    const HEADER: usize = 1;

    fn length(header: &[u8]) -> Option<usize> {
        (header == [0xA5]).then_some(3)
    }

    fn check(frame: &[u8]) -> bool {
        frame[1] == !frame[2]
    }
}

#[test]
fn a_frame_that_was_handed_out_gives_way_to_the_next() {
    let mut framer = Framer::<Pair, 3>::new();
    let mut values = Vec::new();
    for byte in [0xA5, 1, !1, 0xA5, 2, !2, 0xA5, 3, !3] {
        framer.receive(byte);
        values.extend(framer.next_frame().map(|frame| frame[1]));
    }
    assert_eq!((values, framer.bad_checksums()), (vec![1, 2, 3], 0));
}

#[test]
fn what_nobody_fetches_gives_way() {
    let mut framer = Framer::<Pair, 3>::new();
    [0xA5, 1, !1, 0xA5, 2, !2].iter().for_each(|byte| framer.receive(*byte));
    assert_eq!(framer.next_frame(), Some(&[0xA5, 2, !2][..]));
    assert_eq!(framer.next_frame(), None);
}
