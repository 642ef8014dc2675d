//! This module computes the worst-case response time of every task of the image from its cost and activation rate,
//! for fixed priorities (Joseph and Pandya 1986; Audsley and others 1993).
//!
//! Deadlines are checked with the cycles that include wait states, and each activation starts with empty caches. A
//! task's cost includes the delay of the task that it preempts, which must read again as many lines as the task
//! loaded into the caches. (A loop that fills the entire cache could lose more lines; the kernels' loops do not.)

mod cost;
mod demands;
mod table;
#[cfg(test)]
mod tests;

use crate::target::parser_load::CLOCK_HZ;
use crate::target::tasks::{Cycles, Handler, Tasks};
use demands::{Burst, DEMANDS, Demand, FRAMES_LATE, LAST};

/// Share of a deadline that must remain unused.
const SPARE: f64 = 0.25;
/// The idle task blocks priorities up to this one while it accesses data that it shares with the output task.
const SHARED: u8 = 2;

/// Holds a task and its response times.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Task {
    /// Name of the task.
    pub name: &'static str,
    /// Priority; higher is more urgent.
    pub priority: u8,
    /// Shortest time between two activations, us.
    pub period_us: f64,
    /// Limit of the activations in a burst.
    #[serde(skip)]
    burst: Option<Burst>,
    /// Cycles of each of many activations; less than the worst if the worst one does the work of several.
    #[serde(skip)]
    each: Cycles,
    /// Deadline, us.
    pub deadline_us: f64,
    /// Event that sets the deadline.
    pub why: &'static str,
    /// Number of counted activations; if 0, the task never ran, and its cost is a bound from its code.
    pub runs: u64,
    /// Instructions of the longest activation.
    pub instructions: u64,
    /// Worst-case cycles per period, modelled at zero wait states, with entry and exit.
    pub cycles: u64,
    /// Worst-case cycles per period with wait states, and with the cost to the preempted task.
    pub cycles_5ws: u64,
    /// Worst-case response at zero wait states, us; `None` if later than ten times the deadline.
    pub response_us: Option<f64>,
    /// Worst-case response with wait states, us.
    pub response_5ws_us: Option<f64>,
}

impl Task {
    /// Returns whether the task always meets its deadline with a quarter of the deadline to spare.
    #[must_use]
    pub fn met(&self) -> bool {
        self.response_5ws_us.is_some_and(|response| response <= (1.0 - SPARE) * self.deadline_us)
    }

    /// Returns the task's share of the processor's time, with wait states.
    #[must_use]
    pub fn share(&self) -> f64 {
        let period = self.burst.map_or(self.period_us, |Burst { count, span, .. }| span / count);
        self.each.five as f64 / (period * 1e-6 * CLOCK_HZ)
    }

    /// Returns the largest number of activations within a time, us.
    fn within(&self, time: f64) -> f64 {
        let most = (time / self.period_us).ceil();
        self.burst
            .map_or(most, |Burst { count, span, jitter }| most.min(((time + jitter) / span).ceil() * count))
    }
}

/// Holds the response times of all tasks.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Schedule(pub Vec<Task>);

impl Schedule {
    /// Computes the schedule from the counts. `fognet` holds the instructions and cycles of one of FoGNet's windows,
    /// which the idle task runs piece by piece. Returns `None` if the image has a task that is not in the table of
    /// demands.
    #[must_use]
    pub fn new(tasks: &Tasks, fognet: Option<(u64, Cycles)>) -> Option<Self> {
        let Tasks { handlers, all_off, some_off } = tasks;
        let known = |handler: &Handler| {
            LAST.contains(&&*handler.name) || DEMANDS.iter().any(|demand| demand.handler == handler.name)
        };
        if !handlers.iter().all(known) {
            return None;
        }
        let task = |demand: &Demand| {
            let handler = handlers.iter().find(|handler| handler.name == demand.handler)?;
            let (runs, instructions, cycles) = demand.cost.of(handler);
            let each = demand.cost.each(handler).unwrap_or(cycles);
            Some(Task {
                name: demand.name,
                priority: handler.priority,
                period_us: demand.period,
                burst: demand.burst,
                each,
                deadline_us: demand.deadline,
                why: demand.why,
                runs,
                instructions,
                cycles: cycles.zero,
                cycles_5ws: cycles.five,
                response_us: None,
                response_5ws_us: None,
            })
        };
        let mut tasks: Vec<Task> = DEMANDS.iter().filter_map(task).chain(fognet.map(in_idle)).collect();
        for k in 0..tasks.len() {
            let blocked = if tasks[k].priority > SHARED { *all_off } else { all_off.max(*some_off) };
            tasks[k].response_us = response(&tasks, k, blocked.zero, |task| [task.cycles, task.each.zero]);
            tasks[k].response_5ws_us =
                response(&tasks, k, blocked.five, |task| [task.cycles_5ws, task.each.five]);
        }
        Some(Self(tasks))
    }

    /// Returns whether every task always meets its deadline, and frames are not delayed by more than assumed.
    #[must_use]
    pub fn met(&self) -> bool {
        let output = self.0.iter().filter(|task| task.name == "output");
        let late = output.filter_map(|task| task.response_5ws_us).any(|us| us > FRAMES_LATE - 1e3);
        !late && self.0.iter().all(Task::met)
    }

    /// Returns the share of the processor's time that all tasks use together.
    #[must_use]
    pub fn share(&self) -> f64 {
        self.0.iter().map(Task::share).sum()
    }
}

/// Returns the row of FoGNet's window, which runs in the time that all other tasks leave. A window begins with each
/// second, and its estimate is used in the next second.
fn in_idle((instructions, cycles): (u64, Cycles)) -> Task {
    Task {
        name: "fognet",
        priority: 0,
        period_us: 1e6,
        burst: None,
        each: cycles,
        deadline_us: 1e6,
        why: "used with the next second",
        runs: 1,
        instructions,
        cycles: cycles.zero,
        cycles_5ws: cycles.five,
        response_us: None,
        response_5ws_us: None,
    }
}

/// Returns the worst-case response of a task, us: its own cost, its blocking, and all activations of equally or more
/// urgent tasks that can occur meanwhile. `cost` returns the cycles of the worst activation and of each of many.
fn response(tasks: &[Task], k: usize, blocked: u64, cost: fn(&Task) -> [u64; 2]) -> Option<f64> {
    let own = &tasks[k];
    let us = |cycles: u64| cycles as f64 / CLOCK_HZ * 1e6;
    let alone = us(cost(own)[0] + blocked);
    let mut response = alone;
    while response <= 10.0 * own.deadline_us {
        let others = tasks.iter().enumerate().filter(|(j, other)| *j != k && other.priority >= own.priority);
        let meanwhile = others.map(|(_, other)| {
            let [worst, each] = cost(other);
            us(worst) + (other.within(response) - 1.0) * us(each)
        });
        let next = alone + meanwhile.sum::<f64>();
        if next <= response {
            return Some(response);
        }
        response = next;
    }
    None
}
