//! Frames wait here for the bus, and old ones make way for new ones, because nobody needs a late rate.
//!
//! A bus that is off, full or gone must not stop the pipeline, and after it comes back nobody
//! wants to know how the vehicle turned before. So putting a frame in never fails and never
//! waits: when the queue is full the oldest frame is dropped and counted. A receiver sees the
//! gap in the messages' counters.

use embedded_can::nb::Can;
use heapless::Deque;

/// The frames that wait, `N` at most.
#[derive(Debug, Clone)]
pub struct TransmitQueue<F, const N: usize> {
    frames: Deque<F, N>,
    dropped: u32,
    errors: u32,
}

impl<F, const N: usize> Default for TransmitQueue<F, N> {
    fn default() -> Self {
        Self::new()
    }
}

impl<F, const N: usize> TransmitQueue<F, N> {
    /// Makes an empty queue.
    #[must_use]
    pub const fn new() -> Self {
        const { assert!(N > 0, "a queue holds at least one frame") };
        Self { frames: Deque::new(), dropped: 0, errors: 0 }
    }

    /// Puts a frame at the end; the oldest one gives way.
    pub fn enqueue(&mut self, frame: F) {
        if self.frames.is_full() {
            let _ = self.frames.pop_front();
            self.dropped = self.dropped.saturating_add(1);
        }
        // There is room now.
        let _ = self.frames.push_back(frame);
    }

    /// Returns the oldest frame.
    #[must_use]
    pub fn front(&self) -> Option<&F> {
        self.frames.front()
    }

    /// Drops the oldest frame and counts it.
    pub fn drop_front(&mut self) {
        if self.frames.pop_front().is_some() {
            self.dropped = self.dropped.saturating_add(1);
        }
    }

    /// Takes the oldest frame, for a transport that always takes it.
    pub fn pop(&mut self) -> Option<F> {
        self.frames.pop_front()
    }

    /// Gives frames to the controller until it takes no more; never waits. Gives how many it
    /// took.
    ///
    /// A controller that lets a frame go for a more urgent one gives it back; it is then the
    /// oldest again. An error ends the turn: the frame stays for the next one, where newer ones
    /// may have pushed it out.
    pub fn service<C: Can<Frame = F>>(&mut self, controller: &mut C) -> usize {
        let mut taken = 0;
        // One turn has as many tries as the queue places, whatever the controller gives back.
        for _ in 0..N {
            let Some(frame) = self.frames.front() else { break };
            match controller.transmit(frame) {
                Ok(None) => {
                    let _ = self.frames.pop_front();
                    taken += 1;
                }
                Ok(Some(returned)) => {
                    let _ = self.frames.pop_front();
                    // The place that has just become free.
                    let _ = self.frames.push_front(returned);
                }
                Err(nb::Error::WouldBlock) => break,
                Err(nb::Error::Other(_)) => {
                    self.errors = self.errors.saturating_add(1);
                    break;
                }
            }
        }
        taken
    }

    /// Returns the number of frames that wait.
    #[must_use]
    pub fn len(&self) -> usize {
        self.frames.len()
    }

    /// Returns whether no frame waits.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.frames.is_empty()
    }

    /// Returns the number of frames that gave way to newer ones.
    #[must_use]
    pub fn dropped(&self) -> u32 {
        self.dropped
    }

    /// Returns the number of turns that ended with an error of the controller.
    #[must_use]
    pub fn errors(&self) -> u32 {
        self.errors
    }
}
