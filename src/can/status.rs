//! The slow status message says how well the board knows its sensor and whether the vehicle stands, once a second.
//!
//! Bytes 0 and 1 belong to E2E profile 1, whose data identifier is the CAN identifier; byte 2 counts the messages.
//! Bytes 3 to 7 are one little-endian number:
//!
//! | bits | signal | not available |
//! |---|---|---|
//! | 0, 1 | [`Verdict`]: whether the vehicle stands | 3 |
//! | 2, 3 | [`Evidence`] of the verdict | 3 |
//! | 4 to 6 | [`Knowledge`] of the gyro's bias | 7 |
//! | 7 to 9 | [`Knowledge`] of its gain and misalignment | 7 |
//! | 10 to 12 | [`Knowledge`] of the sensor's mounting | 7 |
//! | 13 to 15 | sources of the yaw rate that others contradict: 1 inertial gyro, 2 fibre-optic gyro, 4 wheels, or their sum | 7, which is also all three |
//! | 16 to 23 | gaps in the accumulated yaws (inertial, fibre-optic) since they began, modulo 255 | 255 |
//! | 24 to 39 | expected error of the angle turned in the last minute, 0.01 deg; 65534 also above | 65535 |

pub use crate::health::slow::{Evidence, Knowledge, SlowStatus, Verdict};

use super::DataFrame;
use super::e2e::{DataIdMode, P01, Profile, Protector};
use embedded_can::{Frame, StandardId};

/// Default identifier.
pub const STATUS_ID: u16 = 0x1A3;
/// Period of the message, ms.
pub const PERIOD_MS: u16 = 1_000;
/// Samples of 10 ms in a period.
const SAMPLES: u8 = 100;
const NO_GAPS: u8 = u8::MAX;
const NO_SOURCE: u8 = 7;
const NO_DOUBT: u16 = u16::MAX;

/// Encodes the message as eight bytes with an empty header.
pub const fn emit(status: &SlowStatus) -> [u8; 8] {
    let gaps = match status.gaps {
        Some(gaps) => (gaps % NO_GAPS as u32) as u8,
        None => NO_GAPS,
    };
    let doubts = match status.doubts {
        Some(doubts) => doubts,
        None => NO_SOURCE,
    };
    let doubt = match status.doubt {
        Some(doubt) if doubt < NO_DOUBT as u32 => doubt as u16,
        Some(_) => NO_DOUBT - 1,
        None => NO_DOUBT,
    };
    let bits = status.verdict as u64
        | (status.evidence as u64) << 2
        | (status.bias as u64) << 4
        | (status.gain as u64) << 7
        | (status.mounting as u64) << 10
        | (doubts as u64) << 13
        | (gaps as u64) << 16
        | (doubt as u64) << 24;
    (bits << 24).to_le_bytes()
}

/// The encoder of the message: one of every hundred samples.
#[derive(Debug, Clone, Copy)]
pub struct StatusEncoder {
    id: StandardId,
    protector: Protector,
    messages: u8,
    samples: u8,
}

impl StatusEncoder {
    /// Creates an encoder; `None` if the identifier has more than 11 bits.
    pub const fn new(id: u16) -> Option<Self> {
        let profile = Profile::P01(P01 { data_id: id, mode: DataIdMode::Both });
        match StandardId::new(id) {
            Some(id) => Some(Self { id, protector: Protector::new(profile), messages: 0, samples: 0 }),
            None => None,
        }
    }

    /// Counts a sample, and returns the frame when it is due: with the first sample, then with every hundredth.
    pub fn frame(&mut self, status: impl FnOnce() -> SlowStatus) -> Option<DataFrame> {
        let is_due = self.samples == 0;
        self.samples = (self.samples + 1) % SAMPLES;
        if !is_due {
            return None;
        }
        let mut bytes = emit(&status());
        bytes[2] = self.messages;
        self.messages = self.messages.wrapping_add(1);
        // Eight bytes fit the profile.
        let _ = self.protector.protect(&mut bytes);
        DataFrame::new(self.id, &bytes)
    }
}
