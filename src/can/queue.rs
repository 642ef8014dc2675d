//! A data frame that is independent of a driver's type, and a queue of frames for the bus, which never blocks.
//!
//! A bus that is off or overloaded must not stop the pipeline, and a receiver has no use for stale rates: a full queue
//! drops the oldest frame and counts it. A receiver sees the gap in the message counters.

use embedded_can::nb::Can;
use embedded_can::{Frame, Id};
use heapless::Deque;

/// A queue of at most `N` frames that drops the oldest frame when it is full.
#[derive(Debug, Clone)]
pub struct TransmitQueue<F, const N: usize> {
    frames: Deque<F, N>,
    dropped: u32,
}

impl<F, const N: usize> Default for TransmitQueue<F, N> {
    fn default() -> Self {
        Self::new()
    }
}

impl<F, const N: usize> TransmitQueue<F, N> {
    /// Creates an empty queue.
    pub const fn new() -> Self {
        const { assert!(N > 0, "a queue holds at least one frame") };
        Self { frames: Deque::new(), dropped: 0 }
    }

    /// Appends a frame; if the queue is full, drops the oldest one.
    pub fn enqueue(&mut self, frame: F) {
        if self.frames.is_full() {
            let _ = self.frames.pop_front();
            self.dropped = self.dropped.saturating_add(1);
        }
        // Cannot fail: the queue has room now.
        let _ = self.frames.push_back(frame);
    }

    /// Counts a frame that the queue cannot hold as dropped.
    pub(crate) fn refuse(&mut self) {
        self.dropped = self.dropped.saturating_add(1);
    }

    /// Returns the oldest frame.
    pub fn front(&self) -> Option<&F> {
        self.frames.front()
    }

    /// Drops the oldest frame and counts it.
    pub fn drop_front(&mut self) {
        if self.frames.pop_front().is_some() {
            self.dropped = self.dropped.saturating_add(1);
        }
    }

    /// Removes and returns the oldest frame, which a transport accepts or has accepted.
    pub fn pop(&mut self) -> Option<F> {
        self.frames.pop_front()
    }

    /// Passes frames to the controller until it accepts no more; returns how many. A pending frame that a more urgent
    /// one replaced goes back to the front. After an error the frame stays, unless newer ones push it out.
    pub fn service<C: Can<Frame = F>>(&mut self, controller: &mut C) -> usize {
        let mut taken = 0;
        // At most N tries, whatever the controller returns.
        for _ in 0..N {
            let Some(frame) = self.frames.front() else { break };
            match controller.transmit(frame) {
                Ok(None) => {
                    let _ = self.frames.pop_front();
                    taken += 1;
                }
                Ok(Some(returned)) => {
                    let _ = self.frames.pop_front();
                    // Cannot fail: a place has just become free.
                    let _ = self.frames.push_front(returned);
                }
                Err(_) => break,
            }
        }
        taken
    }

    /// Returns the number of waiting frames.
    pub fn len(&self) -> usize {
        self.frames.len()
    }

    /// Returns whether the queue is empty.
    pub fn is_empty(&self) -> bool {
        self.frames.is_empty()
    }

    /// Returns the number of dropped frames.
    pub fn dropped(&self) -> u32 {
        self.dropped
    }
}

/// A classic CAN data frame: identifier and up to eight bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct DataFrame {
    id: Id,
    data: [u8; 8],
    len: u8,
}

impl DataFrame {
    /// Returns the data, followed by zeros.
    pub const fn padded(&self) -> &[u8; 8] {
        &self.data
    }

    /// Converts the frame to a driver's own type; `None` if that type cannot hold the frame.
    pub fn convert<F: Frame>(&self) -> Option<F> {
        F::new(self.id(), self.data())
    }
}

impl Frame for DataFrame {
    fn new(id: impl Into<Id>, data: &[u8]) -> Option<Self> {
        let mut bytes = [0; 8];
        bytes.get_mut(..data.len())?.copy_from_slice(data);
        Some(Self { id: id.into(), data: bytes, len: data.len() as u8 })
    }

    /// Returns `None`: remote frames carry no data and are not supported.
    fn new_remote(_id: impl Into<Id>, _dlc: usize) -> Option<Self> {
        None
    }

    fn is_extended(&self) -> bool {
        matches!(self.id, Id::Extended(_))
    }

    fn is_remote_frame(&self) -> bool {
        false
    }

    fn id(&self) -> Id {
        self.id
    }

    fn dlc(&self) -> usize {
        usize::from(self.len)
    }

    fn data(&self) -> &[u8] {
        self.data.get(..usize::from(self.len)).unwrap_or_default()
    }
}
