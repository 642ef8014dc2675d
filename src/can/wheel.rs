//! The receiver decodes wheel speeds from the vehicle's frames, with a configurable layout. Module `standstill`
//! decides whether the vehicle stands.

mod layout;
mod settings;
mod standstill;

pub use layout::{Checksum, WheelError, WheelFrame, WheelSignal};
#[cfg(feature = "service")]
pub(crate) use settings::raw_id;
pub use settings::{MAX_FRAMES, WheelConfigError, WheelSettings};

use super::e2e::{Sequence, Verdict};
use crate::sample::WheelSample;
use crate::units::Micros;
use embedded_can::Frame;
use standstill::{StandstillRule, Wheels};

/// Decodes frames to wheel speeds and standstill.
#[derive(Debug, Clone, Copy)]
pub struct WheelReceiver {
    settings: WheelSettings,
    sequences: [Sequence; MAX_FRAMES],
    wheels: Wheels,
    /// Whether a good frame has been received.
    has_received: bool,
    lost: u32,
}

impl WheelReceiver {
    /// Checks the settings and creates a receiver.
    ///
    /// # Errors
    /// [`WheelConfigError`].
    pub fn new(settings: WheelSettings) -> Result<Self, WheelConfigError> {
        let WheelSettings { timeout, still_speed, still_for, .. } = settings;
        let rule = StandstillRule { timeout, still_speed, still_for };
        let wheels = Wheels::new(rule, settings.wheels()?);
        let sequences = settings.frames.map(|frame| {
            let counters = frame.map_or(1, |frame| frame.counters());
            // A lost frame is counted and the new one still accepted: its speed is good.
            Sequence::new(counters, u8::MAX)
        });
        Ok(Self { settings, sequences, wheels, has_received: false, lost: 0 })
    }

    /// Processes a frame received at `now`; `None` if it is not a wheel frame.
    ///
    /// # Errors
    /// [`WheelError`]; the wheels of the frame then keep their last speed until it is stale,
    /// except those whose speed is not valid.
    pub fn decode(&mut self, frame: &impl Frame, now: Micros) -> Option<Result<WheelSample, WheelError>> {
        let id = frame.id();
        let is_meant = |candidate: &Option<WheelFrame>| candidate.is_some_and(|candidate| candidate.id == id);
        let index = self.settings.frames.iter().position(is_meant)?;
        let layout = self.settings.frames.get(index).copied().flatten()?;
        self.wheels.expire(now);
        let result = self.take(index, &layout, frame.data(), now);
        self.wheels.judge(now);
        self.has_received |= result.is_ok();
        Some(result.map(|()| self.wheels.sample(now)))
    }

    /// Returns the newest speeds without a new frame; `None` before the first good frame, because a vehicle without
    /// wheel frames is not a fault.
    pub fn poll(&mut self, now: Micros) -> Option<WheelSample> {
        self.wheels.expire(now);
        self.has_received.then(|| self.wheels.sample(now))
    }

    /// Returns the number of lost frames, from the message counters.
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
            match sequence.check(counter) {
                Verdict::Repeated => return Err(WheelError::Repeated),
                Verdict::Lost(count) => self.lost = self.lost.saturating_add(count.into()),
                Verdict::First | Verdict::Ok | Verdict::WrongSequence { .. } => {}
            }
        }
        let mut result = Ok(());
        for (wheel, signal) in self.settings.signals.iter().enumerate() {
            let Some(signal) = signal.filter(|signal| usize::from(signal.frame) == index) else { continue };
            let speed = signal.speed(wheel, data);
            self.wheels.set(wheel, speed.ok(), now);
            result = result.and(speed.map(drop));
        }
        result
    }
}
