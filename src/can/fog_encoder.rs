//! Makes the yaw messages of a fibre-optic gyro (FOG). They are sent from the FOG's first sample on, or
//! from power-up if a FOG is configured.

use super::DataFrame;
use super::config::{E2e, SAMPLE_MS};
use super::e2e::{DataIdMode, Profile};
use super::load::Periodic;
use super::yaw_encoder::YawEncoder;
use crate::estimate::YawEstimate;
use embedded_can::{Id, StandardId};
use heapless::Vec;

/// Encodes rate, angle and detail for each step, with E2E profile 1 and the CAN identifier as data identifier.
#[derive(Debug, Clone, Copy)]
pub struct FogEncoder {
    encoder: YawEncoder,
    ids: [u16; 3],
}

impl FogEncoder {
    /// Creates an encoder with the identifiers of rate, angle and detail, by default [`super::yaw::FOG_IDS`].
    pub const fn new(ids: [u16; 3]) -> Self {
        Self { encoder: YawEncoder::new(Self::profiles(ids), 1), ids }
    }

    pub const fn profiles(data_ids: [u16; 3]) -> [Profile; 3] {
        E2e::P01 { mode: DataIdMode::Both, data_ids }.profiles()
    }

    /// Returns every message of the gyro, without those whose identifier has more than 11 bits.
    pub fn messages(ids: [u16; 3]) -> Vec<Periodic, 3> {
        let message = |id| Periodic { id: Id::Standard(id), period_ms: SAMPLE_MS, is_fd: false };
        ids.into_iter().filter_map(StandardId::new).map(message).collect()
    }

    #[inline(never)]
    pub fn send(&mut self, sample: &YawEstimate, send: impl FnMut(DataFrame)) {
        self.encoder.send(sample, self.ids, send);
    }
}
