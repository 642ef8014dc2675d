//! CRC-32 of both networks' outputs for random windows, the same on a board and a host.

use super::numbers::Numbers;
use super::random_model::window;
use gyronet::model::WindowNetwork;
use gyronet::model::blob::CRC;
use gyronet::model::fognet::MinuteNetwork;
use gyronet::model::seconds::{Minute, STEPS, Second};
use gyronet::units::Angle;

pub fn gyronet(network: &mut impl WindowNetwork) -> u32 {
    let (mut numbers, mut digest) = (Numbers::new(7), CRC.digest());
    for _ in 0..16 {
        for rate in network.estimate(&window(&mut numbers, 0)).corrections {
            digest.update(&rate.0.to_le_bytes());
        }
    }
    digest.finalize()
}

/// `minute` is empty.
pub fn fognet(network: &mut impl MinuteNetwork, minute: &mut Minute) -> Option<u32> {
    let (mut numbers, mut digest) = (Numbers::new(8), CRC.digest());
    for _ in 0..3 {
        for _ in 0..STEPS {
            // +-10 m/s^2, +-0.25 rad/s, +-160 m/s; +-0.5 rad.
            let limit = |k: usize| if (3..=5).contains(&k) { 1 << 25 } else { 10 << 20 };
            let features = core::array::from_fn(|k| numbers.within(limit(k)));
            let turn = Angle(i64::from(numbers.within(1 << 29)) << 14);
            minute.add(Second { features, turn });
        }
        let estimate = network.estimate(&minute.window()?);
        for angle in [estimate.correction, estimate.linear] {
            digest.update(&angle.0.to_le_bytes());
        }
    }
    Some(digest.finalize())
}
