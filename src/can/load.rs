//! The load of periodic messages on a CAN bus, at worst.

use super::fd::{DATA_BITS_PER_SECOND, LENGTH};
use embedded_can::Id;

/// A data frame that is sent periodically: a classic one of eight bytes, or the CAN FD frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Periodic {
    pub id: Id,
    pub period_ms: u16,
    pub is_fd: bool,
}

const DATA_BITS: u32 = 64;

impl Periodic {
    /// Returns the bits of a frame with most stuff bits and interframe space, at the nominal rate: 13 are never
    /// stuffed (CRC delimiter, acknowledgement, end, space); of the others, 34 or 54 besides data, every fourth after
    /// the first may be (Davis et al., 2007).
    pub const fn worst_case_bits(&self, bits_per_second: u32) -> u32 {
        if self.is_fd {
            // 17 bits up to the switch, with their stuff bits, and the 13; ESI, DLC and data with theirs, then the stuff
            // count and the CRC of 21 bits, with fixed stuff bits (ISO 11898-1).
            const FAST: u32 = 1 + 4 + 8 * LENGTH as u32;
            const BITS: u32 = FAST + FAST / 4 + 4 + 21 + 7;
            return 17
                + 16 / 4
                + 13
                + (BITS * (bits_per_second / 1_000)).div_ceil(DATA_BITS_PER_SECOND / 1_000);
        }
        let stuffed = DATA_BITS
            + match self.id {
                Id::Standard(_) => 34,
                Id::Extended(_) => 54,
            };
        stuffed + 13 + (stuffed - 1) / 4
    }
}

/// Returns prescaler and both segments of a bit sampled at 80 %, of up to `most` quanta, the more the better.
pub fn bit_time(clock_hz: u32, bits_per_second: u32, most: u32) -> (u16, u8, u8) {
    let clocks = clock_hz / bits_per_second.max(1);
    let prescaler = clocks.div_ceil(most.max(1)).max(1);
    let quanta = clocks / prescaler;
    (prescaler as u16, quanta.saturating_sub(1 + quanta / 5) as u8, (quanta / 5) as u8)
}

/// Returns the load of the messages on a bus, in 1/1000, rounded up.
pub fn per_mille(messages: &[Periodic], bits_per_second: u32) -> u32 {
    // Bits in 1000 s, exact for every period that divides 1,000,000 ms, rounded up for others.
    let bits: u64 = messages
        .iter()
        .map(|message| {
            (u64::from(message.worst_case_bits(bits_per_second)) * 1_000_000)
                .div_ceil(message.period_ms.max(1).into())
        })
        .sum();
    u32::try_from(bits.div_ceil(bits_per_second.max(1).into())).unwrap_or(u32::MAX)
}
