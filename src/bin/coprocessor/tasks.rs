//! What the tasks ask of one another: to run, to report to the watchdog, and to announce that the buses will be silent.
//!
//! They are silent while the flash is erased or the board restarts. Idle requests the announcement and waits for it; from
//! then on the output task sends message sets without a rate, until idle's work is done. A receiver can tell from them that
//! the silence is intended.

use crate::stm32f405::pac::Interrupt;
use crate::stm32f405::{timer, watchdog};
use core::sync::atomic::{AtomicBool, AtomicU8, AtomicU32, Ordering};

/// Time until which the tick runs the output task for received bytes only, us.
pub static QUIET_UNTIL: AtomicU32 = AtomicU32::new(0);

/// Returns whether the output task is to run at `now`, us, even if nothing has come.
#[inline]
pub fn is_output_due(now: u32) -> bool {
    now.wrapping_sub(QUIET_UNTIL.load(Ordering::Relaxed)) as i32 >= 0
}

/// Runs the output task now and with the next tick: something other than an input waits for it.
pub fn wake_output() {
    QUIET_UNTIL.store(timer::micros() as u32, Ordering::Relaxed);
    rtic::pend(Interrupt::SPI3);
}

/// Longest time from one step of idle to the next without an input or a request, ms.
pub const IDLE_STEP_MS: u32 = 10;
pub static ATTENTION: AtomicBool = AtomicBool::new(false);

/// Returns whether idle has work.
pub fn is_idle_due() -> bool {
    ATTENTION.load(Ordering::Relaxed)
}

/// Lets idle work when it next runs: a tester is being served, an observation or a frame has come, or [`IDLE_STEP_MS`]
/// have passed.
pub fn wake_idle() {
    ATTENTION.store(true, Ordering::Relaxed);
}

/// A task that has to report: the watchdog is fed only when all of them have run.
#[derive(Clone, Copy)]
#[repr(u8)]
pub enum Task {
    Tick = 1,
    /// The network's task, which also reports when it has nothing to do.
    Window = 1 << 1,
    Idle = 1 << 2,
}

const ALL_TASKS: u8 = Task::Tick as u8 | Task::Window as u8 | Task::Idle as u8;
static REPORTS: AtomicU8 = AtomicU8::new(0);

pub fn report(task: Task) {
    REPORTS.fetch_or(task as u8, Ordering::Relaxed);
}

/// Feeds the watchdog once every task has reported, which begins a new cycle.
pub fn feed_watchdog() {
    if REPORTS.compare_exchange(ALL_TASKS, 0, Ordering::Relaxed, Ordering::Relaxed).is_ok() {
        watchdog::feed();
    }
}

/// The output task sends rates.
const RUNNING: u8 = 0;
/// Idle waits for the announcement.
const REQUESTED: u8 = 1;
/// A message set without a rate has been queued.
const ANNOUNCED: u8 = 2;
/// Limits how long idle waits for the output task's announcement, us.
const ANNOUNCE_US: u64 = 20_000;
/// Time for the frames to be sent, us; six frames take 1.7 ms. Then each millisecond shows whether one is stale.
pub const LEAVE_US: u64 = 5_000;
/// More interrupts than come in a millisecond, so that a wait ends even if the timer stands still.
const WAKES_PER_MS: u64 = 1_000;

static STATE: AtomicU8 = AtomicU8::new(RUNNING);

/// Announces that the buses will be silent, then runs `work`, which silences them. Idle calls this.
pub fn with_silence_announced<T>(work: impl FnOnce() -> T) -> T {
    STATE.store(REQUESTED, Ordering::Relaxed);
    wake_output();
    wait(ANNOUNCE_US, || STATE.load(Ordering::Relaxed) == ANNOUNCED);
    wait(LEAVE_US, || false);
    let result = work();
    STATE.store(RUNNING, Ordering::Relaxed);
    result
}

pub fn is_silence_requested() -> bool {
    STATE.load(Ordering::Relaxed) != RUNNING
}

/// Notes that the announcement has been queued.
pub fn silence_announced() {
    let _ = STATE.compare_exchange(REQUESTED, ANNOUNCED, Ordering::Relaxed, Ordering::Relaxed);
}

/// Waits, asleep between interrupts, until `over` returns true or `us` microseconds have passed. Idle calls this.
pub fn wait(us: u64, over: impl Fn() -> bool) {
    let until = timer::micros() + us;
    let _ = (0..(us / 1_000 + 1) * WAKES_PER_MS).any(|_| {
        let over = over() || timer::micros() >= until;
        if !over {
            cortex_m::asm::wfi();
        }
        over
    });
}
