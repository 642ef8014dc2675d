//! This module applies the faults of a line to the messages on it.

use super::fault::{Fault, Kind, Line};
use crate::random::Random;

/// Holds bytes that arrive over a line together.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Message {
    /// The line.
    pub line: Line,
    /// The row of the drive that it describes.
    pub row: usize,
    /// The time of its arrival, microseconds of the board's clock.
    pub at: u64,
    /// The bytes.
    pub bytes: Vec<u8>,
}

/// Applies a fault to messages in the order of their arrival and returns the time of its first effect.
pub fn damage(messages: &mut Vec<Message>, fault: &Fault) -> Option<u64> {
    let mut draw = fault.draw_on();
    let mut first = None;
    let mut hit = |message: &Message, draw: &mut Random| {
        let hit = message.line == fault.line
            && fault.holds(message.row)
            && (first.is_none() || draw.chance(fault.share));
        if hit {
            first.get_or_insert(message.at);
        }
        hit
    };
    match fault.kind {
        Kind::Drop | Kind::CanLoss => messages.retain(|message| !hit(message, &mut draw)),
        Kind::Duplicate => {
            let twice = |message: Message| {
                let count = if hit(&message, &mut draw) { 2 } else { 1 };
                std::iter::repeat_n(message, count)
            };
            *messages = std::mem::take(messages).into_iter().flat_map(twice).collect();
        }
        Kind::BitFlip => {
            for message in messages.iter_mut().filter(|message| !message.bytes.is_empty()) {
                if hit(message, &mut draw) {
                    let bit = draw.below(8 * message.bytes.len());
                    message.bytes[bit / 8] ^= 1 << (bit % 8);
                }
            }
        }
        Kind::Burst => {
            // Noise does not stop at the end of a message: it continues into the next one.
            let mut left = 0;
            for message in messages.iter_mut().filter(|message| message.line == fault.line) {
                let mut at = 0;
                if left == 0 && hit(message, &mut draw) {
                    left = fault.size as usize;
                    at = draw.below(message.bytes.len());
                }
                for byte in message.bytes.iter_mut().skip(at).take(left) {
                    *byte = draw.bits() as u8;
                    left -= 1;
                }
            }
        }
        Kind::Truncation => {
            for message in messages.iter_mut() {
                if hit(message, &mut draw) {
                    message.bytes.truncate(draw.below(message.bytes.len()));
                }
            }
        }
        Kind::Reordering => {
            // A message that is hit is delayed until after `size` later messages of its line.
            let own: Vec<usize> = (0..messages.len()).filter(|n| messages[*n].line == fault.line).collect();
            for (n, place) in own.iter().enumerate() {
                let behind = own[n..].get(fault.size as usize);
                if hit(&messages[*place], &mut draw)
                    && let Some(behind) = behind
                {
                    // It arrives one microsecond after that message.
                    messages[*place].at = messages[*behind].at + 1;
                }
            }
            messages.sort_by_key(|message| message.at);
        }
        Kind::Stall => {
            let all = Fault { share: 1.0, ..*fault };
            let stalled = |message: &Message| message.line == fault.line && all.holds(message.row);
            first = messages.iter().find(|message| stalled(message)).map(|message| message.at);
            let end = messages.iter().filter(|message| stalled(message)).map(|message| message.at).max();
            if fault.form.is_multiple_of(2) {
                messages.retain(|message| !stalled(message));
            } else if let Some(end) = end {
                messages.iter_mut().filter(|message| stalled(message)).for_each(|message| message.at = end);
                messages.sort_by_key(|message| message.at);
            }
        }
        // These faults affect the measurements.
        Kind::ClockDrift
        | Kind::ClockJump
        | Kind::Stuck
        | Kind::Saturation
        | Kind::BiasStep
        | Kind::NotANumber
        | Kind::WheelSlip
        | Kind::SwappedWheels => {}
    }
    first
}
