//! Groups the sequences that are averaged together.

use crate::sequence::Sequence;
use serde::Serialize;

#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Group {
    /// The paper's first sequences, and simulated ones of the first device.
    First,
    /// Urban18 and later, which the paper calls newly released. No source says that their sensors differ.
    NewlyReleased,
    /// Simulated sequences of other devices.
    OtherDevices,
}

impl Group {
    pub fn of(sequence: &Sequence) -> Self {
        if let Some(spec) = &sequence.simulated {
            return if spec.device == 1 { Self::First } else { Self::OtherDevices };
        }
        let number = sequence.name.trim_start_matches(|c: char| !c.is_ascii_digit());
        let is_new = number.parse().is_ok_and(|number: u32| number >= 18);
        if is_new { Self::NewlyReleased } else { Self::First }
    }
}
