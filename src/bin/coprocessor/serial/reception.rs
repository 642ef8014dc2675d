//! Reception by DMA: a stream writes a ring's places again and again, and the tick counts how far it is.
//!
//! Between two ticks less than a lap comes, so the stream's place gives the number of bytes. Where ticks were late, or
//! the place and the stream's flag say that it went around, a lap is added: the reader finds more bytes than the ring
//! has places, and drops them all as lost.

use super::RECEIVED;
use crate::ring::Ring;
use crate::stm32f405::dma::Stream;

/// Bits of a byte on the line.
const BITS: u32 = 10;
const US_PER_S: u32 = 1_000_000;

/// Counts the bytes that a stream writes to a ring.
pub struct Reception {
    stream: Stream,
    ring: &'static Ring<u8, RECEIVED>,
    /// The place of the byte that comes next.
    place: usize,
    /// Time of the last look, and the time in which the stream goes around, us.
    looked: u32,
    lap_us: u32,
}

impl Reception {
    /// Counts from the ring's first place, where the stream begins, at `now`, us.
    pub fn new(stream: Stream, ring: &'static Ring<u8, RECEIVED>, baud: u32, now: u32) -> Self {
        let lap_us = (RECEIVED as u32 * BITS).saturating_mul(US_PER_S / 100) / (baud / 100).max(1);
        Self { stream, ring, place: 0, looked: now, lap_us }
    }

    /// Counts what has come until `now`, us. Called at least twice a lap; the reader is held off meanwhile.
    #[inline(always)]
    pub fn count(&mut self, now: u32) {
        let around = self.stream.take_complete();
        let place = RECEIVED - self.stream.remaining().clamp(1, RECEIVED);
        let wrapped = place < self.place;
        if wrapped && !around {
            // It came around just now.
            self.stream.take_complete();
        }
        let late = now.wrapping_sub(self.looked) >= self.lap_us;
        let lapped = around && (late || !wrapped);
        let came = place.wrapping_sub(self.place) % RECEIVED + if lapped { RECEIVED } else { 0 };
        self.ring.written(came);
        self.place = place;
        self.looked = now;
    }
}
