//! Wheel speeds from a vehicle's own frames, wherever they lie in them.
//!
//! Standing still is decided here, because a bias estimator that trusts the gyro alone takes a
//! slow turn for bias. It is asserted late and dropped at once: all wheels must have been fresh
//! and slow for a while, and one wheel that moves, is silent or not valid ends it. Wheel
//! sensors of the passive kind show zero below walking pace, hence the while.

mod layout;
mod settings;

pub use layout::{Checksum, WheelError, WheelFrame, WheelSignal};
pub use settings::{MAX_FRAMES, WheelConfigError, WheelSettings};

use super::e2e::{Sequence, Verdict};
use crate::sample::{Standstill, WHEELS, WheelSample};
use crate::units::{Micros, WheelSpeed};
use embedded_can::Frame;

/// Frames in, wheel speeds and standstill out.
#[derive(Debug, Clone, Copy)]
pub struct WheelReceiver {
    settings: WheelSettings,
    sequences: [Sequence; MAX_FRAMES],
    /// Wheels that the settings have.
    expected: [bool; WHEELS],
    speeds: [Option<(WheelSpeed, Micros)>; WHEELS],
    still_since: Option<Micros>,
    lost: u32,
}

impl WheelReceiver {
    /// Checks settings; nothing received yet.
    ///
    /// # Errors
    /// [`WheelConfigError`].
    pub fn new(settings: WheelSettings) -> Result<Self, WheelConfigError> {
        let expected = settings.wheels()?;
        let sequences = settings.frames.map(|frame| {
            let counters = frame.map_or(1, |frame| frame.counters());
            // Loss is counted, not refused: the speed itself is good.
            Sequence::new(counters, u8::MAX)
        });
        let speeds = [None; WHEELS];
        Ok(Self { settings, sequences, expected, speeds, still_since: None, lost: 0 })
    }

    /// Takes a frame that was received now; `None` when it is not a wheel frame.
    ///
    /// # Errors
    /// [`WheelError`]; the wheels of the frame then keep their last speed until it is too old,
    /// except those whose speed is not valid.
    pub fn process(&mut self, frame: &impl Frame, now: Micros) -> Option<Result<WheelSample, WheelError>> {
        let id = frame.id();
        let is_meant = |candidate: &Option<WheelFrame>| candidate.is_some_and(|candidate| candidate.id == id);
        let index = self.settings.frames.iter().position(is_meant)?;
        let layout = self.settings.frames.get(index).copied().flatten()?;
        self.expire(now);
        let result = self.take(index, &layout, frame.data(), now);
        self.judge(now);
        Some(result.map(|()| self.sample(now)))
    }

    /// What is known now, without a new frame.
    pub fn poll(&mut self, now: Micros) -> WheelSample {
        self.expire(now);
        self.sample(now)
    }

    /// Frames that counters showed to be missing.
    #[must_use]
    pub fn lost(&self) -> u32 {
        self.lost
    }

    fn take(
        &mut self,
        index: usize,
        layout: &WheelFrame,
        data: &[u8],
        now: Micros,
    ) -> Result<(), WheelError> {
        if let Some(counter) = layout.check(data)?
            && let Some(sequence) = self.sequences.get_mut(index)
        {
            match sequence.process(counter) {
                Verdict::Repeated => return Err(WheelError::Repeated),
                Verdict::Lost(count) => self.lost = self.lost.saturating_add(count.into()),
                Verdict::First | Verdict::Ok | Verdict::WrongSequence { .. } => {}
            }
        }
        let mut result = Ok(());
        for signal in layout.signals.iter().flatten() {
            let speed = signal.speed(data);
            if let Some(slot) = self.speeds.get_mut(signal.wheel) {
                *slot = speed.ok().map(|speed| (speed, now));
            }
            result = result.and(speed.map(drop));
        }
        result
    }

    /// Drops what is too old.
    fn expire(&mut self, now: Micros) {
        for slot in &mut self.speeds {
            let old = |(_, at): &(_, Micros)| now.0.saturating_sub(at.0) > self.settings.timeout_us;
            *slot = slot.take_if(|speed| !old(speed));
        }
        if !self.complete() {
            self.still_since = None;
        }
    }

    fn judge(&mut self, now: Micros) {
        let limit = self.settings.still_speed.0.unsigned_abs();
        let slow = self.speeds.iter().flatten().all(|(speed, _)| speed.0.unsigned_abs() <= limit);
        if slow && self.complete() {
            self.still_since.get_or_insert(now);
        } else {
            self.still_since = None;
        }
    }

    /// Every wheel of the settings has a fresh speed.
    fn complete(&self) -> bool {
        self.speeds.iter().zip(self.expected).all(|(speed, expected)| speed.is_some() || !expected)
    }

    fn sample(&self, now: Micros) -> WheelSample {
        let standstill = match self.still_since {
            Some(since) if now.0.saturating_sub(since.0) >= self.settings.still_for_us => Standstill::Still,
            Some(_) => Standstill::Unknown,
            None if self.complete() => Standstill::Moving,
            None => Standstill::Unknown,
        };
        WheelSample { time: now, speeds: self.speeds.map(|speed| speed.map(|(speed, _)| speed)), standstill }
    }
}
