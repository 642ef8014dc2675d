//! A message counter shows whether messages before it were lost or repeated.

/// Judgement of an undamaged message by its counter.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Verdict {
    /// No message came before it; its counter is only noted.
    First,
    /// The one expected.
    Ok,
    /// The same counter again: a repetition, or a sender that stands still.
    Repeated,
    /// Good, but so many before it are missing.
    Lost(u8),
    /// Too far from the one before it: reordered, or more lost than allowed.
    WrongSequence {
        /// Step of the counter, modulo its cycle.
        delta: u8,
    },
}

impl Verdict {
    /// Returns whether the message's content may be used.
    #[must_use]
    pub const fn usable(self) -> bool {
        matches!(self, Self::First | Self::Ok | Self::Lost(_))
    }
}

/// Remembers the counter of the last message.
#[derive(Debug, Clone, Copy)]
pub struct Sequence {
    counters: u16,
    max_delta: u8,
    last: Option<u8>,
}

impl Sequence {
    /// Makes a check of a counter with `counters` values; steps up to `max_delta` are loss, larger ones disorder.
    #[must_use]
    pub const fn new(counters: u16, max_delta: u8) -> Self {
        Self { counters, max_delta, last: None }
    }

    /// Judges the next counter and takes it as the new reference, whatever the verdict: a
    /// sender that was restarted is believed again from its second message on.
    pub fn check(&mut self, counter: u8) -> Verdict {
        let Some(last) = self.last.replace(counter) else { return Verdict::First };
        let step = u16::from(counter) + self.counters - u16::from(last);
        // Of no values at all each one is the same.
        let delta = step.checked_rem(self.counters).unwrap_or(0) as u8;
        match delta {
            0 => Verdict::Repeated,
            1 => Verdict::Ok,
            _ if delta <= self.max_delta => Verdict::Lost(delta - 1),
            _ => Verdict::WrongSequence { delta },
        }
    }
}
