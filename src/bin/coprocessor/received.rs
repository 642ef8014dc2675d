//! Frames that the bus has brought, from its handler to the output task.

use crate::queue::Queue;
use core::sync::atomic::{AtomicU32, Ordering};
use embedded_can::{Frame as _, Id};
use gyronet::can::DataFrame;

/// Of wheels alone, for which there is a turn every millisecond.
pub static FRAMES: Queue<DataFrame, 8> = Queue::new();
/// Frames that found no room, in the controller or here. The handler alone counts.
static LOST: AtomicU32 = AtomicU32::new(0);

/// What a controller gives of the oldest frame that has come.
pub struct Received {
    /// `None`: no data frame.
    pub frame: Option<DataFrame>,
    /// One was lost before it, at least.
    pub lost: bool,
}

impl Received {
    /// From an identifier (`None`: not a data frame's), the words of data and how many bytes count.
    pub fn new(id: Option<Id>, [low, high]: [u32; 2], length: u32, lost: bool) -> Self {
        let data = (u64::from(high) << 32 | u64::from(low)).to_le_bytes();
        let bytes = data.get(..length.min(8) as usize).unwrap_or_default();
        Self { frame: id.and_then(|id| DataFrame::new(id, bytes)), lost }
    }
}

/// The handler: takes whatever has come.
pub fn take(mut receive: impl FnMut() -> Option<Received>) {
    while let Some(Received { frame, lost }) = receive() {
        let full = frame.is_some_and(|frame| !FRAMES.push(frame));
        let lost = LOST.load(Ordering::Relaxed).saturating_add(u32::from(lost) + u32::from(full));
        LOST.store(lost, Ordering::Relaxed);
    }
}

/// Frames lost since the start. A controller does not say how many it has lost at once: it counts
/// as one.
pub fn lost() -> u32 {
    LOST.load(Ordering::Relaxed)
}
