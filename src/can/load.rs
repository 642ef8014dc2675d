//! The load of periodic messages on a CAN bus (worst case) and on a serial line.

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
/// Line bits per character: start, eight data bits, stop.
const BITS_PER_CHARACTER: u32 = 10;

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

    /// Returns the line bits of the same frame as an SLCAN line, with or without a time stamp.
    pub const fn slcan_bits(&self, stamped: bool) -> u32 {
        let identifier = match self.id {
            Id::Standard(_) => 3,
            Id::Extended(_) => 8,
        };
        // Letter, identifier, length, data, stamp, CR.
        let characters = 1 + identifier + 1 + 2 * 8 + (if stamped { 4 } else { 0 }) + 1;
        characters * BITS_PER_CHARACTER
    }
}

/// Returns the load of the messages on a bus or line, in 1/1000, rounded up.
pub fn per_mille(messages: &[Periodic], bits: impl Fn(&Periodic) -> u32, bits_per_second: u32) -> u32 {
    // Bits in 1000 s, exact for every period that divides 1,000,000 ms, rounded up for others.
    let bits: u64 = messages
        .iter()
        .map(|message| (u64::from(bits(message)) * 1_000_000).div_ceil(message.period_ms.max(1).into()))
        .sum();
    u32::try_from(bits.div_ceil(bits_per_second.max(1).into())).unwrap_or(u32::MAX)
}
