//! Passes received CAN frames from the receive interrupt to the output task, or to idle if they are requests of a
//! tester.
#![allow(unsafe_code, reason = "rings with one task at each end; each block names them")]

use crate::diagnosis::{self, FROM_CAN};
use crate::ring::Ring;
use crate::stm32f405::can::{self, Received};
use core::sync::atomic::{AtomicU32, Ordering};
use embedded_can::Frame as _;
use gyronet::can::DataFrame;

/// Waiting wheel and latitude frames; the output task reads them every millisecond.
pub static FRAMES: Ring<DataFrame, 8> =
    // SAFETY: the receive interrupt writes, the output task reads.
    unsafe { Ring::new() };
/// Number of frames that found no room, in the controller or here. Only the handler counts.
static LOST: AtomicU32 = AtomicU32::new(0);

/// Handles the receive interrupt: takes every received frame.
pub fn take() {
    while let Some(Received { frame, lost }) = can::receive() {
        let full = frame.is_some_and(|frame| !push(frame));
        let lost = LOST.load(Ordering::Relaxed).saturating_add(u32::from(lost) + u32::from(full));
        LOST.store(lost, Ordering::Relaxed);
    }
}

/// Queues a frame for its task. Returns whether there was room.
fn push(frame: DataFrame) -> bool {
    if diagnosis::is_request(frame.id()) { FROM_CAN.push(frame) } else { FRAMES.push(frame) }
}

/// Returns the number of frames lost since the start. The controller does not count how many it loses at once, so
/// those count as one.
pub fn lost() -> u32 {
    LOST.load(Ordering::Relaxed)
}
