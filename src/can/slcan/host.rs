//! A session executes the commands of a host on an SLCAN line and makes the answers that it expects.
//!
//! python-can sends `C`, `S6`, an empty line and `O` and reads frames; slcand writes `C`, `S6`,
//! `O` and hands the line to the kernel. Neither waits for the answers, but both stumble over an
//! answer in the middle of a frame: answers are whole lines, sent between frames.
//!
//! The output goes on whatever the host says: the vehicle does not depend on a laptop, and a
//! logger that was plugged in late should see frames without knowing any of this. `C` is
//! therefore answered and otherwise ignored. `S` is confirmed only for the bit rate that the
//! bus has; it cannot be changed from here.

use super::SlcanError;
use crate::can::DataFrame;
use heapless::Vec;

/// Longest answer: `V`, four digits, CR.
pub const MAX_ANSWER: usize = 6;
/// An answer as sent.
pub type Answer = Vec<u8, MAX_ANSWER>;

const OK: &[u8] = b"\r";
const ERROR: &[u8] = b"\x07";
/// Hardware and software version, two digits each.
const VERSION: &[u8] = b"V0101\r";
/// Four characters in place of a serial number.
const SERIAL: &[u8] = b"NGYRO\r";

/// Status byte of the command `F` (CAN232 manual).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct StatusFlags(pub u8);

impl StatusFlags {
    /// Frames to the host were dropped.
    pub const TRANSMIT_FULL: Self = Self(1 << 1);
    /// The bus has many errors.
    pub const ERROR_WARNING: Self = Self(1 << 2);
    /// Bytes from the host were lost.
    pub const OVERRUN: Self = Self(1 << 3);
    /// The controller is error passive.
    pub const ERROR_PASSIVE: Self = Self(1 << 5);
    /// The bus is off.
    pub const BUS_ERROR: Self = Self(1 << 7);
}

/// Holds the effect of a line from the host.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Reaction {
    /// The answer to send before the next frame.
    pub answer: Answer,
    /// A frame from the host, which the caller may use (wheel speeds on a bench).
    pub frame: Option<DataFrame>,
}

impl Reaction {
    fn answer(text: &[u8]) -> Self {
        // All texts are six characters at most.
        Self { answer: Vec::from_slice(text).unwrap_or_default(), frame: None }
    }
}

/// Returns the digit of the command `S` for a bit rate.
#[must_use]
pub const fn bit_rate_digit(bits_per_second: u32) -> Option<u8> {
    Some(match bits_per_second {
        10_000 => b'0',
        20_000 => b'1',
        50_000 => b'2',
        100_000 => b'3',
        125_000 => b'4',
        250_000 => b'5',
        500_000 => b'6',
        800_000 => b'7',
        1_000_000 => b'8',
        _ => return None,
    })
}

/// The device's end of the conversation.
#[derive(Debug, Clone, Copy)]
pub struct Session {
    bit_rate: Option<u8>,
    stamped: bool,
    refused: u32,
}

impl Session {
    /// Begins without time stamps, as hosts expect at first.
    #[must_use]
    pub const fn new(bits_per_second: u32) -> Self {
        Self { bit_rate: bit_rate_digit(bits_per_second), stamped: false, refused: 0 }
    }

    /// Returns whether the host wants time stamps behind the frames.
    #[must_use]
    pub const fn stamped(&self) -> bool {
        self.stamped
    }

    /// Returns the number of lines that were answered with an error.
    #[must_use]
    pub const fn refused(&self) -> u32 {
        self.refused
    }

    /// Takes a line without its CR.
    pub fn execute(&mut self, line: &[u8], status: StatusFlags) -> Reaction {
        match line {
            // An empty line is how hosts clear what may be left in a buffer.
            [] | [b'C' | b'O' | b'L'] => Reaction::answer(OK),
            [b'S', digit] if Some(*digit) == self.bit_rate => Reaction::answer(OK),
            [b'Z', flag @ (b'0' | b'1')] => {
                self.stamped = *flag == b'1';
                Reaction::answer(OK)
            }
            b"V" => Reaction::answer(VERSION),
            b"N" => Reaction::answer(SERIAL),
            b"F" => {
                let [high, low] = super::hex(status.0);
                Reaction::answer(&[b'F', high, low, b'\r'])
            }
            [b't' | b'T', ..] => self.frame(super::parse(line)),
            _ => self.refuse(),
        }
    }

    /// Answers a line that could not be read at all.
    pub fn refuse(&mut self) -> Reaction {
        self.refused = self.refused.saturating_add(1);
        Reaction::answer(ERROR)
    }

    fn frame(&mut self, frame: Result<DataFrame, SlcanError>) -> Reaction {
        match frame {
            Ok(frame) => Reaction { frame: Some(frame), ..Reaction::answer(OK) },
            Err(_) => self.refuse(),
        }
    }
}
