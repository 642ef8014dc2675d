//! The settings describe the frames that carry the wheel speeds, and when the vehicle counts as standing.

use super::layout::{Checksum, Code, WheelFrame, WheelSignal, nearest};
use crate::can::identifier;
use crate::can::signal::{BitField, ByteOrder};
use crate::sample::WHEELS;
use crate::units::{Duration, WheelSpeed};
use embedded_can::{Id, StandardId};

/// Largest number of frames that carry wheel speeds.
pub const MAX_FRAMES: usize = WHEELS;

/// Longest timeout and longest `still_for`, microseconds.
const LONGEST_US: u64 = 10_000_000;

/// The settings of [`WheelReceiver`](super::WheelReceiver). Without frames and signals the board reads no wheel speeds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct WheelSettings {
    /// Frames that carry wheel speeds.
    pub frames: [Option<WheelFrame>; MAX_FRAMES],
    /// Signal of each wheel: front left, front right, rear left, rear right.
    pub signals: [Option<WheelSignal>; WHEELS],
    /// Age above which a speed is stale.
    pub timeout: Duration,
    /// Highest speed at which a wheel counts as still.
    pub still_speed: WheelSpeed,
    /// Time for which all wheels must be that slow before the vehicle counts as standing.
    pub still_for: Duration,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error, serde::Serialize, serde::Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[allow(missing_docs, reason = "its messages say it")]
pub enum WheelConfigError {
    #[error("{0} wheels instead of two or four")]
    Wheels(usize),
    #[error("wheel {0} refers to a frame that is not configured")]
    Wheel(usize),
    #[error("wheel frame {0:x} is configured twice")]
    DuplicateIdentifier(u32),
    #[error("wheel counter or checksum has {0} bits, more than 8")]
    Counter(u8),
    #[error("wheel checksum is in byte {0}, beyond byte 7")]
    Checksum(usize),
    #[error("wheel frame {0:x}: two values overlap")]
    Overlap(u32),
    #[error("wheel frame {0:x} is one of our own messages, or of diagnosis")]
    Own(u32),
    #[error("wheel {0}: the factor is zero")]
    Factor(usize),
    #[error("wheel {0}: the smallest speed is above the largest")]
    Range(usize),
    #[error("wheel times: {0} us is not above 0 and at most 10 s")]
    Time(u64),
}

impl WheelSettings {
    /// The wheel-speed frame of many Toyota cars: identifier 0xAA, four big-endian values of 15 bits, 0.01 km/h from
    /// -67.67, each below its fault bit: front right, front left, rear right, rear left (opendbc, `WHEEL_SPEEDS`). The vehicle stands after 0.5 s below 0.1 km/h; a speed is stale after 0.1 s.
    pub const TOYOTA: Self = Self {
        frames: [Some(TOYOTA), None, None, None],
        signals: [toyota(23), toyota(7), toyota(55), toyota(39)],
        timeout: Duration::from_millis(100),
        still_speed: WheelSpeed(1_820),
        still_for: Duration::from_millis(500),
    };

    #[cfg(feature = "service")]
    pub(crate) const NONE: Self =
        Self { frames: [None; MAX_FRAMES], signals: [None; WHEELS], ..Self::TOYOTA };

    /// Checks the settings, and returns which wheels have a signal.
    pub(super) fn wheels(&self) -> Result<[bool; WHEELS], WheelConfigError> {
        for time in [self.timeout, self.still_for] {
            if time.0 == 0 || time.0 > LONGEST_US {
                return Err(WheelConfigError::Time(time.0));
            }
        }
        let frames = || self.frames.iter().flatten();
        for (k, frame) in frames().enumerate() {
            if frames().take(k).any(|earlier| earlier.id == frame.id) {
                return Err(WheelConfigError::DuplicateIdentifier(identifier::raw(frame.id)));
            }
            if let Some(counter) = frame.counter
                && counter.bits() > 8
            {
                return Err(WheelConfigError::Counter(counter.bits()));
            }
            match frame.checksum {
                Checksum::J1850 { at } if at > 7 => return Err(WheelConfigError::Checksum(at)),
                Checksum::Sum(sum) if sum.field.bits() > 8 => {
                    return Err(WheelConfigError::Counter(sum.field.bits()));
                }
                _ => {}
            }
        }
        let mut taken = self.frames.map(|frame| frame.map_or(0, |frame| frame.protected_mask()));
        let counters = self.frames.iter().map(|frame| frame.and_then(|frame| frame.counter));
        for ((taken, frame), counter) in taken.iter_mut().zip(&self.frames).zip(counters) {
            take(taken, counter.map_or(0, |counter| counter.mask()), *frame)?;
        }
        for (wheel, signal) in self.signals.iter().enumerate() {
            let Some(signal) = signal else { continue };
            let place = usize::from(signal.frame);
            let (Some(frame @ Some(_)), Some(taken)) = (self.frames.get(place), taken.get_mut(place)) else {
                return Err(WheelConfigError::Wheel(wheel));
            };
            take(taken, signal.field.mask(), *frame)?;
            if signal.factor_q16 == 0 {
                return Err(WheelConfigError::Factor(wheel));
            }
            if signal.range.is_some_and(|[least, most]| least > most) {
                return Err(WheelConfigError::Range(wheel));
            }
        }
        match self.signals.iter().flatten().count() {
            0 if frames().next().is_none() => Ok([false; WHEELS]),
            2 | 4 => Ok(self.signals.map(|signal| signal.is_some())),
            count => Err(WheelConfigError::Wheels(count)),
        }
    }
}

fn take(taken: &mut u64, mask: u64, frame: Option<WheelFrame>) -> Result<(), WheelConfigError> {
    if *taken & mask != 0 {
        return Err(WheelConfigError::Overlap(frame.map_or(0, |frame| identifier::raw(frame.id))));
    }
    *taken |= mask;
    Ok(())
}

const TOYOTA: WheelFrame =
    WheelFrame { id: Id::Standard(StandardId::new(0xAA).unwrap()), counter: None, checksum: Checksum::None };

const fn toyota(start: u8) -> Option<WheelSignal> {
    let speed = BitField::new(start - 1, 15, ByteOrder::Motorola, false);
    let (Ok(field), Ok(fault)) = (speed, BitField::new(start, 1, ByteOrder::Motorola, false)) else {
        return None;
    };
    Some(WheelSignal {
        offset: WheelSpeed(nearest(-67.67 / 3.6 * 65_536.0)),
        valid_when: Some(Code { field: fault, value: 0 }),
        ..WheelSignal::new(0, field, WheelSignal::per_bit_kmh(0.01))
    })
}
