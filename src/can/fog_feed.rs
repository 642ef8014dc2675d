//! The yaw messages of a fibre-optic gyro, which are sent while it is heard.

use super::e2e::{DataIdMode, P01, Profile};
use super::yaw_feed::YawFeed;
use crate::vehicle::YawSample;
use embedded_can::Frame;
use heapless::Vec;

/// Rate, angle and detail for each sample, under E2E profile 1: each message's identifier is its
/// data identifier, too.
#[derive(Debug, Clone, Copy)]
pub struct FogFeed {
    feed: YawFeed,
    ids: [u16; 3],
}

impl FogFeed {
    /// `ids`: 11 bits, of rate, angle and detail; [`super::yaw::FOG_IDS`] as we use them.
    #[must_use]
    pub fn new(ids: [u16; 3]) -> Self {
        let profiles = ids.map(|data_id| Profile::P01(P01 { data_id, mode: DataIdMode::Both }));
        Self { feed: YawFeed::new(profiles, 1), ids }
    }

    /// The frames of one sample, in a driver's own type.
    #[inline(never)]
    pub fn process<F: Frame>(&mut self, sample: &YawSample) -> Vec<F, 3> {
        let mut frames = Vec::new();
        for frame in self.feed.frames(sample, self.ids) {
            // There is room for three.
            let _ = frames.push(frame);
        }
        frames
    }
}
