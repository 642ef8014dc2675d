//! This encoder makes the yaw messages of a fibre-optic gyro. They are sent from its first sample on, or from the
//! start where one is configured.

use super::DataFrame;
use super::config::SAMPLE_MS;
use super::e2e::{DataIdMode, P01, Profile};
use super::load::Periodic;
use super::yaw_encoder::YawEncoder;
use crate::estimate::YawEstimate;
use embedded_can::{Id, StandardId};
use heapless::Vec;

/// Encodes rate, angle and detail for each step, under E2E profile 1. Each message's identifier is its
/// data identifier too.
#[derive(Debug, Clone, Copy)]
pub struct FogEncoder {
    encoder: YawEncoder,
    ids: [u16; 3],
}

impl FogEncoder {
    /// Begins before the first message. `ids` are the identifiers (11 bits) of rate, angle and detail;
    /// [`super::yaw::FOG_IDS`] as we use them.
    #[must_use]
    pub const fn new(ids: [u16; 3]) -> Self {
        Self { encoder: YawEncoder::new(Self::profiles(ids), 1), ids }
    }

    /// Returns the protection of each message.
    #[must_use]
    pub const fn profiles([rate, angle, detail]: [u16; 3]) -> [Profile; 3] {
        const fn profile(data_id: u16) -> Profile {
            Profile::P01(P01 { data_id, mode: DataIdMode::Both })
        }
        [profile(rate), profile(angle), profile(detail)]
    }

    /// Returns every message of the gyro; none for identifiers of over 11 bits.
    #[must_use]
    pub fn messages(ids: [u16; 3]) -> Vec<Periodic, 3> {
        let message = |id| Periodic { id: Id::Standard(id), period_ms: SAMPLE_MS };
        ids.into_iter().filter_map(StandardId::new).map(message).collect()
    }

    /// Encodes the frames of one step.
    #[inline(never)]
    pub fn encode(&mut self, sample: &YawEstimate) -> Vec<DataFrame, 3> {
        let mut frames = Vec::new();
        for frame in self.encoder.frames(sample, self.ids) {
            // There is room for three.
            let _ = frames.push(frame);
        }
        frames
    }
}
