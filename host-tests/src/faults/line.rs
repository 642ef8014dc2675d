//! Lines that carry bytes, and the wrapper that damages the messages of any line.

use super::fault::{Fault, Kind, Line};
use gyronet_tools::random::Random;
use std::cell::Cell;
use std::collections::VecDeque;

/// Bytes that arrive over a line together.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Message {
    pub line: Line,
    /// The row of the drive that it describes.
    pub row: usize,
    /// The time of its arrival, microseconds of the board's clock.
    pub at: u64,
    pub bytes: Vec<u8>,
}

/// The time of the first effect of several faults.
#[derive(Debug, Default)]
pub struct Began(Cell<Option<u64>>);

impl Began {
    pub fn at(&self, time: Option<u64>) {
        self.0.set(self.0.get().into_iter().chain(time).min());
    }

    pub fn time(&self) -> Option<u64> {
        self.0.get()
    }
}

/// Messages in the order of their arrival, of which those on one line are damaged by a fault.
pub struct Damaged<'a, I> {
    input: I,
    fault: Fault,
    draw: Random,
    began: &'a Began,
    hit_any: bool,
    /// Bytes of noise that continue into the next message.
    noise: usize,
    /// Messages that are late, each with the number of messages that have yet to overtake it.
    late: Vec<(usize, Message)>,
    ready: VecDeque<Message>,
}

impl<'a, I: Iterator<Item = Message>> Damaged<'a, I> {
    pub fn new(input: I, fault: &Fault, began: &'a Began) -> Self {
        let (late, ready) = (Vec::new(), VecDeque::new());
        Self { input, fault: *fault, draw: fault.draw_on(), began, hit_any: false, noise: 0, late, ready }
    }

    /// The first message of the fault's rows is always hit, the others by chance.
    fn hits(&mut self, message: &Message) -> bool {
        let hit = self.fault.holds(message.row) && (!self.hit_any || self.draw.chance(self.fault.share));
        if hit && !self.hit_any {
            self.hit_any = true;
            self.began.at(Some(message.at));
        }
        hit
    }

    fn pass(&mut self, mut message: Message) {
        let fault = self.fault;
        let bytes = message.bytes.len();
        match fault.kind {
            Kind::Drop | Kind::CanLoss if self.hits(&message) => return,
            Kind::Duplicate if self.hits(&message) => self.ready.push_back(message.clone()),
            Kind::BitFlip if bytes > 0 && self.hits(&message) => {
                let bit = self.draw.below(8 * bytes);
                message.bytes[bit / 8] ^= 1 << (bit % 8);
            }
            Kind::Burst => {
                let mut from = 0;
                if self.noise == 0 && self.hits(&message) {
                    self.noise = fault.size as usize;
                    from = self.draw.below(bytes);
                }
                for byte in message.bytes.iter_mut().skip(from).take(self.noise) {
                    *byte = self.draw.bits() as u8;
                    self.noise -= 1;
                }
            }
            Kind::Truncation if self.hits(&message) => message.bytes.truncate(self.draw.below(bytes)),
            Kind::Reordering => {
                for (behind, late) in self.late.iter_mut().filter(|(behind, _)| *behind > 0) {
                    *behind -= 1;
                    late.at = message.at + 1;
                }
                if self.hits(&message) {
                    return self.late.push((fault.size as usize, message));
                }
            }
            Kind::Stall if fault.holds(message.row) => {
                self.began.at(Some(message.at).filter(|_| !self.hit_any));
                self.hit_any = true;
                if !fault.is_lost() {
                    self.late.push((1, message));
                }
                return;
            }
            _ => {}
        }
        self.ready.push_back(message);
    }
}

impl<I: Iterator<Item = Message>> Iterator for Damaged<'_, I> {
    type Item = Message;

    fn next(&mut self) -> Option<Message> {
        loop {
            if let Some(message) = self.ready.pop_front() {
                return Some(message);
            }
            let Some(message) = self.input.next() else {
                self.ready.extend(self.late.drain(..).map(|(_, late)| late));
                return self.ready.pop_front();
            };
            // Once a stalled line works again, everything that was held back arrives at once.
            let works = message.row >= self.fault.from + self.fault.rows;
            let stalls = self.fault.kind == Kind::Stall;
            for (behind, late) in self.late.iter_mut().filter(|_| stalls && works) {
                (*behind, late.at) = (0, message.at);
            }
            let arrives = |(behind, late): &mut (usize, Message)| *behind == 0 && late.at <= message.at;
            self.ready.extend(self.late.extract_if(.., arrives).map(|(_, late)| late));
            if message.line == self.fault.line { self.pass(message) } else { self.ready.push_back(message) }
        }
    }
}
