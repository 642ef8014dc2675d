//! Announces on the buses that they will be silent, because the flash is erased or the board restarts.
//!
//! Idle requests the announcement and waits for it; from then on the output task sends message sets without a rate,
//! until idle's work is done. A receiver can tell from them that the silence is intended.

use crate::stm32f405::timer;
use core::sync::atomic::{AtomicU8, Ordering};

/// In this state, the output task sends rates.
const RUNNING: u8 = 0;
/// In this state, idle waits for the announcement.
const REQUESTED: u8 = 1;
/// In this state, a message set without a rate has been queued.
const ANNOUNCED: u8 = 2;
/// Limits how long idle waits for the output task's announcement, us.
const ANNOUNCE_US: u64 = 20_000;
/// Time for the frames to be sent, us; six frames take 1.7 ms.
const LEAVE_US: u64 = 5_000;
/// Limits how often a wait reads the timer, so that it ends even if the timer stands still.
const POLLS: u32 = 1_000_000;

static STATE: AtomicU8 = AtomicU8::new(RUNNING);

/// Announces that the buses will be silent, then runs `work`, which silences them. Idle calls this.
pub fn with_silence_announced<T>(work: impl FnOnce() -> T) -> T {
    STATE.store(REQUESTED, Ordering::Relaxed);
    wait(ANNOUNCE_US, || STATE.load(Ordering::Relaxed) == ANNOUNCED);
    wait(LEAVE_US, || false);
    let result = work();
    STATE.store(RUNNING, Ordering::Relaxed);
    result
}

/// Returns whether rates are withheld now. The output task calls this, and first sends a message set without a rate.
pub fn is_requested() -> bool {
    STATE.load(Ordering::Relaxed) != RUNNING
}

/// Reports to idle that the announcement has been queued. The output task calls this.
pub fn announce() {
    let _ = STATE.compare_exchange(REQUESTED, ANNOUNCED, Ordering::Relaxed, Ordering::Relaxed);
}

/// Waits until `over` returns true, or `us` microseconds have passed.
fn wait(us: u64, over: impl Fn() -> bool) {
    let until = timer::micros() + us;
    let _ = (0..POLLS).any(|_| over() || timer::micros() >= until);
}
