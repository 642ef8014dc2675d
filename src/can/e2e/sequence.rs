//! A message counter shows whether messages before it were lost or repeated.

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Verdict {
    /// The first message; its counter is the reference for the next one.
    First,
    Ok,
    /// The same counter again: a repeated message, or a sender whose counter does not advance.
    Repeated,
    /// A good message, after this number of lost ones.
    Lost(u8),
    /// Too large a step from the previous counter: messages are reordered, or more are lost than allowed.
    WrongSequence {
        /// Counter step, modulo its cycle.
        delta: u8,
    },
}

impl Verdict {
    pub const fn usable(self) -> bool {
        matches!(self, Self::First | Self::Ok | Self::Lost(_))
    }
}

#[derive(Debug, Clone, Copy)]
pub struct Sequence {
    counters: u16,
    max_delta: u8,
    last: Option<u8>,
}

impl Sequence {
    /// Creates a check for `counters` values. Steps up to `max_delta` count as loss, larger ones as a wrong sequence.
    pub const fn new(counters: u16, max_delta: u8) -> Self {
        Self { counters, max_delta, last: None }
    }

    /// Checks a counter and takes it as the reference: a sender that restarts is believed from its second message on.
    pub fn check(&mut self, counter: u8) -> Verdict {
        let Some(last) = self.last.replace(counter) else { return Verdict::First };
        let step = u16::from(counter) + self.counters - u16::from(last);
        // With zero values, every counter counts as repeated.
        let delta = step.checked_rem(self.counters).unwrap_or(0) as u8;
        match delta {
            0 => Verdict::Repeated,
            1 => Verdict::Ok,
            _ if delta <= self.max_delta => Verdict::Lost(delta - 1),
            _ => Verdict::WrongSequence { delta },
        }
    }
}
