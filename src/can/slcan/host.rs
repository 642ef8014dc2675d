//! A session executes the SLCAN commands of a host and generates the answers.
//!
//! python-can and slcand do not wait for answers, but fail on one in the middle of a frame. Answers are therefore
//! whole lines, sent between frames. A session is closed until `O` or `L`; `C` closes it. CAN does not depend on it.
//! `S` is confirmed only for the bit rate of the bus, which a host cannot change.

use super::SlcanError;
use crate::can::DataFrame;
use heapless::Vec;

/// Longest answer: `V`, four digits, CR.
pub const MAX_ANSWER: usize = 6;
pub type Answer = Vec<u8, MAX_ANSWER>;

const OK: &[u8] = b"\r";
const ERROR: &[u8] = b"\x07";
/// Answer to `V`: hardware and software version, two digits each.
const VERSION: &[u8] = b"V0101\r";
/// Answer to `N`: four characters in place of a serial number.
const SERIAL: &[u8] = b"NGYRO\r";

/// Status byte of the command `F` (CAN232 manual).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct StatusFlags(pub u8);

impl StatusFlags {
    /// Frames to the host were dropped.
    pub const TRANSMIT_FULL: Self = Self(1 << 1);
    /// The bus has many errors.
    pub const ERROR_WARNING: Self = Self(1 << 2);
    /// The controller is error passive.
    pub const ERROR_PASSIVE: Self = Self(1 << 5);
    /// The bus is off.
    pub const BUS_ERROR: Self = Self(1 << 7);
}

#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Reaction {
    pub answer: Answer,
    /// A frame from the host. If the caller does not use it, [`Session::refuse`] has the answer instead.
    pub frame: Option<DataFrame>,
}

impl Reaction {
    fn answer(text: &[u8]) -> Self {
        // Every answer has at most MAX_ANSWER bytes.
        Self { answer: Vec::from_slice(text).unwrap_or_default(), frame: None }
    }
}

/// Returns the digit of the command `S` for a bit rate; `None` if the command has none for it.
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

#[derive(Debug, Clone, Copy)]
pub struct Session {
    bit_rate: Option<u8>,
    pub open: bool,
    pub stamped: bool,
    /// Lines that were answered with an error.
    pub refused: u32,
}

impl Session {
    /// Creates a closed session without time stamps, the state that hosts expect at first.
    pub const fn new(bits_per_second: u32) -> Self {
        Self { bit_rate: bit_rate_digit(bits_per_second), open: false, stamped: false, refused: 0 }
    }

    /// Executes a line, passed without its CR.
    pub fn execute(&mut self, line: &[u8], status: StatusFlags) -> Reaction {
        match line {
            // Hosts send an empty line to flush an incomplete command.
            [] => Reaction::answer(OK),
            [command @ (b'C' | b'O' | b'L')] => {
                self.open = *command != b'C';
                Reaction::answer(OK)
            }
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

    /// Returns the error answer, for a line that could not be received or a frame that is not used.
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
