//! Whether every task of the image meets its deadline, from what each costs and how often it can
//! come: response times for fixed priorities (Joseph and Pandya 1986; Audsley and others 1993).

use crate::parser_load::CLOCK_HZ;
use crate::task_bench::{Activation, Handler, Tasks};
use std::fmt;

/// Cycles of entering and leaving a handler: 12 and 10 (Cortex-M4 TRM, 3.9.1), and 17 words of
/// floating-point registers each way.
const EXCEPTION: u64 = 12 + 10 + 2 * 17;
/// What idle shares, it shares with the output task: only tasks up to its priority wait for it.
const SHARED: u8 = 2;
/// Cycles of a copy of a frame and what is around it, outside of the code of `can_frames` itself.
const COPY: u64 = 150;
/// Ten bits at 115200 and at 921600 bit/s, us.
const BYTE_115200: f64 = 10e6 / 115_200.0;
const BYTE_921600: f64 = 10e6 / 921_600.0;
/// The shortest frame at 500 kbit/s: 47 bits.
const FRAME: f64 = 47.0 / 0.5;

/// How the cost of a task is found.
enum Cost {
    /// The worst activation of all.
    Worst,
    /// The worst one that has moved no more bytes than a real line does in one: one in, two out. The
    /// emulated line takes all that there is.
    Bytes,
    /// The worst activation with one sample, the worst without, the cheapest one as often as the
    /// part's bytes pend it, and a look at all lines with every tick: the emulated line brings many
    /// bytes at a time.
    Sample,
}

/// Times in 10 ms that the output task is pended and finds nothing to do: the bytes of a sample, a window's end.
const TURNS: u64 = 115 + 1;
/// Ticks in 10 ms, and what a turn that looks at every line and finds nothing takes at most. At 6d4040a, where
/// every turn did so, `cargo bench-target` gave 1,406 cycles as the cheapest one.
const TICKS: u64 = 10;
const LOOK: u64 = 1_500;

/// What is asked of a task.
struct Demand {
    name: &'static str,
    handler: &'static str,
    cost: Cost,
    /// Shortest time between two, us.
    period: f64,
    /// And so many in so long, us, at most.
    burst: Option<(f64, f64)>,
    /// From when it is due to when it must be done, us.
    deadline: f64,
    why: &'static str,
}

/// All tasks of `coprocessor`, with everything configured and connected; an image without one of them does
/// not have its row.
const DEMANDS: [Demand; 8] = [
    byte("imu_line", "USART1", BYTE_115200),
    // Messages of up to 47 bytes, 1000 a second.
    Demand { burst: Some((47.0, 1e3)), ..byte("fog_line", "USART3", BYTE_921600) },
    demand("tick", "SysTick", Cost::Worst, 1e3, 1e3, "the next tick"),
    // In 10 ms, with their stamps: nine frames of 26 characters and VDC2's 31 out; four wheel frames of 22 in.
    Demand { burst: Some((353.0, 1e4)), ..byte("slcan_line", "USART2", BYTE_921600) },
    byte("service_line", "USART6", BYTE_115200),
    demand("can_frames", "CAN1_RX0", Cost::Worst, FRAME, 3.0 * FRAME, "three frames fill the controller"),
    demand("output", "UART4", Cost::Sample, 1e4, 1e4, "the next sample"),
    demand("window", "UART5", Cost::Worst, 5e4, 2e4, "used two samples later"),
];

const fn demand(
    name: &'static str,
    handler: &'static str,
    cost: Cost,
    period: f64,
    deadline: f64,
    why: &'static str,
) -> Demand {
    Demand { name, handler, cost, period, burst: None, deadline, why }
}

/// A line at full speed: each byte is gone when the next one is there.
const fn byte(name: &'static str, handler: &'static str, period: f64) -> Demand {
    demand(name, handler, Cost::Bytes, period, period, "the next byte")
}

impl Cost {
    /// Activations, instructions and modelled cycles.
    fn of(&self, handler: &Handler) -> Activation {
        let kinds = if let Self::Bytes = self { 4 } else { handler.activations.len() };
        let ran = || handler.activations.iter().take(kinds).flatten();
        let most = |of: fn(&Activation) -> u64| ran().map(of).max();
        let runs = ran().map(|activation| activation.runs).sum();
        let (instructions, cycles) = match (most(|ran| ran.instructions), most(|ran| ran.cycles)) {
            (Some(instructions), Some(cycles)) => (instructions, cycles),
            // Code that never ran: each instruction once, at three cycles.
            _ => (handler.code, 3 * handler.code + COPY),
        };
        match self {
            Self::Worst | Self::Bytes => Activation { runs, instructions, cycles },
            Self::Sample => {
                let kind = |kind: usize| handler.activations[kind].map(|ran| ran.cycles);
                // On a host that is too slow to send one by one, the worst of several.
                let sample = kind(1).unwrap_or(cycles) + kind(0).unwrap_or_default();
                let idle = TURNS * (handler.least + EXCEPTION) + TICKS * (LOOK + EXCEPTION);
                Activation { runs, instructions, cycles: sample + idle }
            }
        }
    }
}

/// One task with its answer.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Task {
    /// As the image names it.
    pub name: &'static str,
    /// The larger the more urgent.
    pub priority: u8,
    /// Shortest time between two activations, us.
    pub period_us: f64,
    /// And so many in so long, us, at most.
    #[serde(skip)]
    burst: Option<(f64, f64)>,
    /// Longest that an answer may take, us.
    pub deadline_us: f64,
    /// What the deadline is.
    pub why: &'static str,
    /// Activations that were counted; 0: none ran, and the cost is a bound from its code.
    pub runs: u64,
    /// Of the longest activation.
    pub instructions: u64,
    /// In a period at worst, modelled, with entry and exit.
    pub cycles: u64,
    /// Worst response, us; `None`: later than ten times its deadline.
    pub response_us: Option<f64>,
}

impl Task {
    /// Whether it is always done in time.
    #[must_use]
    pub fn met(&self) -> bool {
        self.response_us.is_some_and(|response| response <= self.deadline_us)
    }

    /// Part of the processor.
    #[must_use]
    pub fn share(&self) -> f64 {
        let period = self.burst.map_or(self.period_us, |(count, span)| span / count);
        self.cycles as f64 / (period * 1e-6 * CLOCK_HZ)
    }

    /// Most activations in a time, us.
    fn within(&self, time: f64) -> f64 {
        let most = (time / self.period_us).ceil();
        self.burst.map_or(most, |(count, span)| most.min(((time / span).ceil() + 1.0) * count))
    }
}

/// The table.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Schedule(pub Vec<Task>);

impl Schedule {
    /// From what was counted. `None`: the image has a task that is not in the table.
    #[must_use]
    pub fn new(tasks: &Tasks) -> Option<Self> {
        let Tasks { handlers, all_off, some_off } = tasks;
        let known = |handler: &Handler| DEMANDS.iter().any(|demand| demand.handler == handler.name);
        if !handlers.iter().all(known) {
            return None;
        }
        let task = |demand: &Demand| {
            let handler = handlers.iter().find(|handler| handler.name == demand.handler)?;
            let Activation { runs, instructions, cycles } = demand.cost.of(handler);
            Some(Task {
                name: demand.name,
                priority: handler.priority,
                period_us: demand.period,
                burst: demand.burst,
                deadline_us: demand.deadline,
                why: demand.why,
                runs,
                instructions,
                cycles: cycles + EXCEPTION,
                response_us: None,
            })
        };
        let mut tasks: Vec<Task> = DEMANDS.iter().filter_map(task).collect();
        let blocked = |task: &Task| if task.priority > SHARED { *all_off } else { *all_off.max(some_off) };
        let answers: Vec<_> = (0..tasks.len()).map(|k| response(&tasks, k, blocked(&tasks[k]))).collect();
        for (task, answer) in tasks.iter_mut().zip(answers) {
            task.response_us = answer;
        }
        Some(Self(tasks))
    }

    /// Whether every task is always done in time.
    #[must_use]
    pub fn met(&self) -> bool {
        self.0.iter().all(Task::met)
    }

    /// Part of the processor that all tasks take together.
    #[must_use]
    pub fn share(&self) -> f64 {
        self.0.iter().map(Task::share).sum()
    }
}

/// Worst response of a task, us: its own cost, what blocks it, and every activation of what is as
/// urgent or more so that can come meanwhile.
fn response(tasks: &[Task], k: usize, blocked: u64) -> Option<f64> {
    let own = &tasks[k];
    let us = |cycles: u64| cycles as f64 / CLOCK_HZ * 1e6;
    let mut response = us(own.cycles + blocked);
    while response <= 10.0 * own.deadline_us {
        let others = tasks.iter().enumerate().filter(|(j, other)| *j != k && other.priority >= own.priority);
        let meanwhile = others.map(|(_, other)| other.within(response) * us(other.cycles));
        let next = us(own.cycles + blocked) + meanwhile.sum::<f64>();
        if next <= response {
            return Some(response);
        }
        response = next;
    }
    None
}

impl fmt::Display for Schedule {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(
            f,
            "{:<15}{:>5}{:>11}{:>12}{:>13}{:>11}{:>8}{:>13}{:>9}  deadline is",
            "task",
            "prio",
            "period us",
            "deadline us",
            "instructions",
            "cycles",
            "load",
            "response us",
            "margin"
        )?;
        for task in &self.0 {
            let Task { name, priority, period_us, deadline_us, instructions, cycles, why, .. } = task;
            write!(
                f,
                "{name:<15}{priority:>5}{period_us:>11.1}{deadline_us:>12.1}{instructions:>13}{cycles:>11}"
            )?;
            write!(f, "{:>7.2}%", task.share() * 100.0)?;
            match task.response_us {
                Some(response) => {
                    let margin = (1.0 - response / deadline_us) * 100.0;
                    write!(f, "{response:>13.1}{margin:>8.1}%")?;
                }
                None => write!(f, "{:>13}{:>9}", "never", "-")?,
            }
            let missed = if task.met() { "" } else { ": MISSED" };
            let bound = if task.runs == 0 { " (never ran here: a bound from its code)" } else { "" };
            write!(f, "  {why}{missed}{bound}")?;
            if let Some((count, span)) = task.burst {
                write!(f, "; {count} in {} ms", span / 1e3)?;
            }
            writeln!(f)?;
        }
        write!(f, "all tasks: {:.1} % of {:.0} MHz", self.share() * 100.0, CLOCK_HZ * 1e-6)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::task_bench::KINDS;

    fn handler(name: &str, priority: u8, cycles: Option<u64>) -> Handler {
        let ran =
            cycles.map(|cycles| Activation { runs: 1, instructions: cycles, cycles: cycles - EXCEPTION });
        Handler {
            name: name.to_owned(),
            priority,
            activations: [
                ran,
                None,
                None,
                None,
                Some(Activation { runs: 1, instructions: 9, cycles: 1_000_000 }),
            ],
            least: 168 - EXCEPTION,
            code: 100,
        }
    }

    fn tasks(window: u64) -> Tasks {
        let mut handlers = vec![
            handler("USART1", 4, Some(168)),
            handler("SysTick", 4, Some(168)),
            handler("USART2", 3, Some(168)),
            handler("USART6", 3, Some(168)),
            handler("CAN1_RX0", 3, None),
            handler("UART4", 2, Some(168 * 40)),
            handler("UART5", 1, Some(window)),
        ];
        for other in handlers.iter_mut().filter(|handler| !handler.name.starts_with("USART")) {
            // A burst, as only lines have them.
            other.activations[KINDS - 1] = None;
        }
        handlers[5].activations[1] = Some(Activation { runs: 1, instructions: 1, cycles: 168 * 60 });
        Tasks { handlers, all_off: 168, some_off: 336 }
    }

    #[test]
    fn responses_by_hand() {
        let schedule = Schedule::new(&tasks(168_000)).unwrap();
        let task = |name: &str| schedule.0.iter().find(|task| task.name == name).unwrap();
        // Its own microsecond, the tick's, and what blocks it.
        let close = |name: &str, us: f64| {
            let response = task(name).response_us.unwrap();
            assert!((response - us).abs() < 1e-6, "{name}: {response}, not {us}\n{schedule}");
        };
        close("imu_line", 2.0 + 1.0);
        // A microsecond of imu, tick and service each, and CAN, whose bound is from its code.
        let can = 300 + COPY + EXCEPTION;
        close("service_line", 1.0 + 3.0 + can as f64 / 168.0 + 1.0);
        assert_eq!((task("can_frames").runs, task("can_frames").cycles), (0, can));
        // 60 us of a sample, 40 us without one, 116 turns of a microsecond, and ten that look.
        assert_eq!(task("output").cycles, 168 * (100 + TURNS) + TICKS * (LOOK + EXCEPTION));
        assert!(schedule.met(), "{schedule}");
    }

    #[test]
    fn a_deadline_that_is_missed_is_told() {
        let schedule = Schedule::new(&tasks(168 * 21_000)).unwrap();
        assert!(
            !schedule.met() && schedule.to_string().contains("used two samples later: MISSED"),
            "{schedule}"
        );
        let mut more = tasks(168_000);
        more.handlers[0].name = "SPI1".to_owned();
        assert_eq!(Schedule::new(&more), None);
    }
}
