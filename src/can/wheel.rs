//! Decodes wheel speeds from the vehicle's frames, with a configurable layout, and decides whether the vehicle stands.
//!
//! A bias estimator that relies on the gyro alone mistakes a slow turn for bias. Standstill is reported late and
//! withdrawn at once: all wheels must have been fresh and slow for some time, because passive sensors read zero below
//! walking pace, and one that moves, is stale or not valid ends it.

mod layout;
mod settings;

use layout::Pulses;
pub use layout::{ByteSum, Checksum, Code, MAX_SPEED, Parts, WheelError, WheelFrame, WheelSignal};
pub use settings::{MAX_FRAMES, WheelConfigError, WheelSettings};

use super::e2e::{Sequence, Verdict};
use crate::sample::{Standstill, WHEELS, WheelSample};
use crate::units::{Micros, WheelSpeed};
use embedded_can::Frame;

/// Decodes frames to wheel speeds and standstill.
#[derive(Debug, Clone, Copy)]
pub struct WheelReceiver {
    settings: WheelSettings,
    sequences: [Sequence; MAX_FRAMES],
    expected: [bool; WHEELS],
    /// The newest speed of each wheel, and the time since which all have been slow.
    speeds: [Option<(WheelSpeed, Micros)>; WHEELS],
    still_since: Option<Micros>,
    pulses: [Option<Pulses>; WHEELS],
    /// Wheels that the newest frame marked as not valid.
    invalid: [bool; WHEELS],
    /// True if a frame has been received whose protection was right.
    has_received: bool,
    lost: u32,
}

impl WheelReceiver {
    /// Checks the settings and creates a receiver.
    pub fn new(settings: WheelSettings) -> Result<Self, WheelConfigError> {
        let expected = settings.wheels()?;
        let sequences = settings.frames.map(|frame| {
            let counters = frame.map_or(1, |frame| frame.counters());
            // A lost frame is counted and the new one still accepted: its speed is good.
            Sequence::new(counters, u8::MAX)
        });
        let (speeds, still_since) = ([None; WHEELS], None);
        let (pulses, invalid) = ([None; WHEELS], [false; WHEELS]);
        let (has_received, lost) = (false, 0);
        Ok(Self { settings, sequences, expected, speeds, still_since, pulses, invalid, has_received, lost })
    }

    /// Processes a frame received at `now`; `None` if it is not a wheel frame. After an error the wheels of the frame
    /// keep their last speed until it is stale, except those whose speed is not valid.
    pub fn decode(&mut self, frame: &impl Frame, now: Micros) -> Option<Result<WheelSample, WheelError>> {
        let id = frame.id();
        let is_meant = |place: &Option<WheelFrame>| place.as_ref().is_some_and(|layout| layout.id == id);
        let index = self.settings.frames.iter().position(is_meant)?;
        self.expire(now);
        let result = self.take(index, frame.data(), now);
        self.judge(now);
        self.has_received |= matches!(result, Ok(()) | Err(WheelError::Invalid { .. }));
        Some(result.map(|()| self.sample(now)))
    }

    /// Returns whether the newest frames marked a wheel's speed as not valid, or carried an impossible one.
    pub fn is_invalid(&self) -> bool {
        self.invalid.contains(&true)
    }

    /// Returns the newest speeds without a frame; `None` before the first intact one: having none is no fault.
    pub fn poll(&mut self, now: Micros) -> Option<WheelSample> {
        self.expire(now);
        self.has_received.then(|| self.sample(now))
    }

    /// Returns the number of lost frames, from the message counters.
    pub fn lost(&self) -> u32 {
        self.lost
    }

    fn take(&mut self, index: usize, data: &[u8], now: Micros) -> Result<(), WheelError> {
        let Self { settings, sequences, speeds, pulses, invalid, lost, .. } = self;
        let Some(Some(layout)) = settings.frames.get(index) else { return Ok(()) };
        if let Some(counter) = layout.check(data)?
            && let Some(sequence) = sequences.get_mut(index)
        {
            match sequence.check(counter) {
                Verdict::Repeated => return Err(WheelError::Repeated),
                Verdict::Lost(count) => *lost = lost.saturating_add(count.into()),
                Verdict::First | Verdict::Ok | Verdict::WrongSequence { .. } => {}
            }
        }
        let mut result = Ok(());
        let signals = settings.signals.iter().zip(pulses).zip(invalid).zip(speeds).enumerate();
        for (wheel, (((signal, pulses), invalid), newest)) in signals {
            let Some(signal) = signal.as_ref().filter(|signal| usize::from(signal.frame) == index) else {
                continue;
            };
            let speed = signal.speed(wheel, data, now, pulses);
            *invalid = speed.is_err();
            if speed != Ok(None) {
                *newest = speed.ok().flatten().map(|speed| (speed, now));
            }
            result = result.and(speed.map(drop));
        }
        result
    }
    fn expire(&mut self, now: Micros) {
        for slot in &mut self.speeds {
            if let Some((_, at)) = slot
                && now.since(*at) > self.settings.timeout
            {
                *slot = None;
            }
        }
        if !self.is_complete() {
            self.still_since = None;
        }
    }

    fn judge(&mut self, now: Micros) {
        let limit = self.settings.still_speed.0.unsigned_abs();
        let slow = self.speeds.iter().flatten().all(|(speed, _)| speed.0.unsigned_abs() <= limit);
        if slow && self.is_complete() {
            self.still_since.get_or_insert(now);
        } else {
            self.still_since = None;
        }
    }

    fn sample(&self, now: Micros) -> WheelSample {
        let standstill = match self.still_since {
            Some(since) if now.since(since) >= self.settings.still_for => Standstill::Still,
            Some(_) => Standstill::Unknown,
            None if self.is_complete() => Standstill::Moving,
            None => Standstill::Unknown,
        };
        WheelSample { time: now, speeds: self.speeds.map(|speed| speed.map(|(speed, _)| speed)), standstill }
    }

    fn is_complete(&self) -> bool {
        self.speeds.iter().zip(self.expected).all(|(speed, expected)| speed.is_some() || !expected)
    }
}
