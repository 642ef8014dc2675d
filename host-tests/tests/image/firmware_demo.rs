//! `gyronet demo` finds the image's bytes to be the library's, and reports a byte that differs.

use gyronet::model::window::{Features, WINDOW};
use gyronet::model::{Blob, Estimate, GyroNet, SCALE_MIN, WindowNetwork, weights};
use gyronet_host_tests::image;
use gyronet_tools::bundled;
use gyronet_tools::demo::board::{Agreement, SAMPLES};

/// The network of the image, but for one bit of one window's estimate.
struct OneBitOff<'a>(GyroNet<'a>, usize);

impl WindowNetwork for OneBitOff<'_> {
    fn estimate(&mut self, window: &[Features; WINDOW]) -> Estimate {
        let mut estimate = self.0.estimate(window);
        self.1 += 1;
        if self.1 == 100 {
            estimate.corrections[WINDOW / 2].0 ^= 1 << 9;
        }
        estimate.scale = estimate.scale.max(SCALE_MIN);
        estimate
    }
}

#[test]
fn the_demo_compares_every_byte() {
    const NAME: &str = "the_demo_compares_every_byte";
    let Some(image) = image::coprocessor(NAME, env!("CARGO_TARGET_TMPDIR")) else { return };
    let recording = bundled::simulated_drive().unwrap();
    let network = || GyroNet::new(Blob::new_checked(&weights::DEFAULT.0).unwrap());
    let agreement = Agreement::new(&image, &recording, &mut network()).unwrap();
    assert_eq!(agreement.difference, None);
    assert_eq!((agreement.samples, agreement.frames), (SAMPLES, 6 * SAMPLES as u64));
    assert_eq!(agreement.payload_bytes, 8 * agreement.frames);

    let agreement = Agreement::new(&image, &recording, &mut OneBitOff(network(), 0)).unwrap();
    let difference = agreement.difference.expect("a correction is off by 2^-18 rad/s");
    assert!(difference.number > 6 * 500 && difference.board != difference.host, "{difference:?}");
}
