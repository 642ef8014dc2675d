//! The latitude that the vehicle's GNSS receiver sends, for the Earth's rate.
//!
//! It is used once [`CONFIRM`] frames in a row agree. One that the vehicle cannot have reached is refused and counted,
//! and contests the latitude in use until a frame agrees with that; [`CONFIRM`] such frames that agree replace it. If
//! the frames stop, it stays in use: an hour of driving changes the Earth's rate by 0.2 deg/h at most.

use super::HeadingError;
use crate::units::Micros;

/// Number of frames that must agree before a latitude is used.
pub const CONFIRM: u8 = 10;
/// Largest difference of two latitudes that agree, degrees: 2 km.
const NEAR_DEG: f32 = 0.02;
/// Fastest plausible change, degrees per microsecond: 400 km/h.
const DEG_PER_US: f32 = 1e-9;
/// Largest plausible change since the last accepted frame, however long ago, degrees.
const LONGEST_DEG: f32 = 1.0;

/// A latitude that has been accepted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ReceivedLatitude {
    /// Degrees, north positive.
    pub degrees: f32,
    /// True if it agrees with the latitude in use; otherwise it is the first one, or replaces a wrong one.
    pub moved: bool,
}

#[derive(Debug, Clone, Copy)]
pub(super) struct LatitudeJudge {
    known: Option<(f32, Micros)>,
    /// A latitude that is not used yet, and the number of frames that agree with it.
    candidate: Option<(f32, u8)>,
}

impl LatitudeJudge {
    /// Creates it; `known` is a latitude from another source, with which frames must agree.
    pub fn new(known: Option<f32>) -> Self {
        Self { known: known.map(|degrees| (degrees, Micros(0))), candidate: None }
    }

    pub fn is_contested(&self) -> bool {
        self.known.is_some() && self.candidate.is_some()
    }

    /// Takes a latitude received at `now`; `None` while it is not confirmed yet. An error changes nothing.
    pub fn take(&mut self, degrees: f32, now: Micros) -> Result<Option<ReceivedLatitude>, HeadingError> {
        if !(-90.0..=90.0).contains(&degrees) {
            return Err(HeadingError::Range { what: "latitude", value: degrees });
        }
        if let Some((from, at)) = self.known {
            let reachable = (now.since(at).0 as f32 * DEG_PER_US).min(LONGEST_DEG);
            if libm::fabsf(degrees - from) <= NEAR_DEG + reachable {
                self.known = Some((degrees, now));
                self.candidate = None;
                return Ok(Some(ReceivedLatitude { degrees, moved: true }));
            }
        }
        let agreeing = match self.candidate {
            Some((before, frames)) if libm::fabsf(degrees - before) <= NEAR_DEG => frames + 1,
            _ => 1,
        };
        if agreeing >= CONFIRM {
            self.known = Some((degrees, now));
            self.candidate = None;
            return Ok(Some(ReceivedLatitude { degrees, moved: false }));
        }
        self.candidate = Some((degrees, agreeing));
        match self.known {
            Some((from, _)) => Err(HeadingError::Jump { from, to: degrees }),
            None => Ok(None),
        }
    }
}
