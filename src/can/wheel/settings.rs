//! The settings name the frames that carry the wheel speeds.

use super::layout::{Checksum, WheelFrame};
use crate::sample::WHEELS;
use crate::units::{Duration, WheelSpeed};
use embedded_can::Id;

/// Most frames that wheel speeds may be spread over.
pub const MAX_FRAMES: usize = WHEELS;

/// The longest time-out and standing time.
const LONGEST_US: u64 = 10_000_000;

/// Everything that can be set.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct WheelSettings {
    /// The frames.
    pub frames: [Option<WheelFrame>; MAX_FRAMES],
    /// A speed that is older says nothing.
    pub timeout: Duration,
    /// Up to this speed a wheel may stand still.
    pub still_speed: WheelSpeed,
    /// The time for which all wheels must be that slow.
    pub still_for: Duration,
}

/// The reason why wheel settings are no configuration.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum WheelConfigError {
    /// There are not two or four wheels.
    #[error("{0} wheels instead of two or four")]
    Wheels(usize),
    /// A wheel that does not exist, or is in two signals.
    #[error("wheel {0} does not exist or is there twice")]
    Wheel(usize),
    /// Two frames under one identifier.
    #[error("wheel frame {0:x} is there twice")]
    DuplicateIdentifier(u32),
    /// A counter of over 8 bits.
    #[error("wheel counter of {0} bits, over 8")]
    Counter(u8),
    /// A checksum beyond byte 7.
    #[error("wheel checksum in byte {0}, beyond 7")]
    Checksum(usize),
    /// Two of a frame's speeds, its counter and its protection have bits in common.
    #[error("wheel frame {0:x}: two values overlap")]
    Overlap(u32),
    /// A factor of zero.
    #[error("wheel {0}: every code is the same speed")]
    Factor(usize),
    /// A time-out or a standing time of zero, or above 10 s.
    #[error("wheel times: {0} us is not above 0 and at most 10 s")]
    Time(u64),
}

impl WheelSettings {
    /// Wheel speeds as many cars of one large maker send them: identifier 0xAA, four big-endian
    /// values of 0.01 km/h from -67.67, front right, front left, rear right, rear left (opendbc,
    /// `WHEEL_SPEEDS`). Still below 0.1 km/h for half a second, silent after 0.1 s.
    pub const TOYOTA: Self = Self {
        frames: [Some(WheelFrame::TOYOTA), None, None, None],
        timeout: Duration::from_millis(100),
        still_speed: WheelSpeed(1_820),
        still_for: Duration::from_millis(500),
    };

    /// Returns the wheels that the settings name, each in one signal.
    pub(super) fn wheels(&self) -> Result<[bool; WHEELS], WheelConfigError> {
        for time in [self.timeout, self.still_for] {
            if time.0 == 0 || time.0 > LONGEST_US {
                return Err(WheelConfigError::Time(time.0));
            }
        }
        let mut expected = [false; WHEELS];
        let frames = || self.frames.iter().flatten();
        for (k, frame) in frames().enumerate() {
            if frames().take(k).any(|earlier| earlier.id == frame.id) {
                return Err(WheelConfigError::DuplicateIdentifier(raw_id(frame.id)));
            }
            if let Some(counter) = frame.counter
                && counter.bits() > 8
            {
                return Err(WheelConfigError::Counter(counter.bits()));
            }
            if let Checksum::J1850 { at } | Checksum::Xor { at } | Checksum::Sum { at } = frame.checksum
                && at > 7
            {
                return Err(WheelConfigError::Checksum(at));
            }
            for signal in frame.signals.iter().flatten() {
                if signal.factor_q16 == 0 {
                    return Err(WheelConfigError::Factor(signal.wheel));
                }
                match expected.get_mut(signal.wheel) {
                    Some(seen @ false) => *seen = true,
                    _ => return Err(WheelConfigError::Wheel(signal.wheel)),
                }
            }
            if frame.overlaps() {
                return Err(WheelConfigError::Overlap(raw_id(frame.id)));
            }
        }
        match expected.iter().filter(|seen| **seen).count() {
            2 | 4 => Ok(expected),
            count => Err(WheelConfigError::Wheels(count)),
        }
    }
}

fn raw_id(id: Id) -> u32 {
    match id {
        Id::Standard(id) => id.as_raw().into(),
        Id::Extended(id) => id.as_raw(),
    }
}
