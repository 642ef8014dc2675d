//! The yaw messages of a fibre-optic gyro: sent from when it is heard, from the start where one is configured.

use super::config::SAMPLE_MS;
use super::e2e::{DataIdMode, P01, Profile};
use super::load::Periodic;
use super::yaw_feed::YawFeed;
use crate::vehicle::YawSample;
use embedded_can::{Frame, Id, StandardId};
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
        Self { feed: YawFeed::new(Self::profiles(ids), 1), ids }
    }

    /// The protection of each message.
    #[must_use]
    pub fn profiles(ids: [u16; 3]) -> [Profile; 3] {
        ids.map(|data_id| Profile::P01(P01 { data_id, mode: DataIdMode::Both }))
    }

    /// Every message of the gyro; none for identifiers of over 11 bits.
    #[must_use]
    pub fn messages(ids: [u16; 3]) -> Vec<Periodic, 3> {
        let message = |id| Periodic { id: Id::Standard(id), period_ms: SAMPLE_MS };
        ids.into_iter().filter_map(StandardId::new).map(message).collect()
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
