//! The load of periodic messages on a CAN bus, at worst.

use embedded_can::Id;

/// A classic data frame of eight bytes that is sent periodically.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Periodic {
    /// Identifier of the frame.
    pub id: Id,
    /// Period, ms.
    pub period_ms: u16,
}

/// Data bits of a frame; all our frames have eight bytes.
const DATA_BITS: u32 = 64;

impl Periodic {
    /// Returns the bits of one frame with the largest possible number of stuff bits, interframe space included.
    ///
    /// 13 bits are never stuffed (CRC delimiter, acknowledgement, end of frame, space); in the
    /// others, of which 34 or 54 are not data, there is at most one stuff bit for every four
    /// bits after the first (Davis et al., 2007).
    pub const fn worst_case_bits(&self) -> u32 {
        let stuffed = DATA_BITS
            + match self.id {
                Id::Standard(_) => 34,
                Id::Extended(_) => 54,
            };
        stuffed + 13 + (stuffed - 1) / 4
    }
}

/// Returns the load of the messages on a bus, in 1/1000, rounded up.
pub fn per_mille(messages: &[Periodic], bits_per_second: u32) -> u32 {
    // Bits in 1000 s, exact for every period that divides 1,000,000 ms, rounded up for others.
    let bits: u64 = messages
        .iter()
        .map(|message| {
            (u64::from(message.worst_case_bits()) * 1_000_000).div_ceil(message.period_ms.max(1).into())
        })
        .sum();
    u32::try_from(bits.div_ceil(bits_per_second.max(1).into())).unwrap_or(u32::MAX)
}
