//! Reception by DMA: a stream writes the ring in circular mode, and the tick counts the bytes.
//!
//! Between two ticks the stream writes less than a lap, so its position gives the number of bytes. If a tick was
//! late, or position and flag show a whole lap, a lap is added: the reader then finds more bytes than the ring can
//! hold, and drops them all as lost.

use super::RECEIVED;
use crate::ring::Ring;
use crate::stm32f405::dma::Stream;

/// Bits on the line for each byte.
const BITS: u32 = 10;
const US_PER_S: u32 = 1_000_000;

/// Counts the bytes that a stream writes to a ring.
pub struct Reception {
    stream: Stream,
    ring: &'static Ring<u8, RECEIVED>,
    /// Index of the next byte in the ring.
    place: usize,
    /// Time of the last count, and the time that the stream takes for a lap, us.
    counted_at: u32,
    lap_us: u32,
}

impl Reception {
    /// Returns a reception that counts from the ring's first byte, where the stream begins, at `now`, us.
    pub fn new(stream: Stream, ring: &'static Ring<u8, RECEIVED>, baud: u32, now: u32) -> Self {
        let lap_us = (RECEIVED as u32 * BITS).saturating_mul(US_PER_S / 100) / (baud / 100).max(1);
        Self { stream, ring, place: 0, counted_at: now, lap_us }
    }

    /// Counts the bytes received until `now`, us. Called at least twice a lap; the reader must not run meanwhile.
    #[inline(always)]
    pub fn count(&mut self, now: u32) {
        let around = self.stream.take_complete();
        let place = RECEIVED - self.stream.remaining().clamp(1, RECEIVED);
        let wrapped = place < self.place;
        if wrapped && !around {
            // The stream wrapped after the flag was read.
            self.stream.take_complete();
        }
        let late = now.wrapping_sub(self.counted_at) >= self.lap_us;
        let lapped = around && (late || !wrapped);
        let received = place.wrapping_sub(self.place) % RECEIVED + if lapped { RECEIVED } else { 0 };
        self.ring.advance_write(received);
        self.place = place;
        self.counted_at = now;
    }
}
