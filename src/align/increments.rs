//! Sums the increments of a fibre-optic gyro from one grid step to the next.
//!
//! - An increment belongs to the time since the one before it. One that straddles a grid step is split there in
//!   proportion, without loss: the sum over all steps is that of all increments, to the last bit.
//! - After lost messages, or where the one before ended more than one and a half spans ago, it belongs to its own span
//!   only. The turn in the gap is not guessed: the step reports how much of its time is covered.
//! - What belongs to a step that is already emitted is not used. An axis that was invalid in some part has no sum.
//! - A span longer than a grid step is refused: set the part to 100 Hz or more.

use crate::sample::{FogSample, PERIOD_US};
use crate::units::{Angle, Micros};
use heapless::Deque;

/// Increments kept: those of a 1 kHz part in the 20 ms that a step can wait, and half as many again.
pub const KEPT: usize = 32;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Turn {
    /// About x, y, z; `None` where an axis was not good throughout, or no increment arrived.
    pub angle: [Option<Angle>; 3],
    /// The part of the step that the increments cover, microseconds; less than [`PERIOD_US`] marks a gap.
    pub covered: u32,
}

/// An increment and its time; a bad axis has the angle zero, since `Option`s would take a third more memory.
#[derive(Debug, Clone, Copy)]
struct Piece {
    begin: u64,
    end: u64,
    angle: [Angle; 3],
    is_good: [bool; 3],
}

/// Increments that a grid step may still need, times by the board's clock.
#[derive(Debug, Clone, Default)]
pub struct Increments {
    pieces: Deque<Piece, KEPT>,
    last_end: Option<u64>,
}

impl Increments {
    pub const EMPTY: Self = Self { pieces: Deque::new(), last_end: None };

    /// Adds a sample that ended at `time` by the board's clock, later than the last one.
    pub fn add(&mut self, time: Micros, sample: &FogSample) {
        let (end, span) = (time.0, u64::from(sample.span));
        let own = end.saturating_sub(span);
        let begin = match self.last_end {
            // Jitter moves the ends by less than half the span. A part without a sequence number shows one lost
            // message only by a distance of two spans.
            Some(last) if sample.lost == 0 && 2 * end.saturating_sub(last) <= 3 * span => last,
            Some(last) => own.max(last),
            None => own,
        };
        self.last_end = Some(end);
        if span > PERIOD_US {
            return;
        }
        if self.pieces.is_full() {
            self.pieces.pop_front();
        }
        // There is room now.
        let angle = sample.increment.map(|angle| angle.unwrap_or(Angle::ZERO));
        let is_good = sample.increment.map(|angle| angle.is_some());
        let _ = self.pieces.push_back(Piece { begin, end, angle, is_good });
    }

    /// Forgets the end of the newest increment: a gap follows.
    pub fn disconnect(&mut self) {
        self.last_end = None;
    }

    pub fn has_reached(&self, time: Micros) -> bool {
        self.last_end.is_some_and(|end| end >= time.0)
    }

    /// Returns the turn of the step that ends at `time`; call it for the steps in ascending order.
    #[inline(never)]
    pub fn take(&mut self, time: Micros) -> Turn {
        let begin = time.0.saturating_sub(PERIOD_US);
        let mut angle = [Some(Angle::ZERO); 3];
        let mut covered = 0;
        while let Some(mut piece) = self.pieces.pop_front() {
            if piece.begin >= time.0 {
                // It belongs to the next step. There is room, because it has just been removed.
                let _ = self.pieces.push_front(piece);
                break;
            }
            let mut rest = None;
            if piece.end > time.0 {
                let (first, second) = piece.split(time.0);
                (piece, rest) = (first, Some(second));
            }
            if piece.begin < begin {
                // Its step has been emitted, and the receiver may have filled the gap.
                piece = piece.split(begin.min(piece.end)).1;
            }
            covered += piece.end - piece.begin;
            if piece.end > begin {
                for ((sum, part), is_good) in angle.iter_mut().zip(piece.angle).zip(piece.is_good) {
                    *sum = sum.filter(|_| is_good).and_then(|sum| sum.0.checked_add(part.0)).map(Angle);
                }
            }
            if let Some(rest) = rest {
                let _ = self.pieces.push_front(rest);
                break;
            }
        }
        if covered == 0 {
            angle = [None; 3];
        }
        Turn { angle, covered: covered as u32 }
    }
}

impl Piece {
    fn split(self, time: u64) -> (Self, Self) {
        // One and a half grid steps at most, as `add` ensures: products of the two fit 64 bits.
        let whole = ((self.end - self.begin) as i64).max(1);
        let part = (time.saturating_sub(self.begin) as i64).min(whole);
        // The same as angle * part / whole, which needs 128 bits and thousands of cycles on a Cortex-M.
        let share = |angle: i64| angle / whole * part + angle % whole * part / whole;
        let first = self.angle.map(|angle| Angle(share(angle.0)));
        let mut second = self.angle;
        for (all, first) in second.iter_mut().zip(first) {
            all.0 -= first.0;
        }
        (Self { end: time, angle: first, ..self }, Self { begin: time, angle: second, ..self })
    }
}
