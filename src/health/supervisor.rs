//! The supervisor collects the reports of the tasks, because the watchdog is fed only when all of them have run.

use core::sync::atomic::{AtomicU8, Ordering};

/// A task that has to report; the output task checks the reports.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
pub enum Task {
    /// The board's clock.
    Tick = 1,
    /// The network's task, which also reports when it has nothing to do.
    Window = 1 << 1,
    /// The idle task.
    Idle = 1 << 2,
}

/// Collects reports. It may be shared between tasks of all priorities.
#[derive(Debug, Default)]
pub struct Supervisor(AtomicU8);

impl Supervisor {
    const ALL: u8 = Task::Tick as u8 | Task::Window as u8 | Task::Idle as u8;

    /// Creates a supervisor without reports.
    #[must_use]
    pub const fn new() -> Self {
        Self(AtomicU8::new(0))
    }

    /// Notes that a task has completed a cycle.
    pub fn report(&self, task: Task) {
        self.0.fetch_or(task as u8, Ordering::Relaxed);
    }

    /// Returns true if every task has reported since the last call that returned true; a new cycle then begins.
    pub fn complete(&self) -> bool {
        self.0.compare_exchange(Self::ALL, 0, Ordering::Relaxed, Ordering::Relaxed).is_ok()
    }
}
