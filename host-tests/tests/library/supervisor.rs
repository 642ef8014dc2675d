//! The watchdog is fed only when every task has run.

use gyronet::health::supervisor::{Supervisor, Task};

const TASKS: [Task; 3] = [Task::Tick, Task::Window, Task::Idle];
/// Turns of the output task, 1 ms each.
const TURNS: u32 = 20_000;
/// The time that the watchdog allows.
const BITES_AFTER: u32 = 4_000;

/// Turn at which the watchdog bites when `hangs` does so at `at`, ms.
fn bites(hangs: Option<Task>, at: u32, idle_every: u32) -> Option<u32> {
    let supervisor = Supervisor::new();
    let mut fed = 0;
    for turn in 0..TURNS {
        for task in TASKS {
            let due = task != Task::Idle || turn % idle_every == 0;
            if due && (hangs != Some(task) || turn < at) {
                supervisor.report(task);
            }
        }
        if supervisor.complete() {
            fed = turn;
        }
        if turn - fed > BITES_AFTER {
            return Some(turn);
        }
    }
    None
}

#[test]
fn healthy_tasks_feed_it() {
    assert_eq!(bites(None, 0, 1), None);
    // On the reset clock idle has its turn only between windows.
    assert_eq!(bites(None, 0, 1_000), None);
}

#[test]
fn any_task_that_hangs_is_bitten() {
    for task in TASKS {
        for at in [0, 1, 5_000] {
            let bitten = bites(Some(task), at, 1).unwrap_or_else(|| panic!("{task:?} hangs unseen"));
            assert!((at..=at + BITES_AFTER + 1).contains(&bitten), "{task:?}: {bitten}");
        }
    }
}
