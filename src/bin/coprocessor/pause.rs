//! Announces on the buses that an erase of the flash will silence them.
//!
//! Idle asks for the announcement and waits for it; the output task sends message sets without a rate from then on,
//! until idle has erased. A receiver then knows that the silence is meant.

use crate::stm32f405::timer;
use core::sync::atomic::{AtomicU8, Ordering};

/// Rates are sent.
const RUNNING: u8 = 0;
/// Idle waits for the announcement.
const REQUESTED: u8 = 1;
/// A message set without a rate has been queued.
const ANNOUNCED: u8 = 2;
/// Time in which the output task announces, and in which the frames leave: six take 1.7 ms, us.
const ANNOUNCE_US: u64 = 20_000;
const LEAVE_US: u64 = 5_000;
/// Looks at the time before a wait is given up, should it stand still.
const LOOKS: u32 = 1_000_000;

static STATE: AtomicU8 = AtomicU8::new(RUNNING);

/// Does something that silences the buses, once that is announced. For idle.
pub fn announced<T>(work: impl FnOnce() -> T) -> T {
    STATE.store(REQUESTED, Ordering::Relaxed);
    wait(ANNOUNCE_US, || STATE.load(Ordering::Relaxed) == ANNOUNCED);
    wait(LEAVE_US, || false);
    let result = work();
    STATE.store(RUNNING, Ordering::Relaxed);
    result
}

/// Returns whether rates are withheld now. For the output task, which sends a message set without a rate first.
pub fn is_requested() -> bool {
    STATE.load(Ordering::Relaxed) != RUNNING
}

/// Reports to idle that the announcement is on its way. For the output task.
pub fn announce() {
    let _ = STATE.compare_exchange(REQUESTED, ANNOUNCED, Ordering::Relaxed, Ordering::Relaxed);
}

/// Waits for something, up to a time.
fn wait(us: u64, over: impl Fn() -> bool) {
    let until = timer::micros() + us;
    let _ = (0..LOOKS).any(|_| over() || timer::micros() >= until);
}
