//! The supervisor collects the reports of the tasks, because the watchdog is fed only when all of them have run.

use core::sync::atomic::{AtomicU8, Ordering};

/// A task beside the output task, which asks.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
pub enum Task {
    /// The board's clock.
    Tick = 1,
    /// The network's task: it reports when it has nothing to do, too.
    Window = 1 << 1,
    /// The idle task.
    Idle = 1 << 2,
}

/// Collects reports. It may be shared between tasks of all priorities.
#[derive(Debug, Default)]
pub struct Supervisor(AtomicU8);

impl Supervisor {
    const ALL: u8 = Task::Tick as u8 | Task::Window as u8 | Task::Idle as u8;

    /// Begins before any task has run.
    #[must_use]
    pub const fn new() -> Self {
        Self(AtomicU8::new(0))
    }

    /// Notes that a task has done a whole turn.
    pub fn report(&self, task: Task) {
        self.0.fetch_or(task as u8, Ordering::Relaxed);
    }

    /// Returns true once every task has reported since it last did so; a new cycle begins then.
    pub fn complete(&self) -> bool {
        self.0.compare_exchange(Self::ALL, 0, Ordering::Relaxed, Ordering::Relaxed).is_ok()
    }
}
