//! This module computes the response time of every task of the image from its cost and how often it can be activated,
//! for fixed priorities (Joseph and Pandya 1986; Audsley and others 1993).
//!
//! Deadlines are judged by the cycles with wait states, each activation starting with empty caches. A task's cost
//! includes the delay of the task that it preempts: as many lines to read again as it has put into the caches. (A loop
//! that fills the whole cache could lose more than that; the kernels' loops do not.)

use crate::target::parser_load::CLOCK_HZ;
use crate::target::tasks::{Activation, Cycles, Handler, Least, Tasks};
use std::fmt;

/// Entering and leaving a handler takes this many cycles: 12 and 10 (Cortex-M4 TRM, 3.9.1), and 17 words of
/// floating-point registers each way.
const EXCEPTION: u64 = 12 + 10 + 2 * 17;
/// Reading a line of flash takes this many cycles, five of them wait states.
const LINE_READ: u64 = 6;
/// Both caches have this many lines: no activation can cost a preempted task more of them.
const LINES: u64 = 64 + 8;
/// Taking the vector costs three lines: the vector itself, read from flash, its place in the cache, and the line that
/// was in use before.
const VECTOR: u64 = 3 * LINE_READ;
/// This share of a deadline must be left.
const SPARE: f64 = 0.25;
/// Idle blocks priorities up to this while it shares data with the output task.
const SHARED: u8 = 2;
/// Copying a frame, with the code around it but without `can_frames` itself, takes at most this many cycles.
const COPY: u64 = 150;
/// A byte takes this long at 115200 and at 921600 bit/s, us: ten bits.
const BYTE_115200: f64 = 10e6 / 115_200.0;
const BYTE_921600: f64 = 10e6 / 921_600.0;
/// A sample's frames are delayed by at most this, us: the output task waits for a tick and takes no more than 3 ms; if
/// it takes longer, no deadline counts as met.
const FRAMES_LATE: f64 = 4e3;
/// The shortest frame at 500 kbit/s takes this long, us: 47 bits.
const FRAME: f64 = 47.0 / 0.5;

/// Says how the cost of a task follows from its activations.
enum Cost {
    /// The task costs its worst activation.
    Worst,
    /// The task costs the worst activation that moved no more than so many bytes, as on a real line: one in, and two
    /// out if something is sent on it. The emulated line moves all bytes at once.
    Bytes(usize),
    /// The task costs, in 10 ms, the worst activation with one sample, the worst without, the cheapest one for each
    /// sent frame that pends it, and a check of all lines with every tick, because the emulated line delivers many
    /// bytes at a time.
    Sample,
}

/// In 10 ms the output task is pended this many times without work: by ten sent frames and the end of a window.
const TURNS: u64 = 10 + 1;
/// In 10 ms there are this many ticks; with each the output task checks every line.
const TICKS: u64 = 10;

/// Limits activations that come in bursts.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Burst {
    count: f64,
    /// Time from one burst to the next, us.
    span: f64,
    /// The largest delay of one activation, us.
    jitter: f64,
}

impl Burst {
    const fn new(count: f64, span: f64, jitter: f64) -> Option<Self> {
        Some(Self { count, span, jitter })
    }
}

/// Describes the demand on a task.
struct Demand {
    name: &'static str,
    handler: &'static str,
    cost: Cost,
    /// The shortest time between two activations, us.
    period: f64,
    /// The limit of activations in bursts.
    burst: Option<Burst>,
    /// Time from the activation to the deadline, us.
    deadline: f64,
    why: &'static str,
}

const MAILBOXES: &str = "three mailboxes are empty";
/// These handlers end a run: the supply falls, and the board restarts.
const LAST: [&str; 1] = ["PVD"];

/// Lists the demands on all tasks of `coprocessor` with everything configured and connected; an image without one of
/// them lacks its row.
const DEMANDS: [Demand; 9] = [
    byte("imu_line", "USART1", BYTE_115200),
    // Messages of up to 47 bytes, 1000 a second.
    Demand { burst: Burst::new(47.0, 1e3, 1e3), ..byte("fog_line", "USART3", BYTE_921600) },
    demand("tick", "SysTick", Cost::Worst, 1e3, 1e3, "the next tick"),
    // In 10 ms, with their stamps: nine frames of 26 characters and VDC2's 31 out; four wheel frames of 22 in.
    Demand { burst: Burst::new(353.0, 1e4, FRAMES_LATE), ..both_ways("slcan_line", "USART2", BYTE_921600) },
    both_ways("service_line", "USART6", BYTE_115200),
    // The filters pass only wheel frames: four identifiers, twice each.
    Demand {
        burst: Burst::new(8.0, 1e4, 1e4),
        ..demand(
            "can_frames",
            "CAN1_RX0",
            Cost::Worst,
            FRAME,
            3.0 * FRAME,
            "three frames fill the controller",
        )
    },
    // Six frames come with a sample, four with the sums of the fibre-optic gyro.
    Demand {
        burst: Burst::new(10.0, 1e4, FRAMES_LATE),
        ..demand("can_sent", "CAN1_TX", Cost::Worst, FRAME, 3.0 * FRAME, MAILBOXES)
    },
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

/// Returns the demand of a line at full speed on which nothing is sent: each byte must be taken before the next
/// arrives.
const fn byte(name: &'static str, handler: &'static str, period: f64) -> Demand {
    demand(name, handler, Cost::Bytes(1), period, period, "the next byte")
}

/// Returns the demand of a line at full speed on which something is sent.
const fn both_ways(name: &'static str, handler: &'static str, period: f64) -> Demand {
    Demand { cost: Cost::Bytes(3), ..byte(name, handler, period) }
}

/// Returns the cycles of one activation with entry, exit, and its cost to the preempted task.
fn whole(cycles: Cycles, fills: u64) -> Cycles {
    let five = cycles.five + EXCEPTION + VECTOR + fills.min(LINES) * LINE_READ;
    Cycles { zero: cycles.zero + EXCEPTION, five }
}

impl Cost {
    /// Returns activations, instructions and modelled cycles in a period.
    fn of(&self, handler: &Handler) -> (u64, u64, Cycles) {
        let kinds = if let Self::Bytes(most) = self { 1 + most } else { handler.activations.len() };
        let ran = || handler.activations.iter().take(kinds).flatten();
        let runs = ran().map(|activation| activation.runs).sum();
        let worst = ran().copied().reduce(|a, b| Activation {
            runs,
            instructions: a.instructions.max(b.instructions),
            cycles: a.cycles.max(b.cycles),
            fills: a.fills.max(b.fills),
        });
        // For code that never ran, each instruction counts once, at three cycles; there are half as many words as
        // halfwords.
        let worst = worst.unwrap_or_else(|| {
            let (zero, lines) = (3 * handler.code + COPY, handler.code / 8 + 1);
            let cycles = Cycles { zero, five: zero + 2 * lines * LINE_READ };
            Activation { runs, instructions: handler.code, cycles, fills: lines }
        });
        let Activation { instructions, cycles, fills, .. } = worst;
        let cycles = match self {
            Self::Worst | Self::Bytes(_) => whole(cycles, fills),
            Self::Sample => {
                let kind = |kind: usize| handler.activations[kind].map(|ran| whole(ran.cycles, ran.fills));
                // On a host that is too slow to send samples one by one, the worst of several is used.
                let sample = kind(1).unwrap_or_else(|| whole(cycles, fills)) + kind(0).unwrap_or_default();
                let least = |least: Least| whole(least.cycles, least.fills);
                sample + least(handler.least) * TURNS + least(handler.looking) * TICKS
            }
        };
        (runs, instructions, cycles)
    }

    /// Returns the cycles of each of many activations: one that moves several bytes stands for as many activations.
    fn each(&self, handler: &Handler) -> Option<Cycles> {
        let Self::Bytes(most) = self else { return None };
        let ran = handler.activations.iter().enumerate().take(1 + most);
        let each = ran.filter_map(|(bytes, ran)| {
            let Cycles { zero, five } = ran.map(|ran| whole(ran.cycles, ran.fills))?;
            let bytes = bytes.max(1) as u64;
            Some(Cycles { zero: zero.div_ceil(bytes), five: five.div_ceil(bytes) })
        });
        each.reduce(Cycles::max)
    }
}

/// Holds a task and its response times.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Task {
    /// The image's name for it.
    pub name: &'static str,
    /// Priority; a larger one is more urgent.
    pub priority: u8,
    /// Shortest time between two activations, us.
    pub period_us: f64,
    /// The limit of activations in bursts.
    #[serde(skip)]
    burst: Option<Burst>,
    /// The cycles of each activation of a burst, where the worst one does the work of several.
    #[serde(skip)]
    each: Cycles,
    /// Deadline, us.
    pub deadline_us: f64,
    /// The reason for the deadline.
    pub why: &'static str,
    /// Activations counted; with 0 the task never ran, and its cost is a bound from its code.
    pub runs: u64,
    /// Instructions of the longest activation.
    pub instructions: u64,
    /// Cycles in a period at worst, modelled at zero wait states, with entry and exit.
    pub cycles: u64,
    /// The same cycles with wait states, and with the cost to the preempted task.
    pub cycles_5ws: u64,
    /// Worst response at zero wait states, us; `None` if later than ten times the deadline.
    pub response_us: Option<f64>,
    /// Worst response with wait states.
    pub response_5ws_us: Option<f64>,
}

impl Task {
    /// Returns whether the task always meets its deadline with a quarter of it to spare.
    #[must_use]
    pub fn met(&self) -> bool {
        self.response_5ws_us.is_some_and(|response| response <= (1.0 - SPARE) * self.deadline_us)
    }

    /// Returns the share of the processor, with wait states.
    #[must_use]
    pub fn share(&self) -> f64 {
        let period = self.burst.map_or(self.period_us, |Burst { count, span, .. }| span / count);
        self.each.five as f64 / (period * 1e-6 * CLOCK_HZ)
    }

    /// Returns the most activations in a time, us.
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
    /// Makes the table from the counts; `fognet` are the instructions and cycles of one of FoGNet's windows, which idle
    /// runs piece by piece. `None` if the image has a task that is not in the table.
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

    /// Returns whether every task is always done in time, and frames are not later than assumed.
    #[must_use]
    pub fn met(&self) -> bool {
        let output = self.0.iter().filter(|task| task.name == "output");
        let late = output.filter_map(|task| task.response_5ws_us).any(|us| us > FRAMES_LATE - 1e3);
        !late && self.0.iter().all(Task::met)
    }

    /// Returns the share of the processor that all tasks take together.
    #[must_use]
    pub fn share(&self) -> f64 {
        self.0.iter().map(Task::share).sum()
    }
}

/// Returns the row of FoGNet's window, which runs in the time that all tasks leave: one begins with each second, and
/// its estimate is used in the next.
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

/// Returns the worst response of a task, us: its own cost, its blocking, and all activations of tasks at least as
/// urgent that can come meanwhile. `cost` gives the cycles of the worst activation and of each of many.
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

impl fmt::Display for Schedule {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(
            f,
            "{:<13}{:>5}{:>10}{:>12}{:>13}{:>10}{:>10}{:>8}{:>12}{:>9}{:>8}  deadline is",
            "task",
            "prio",
            "period us",
            "deadline us",
            "instructions",
            "cycles",
            "at 5 ws",
            "load",
            "response us",
            "at 5 ws",
            "margin"
        )?;
        for task in &self.0 {
            let Task { name, priority, period_us, deadline_us, instructions, why, .. } = task;
            write!(f, "{name:<13}{priority:>5}{period_us:>10.1}{deadline_us:>12.1}{instructions:>13}")?;
            write!(f, "{:>10}{:>10}{:>7.2}%", task.cycles, task.cycles_5ws, task.share() * 100.0)?;
            match task.response_us {
                Some(response) => write!(f, "{response:>12.1}")?,
                None => write!(f, "{:>12}", "never")?,
            }
            match task.response_5ws_us {
                Some(response) => {
                    write!(f, "{response:>9.1}{:>7.1}%", (1.0 - response / deadline_us) * 100.0)?;
                }
                None => write!(f, "{:>9}{:>8}", "never", "-")?,
            }
            let missed = if task.met() { "" } else { ": MISSED" };
            let bound = if task.runs == 0 { " (never ran here: a bound from its code)" } else { "" };
            write!(f, "  {why}{missed}{bound}")?;
            if let Some(Burst { count, span, .. }) = task.burst {
                write!(f, "; {count} in {} ms", span / 1e3)?;
            }
            writeln!(f)?;
        }
        let (share, megahertz, spare) = (self.share() * 100.0, CLOCK_HZ * 1e-6, SPARE * 100.0);
        write!(
            f,
            "all tasks: {share:.1} % of {megahertz:.0} MHz at 5 wait states; MISSED is less than {spare} % to spare"
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::target::tasks::KINDS;

    /// Makes a handler whose activation takes so many cycles in all, without wait states and with them.
    fn handler(name: &str, priority: u8, cycles: Option<[u64; 2]>) -> Handler {
        let ran = cycles.map(|[zero, five]| Activation {
            runs: 1,
            instructions: zero,
            cycles: Cycles { zero: zero - EXCEPTION, five: five - EXCEPTION - VECTOR },
            fills: 0,
        });
        let burst = Activation {
            runs: 1,
            instructions: 9,
            cycles: Cycles { zero: 1_000_000, five: 2_000_000 },
            fills: 0,
        };
        // What fills the caches costs the preempted task as many lines.
        let full = EXCEPTION + VECTOR + LINES * LINE_READ;
        Handler {
            name: name.to_owned(),
            priority,
            activations: [ran, None, None, None, Some(burst)],
            least: Least { cycles: Cycles { zero: 168 - EXCEPTION, five: 840 - full }, fills: LINES },
            looking: Least { cycles: Cycles { zero: 336 - EXCEPTION, five: 1_008 - full }, fills: LINES },
            code: 100,
        }
    }

    fn tasks(window: u64) -> Tasks {
        let mut handlers = vec![
            handler("USART1", 4, Some([168, 336])),
            handler("SysTick", 4, Some([168, 336])),
            handler("USART2", 4, Some([168, 168])),
            handler("USART6", 3, Some([168, 168])),
            handler("CAN1_RX0", 3, None),
            handler("UART4", 2, Some([168 * 40, 168 * 50])),
            handler("UART5", 1, Some([window, window])),
        ];
        for other in handlers.iter_mut().filter(|handler| !handler.name.starts_with("USART")) {
            // A burst, as only lines have them.
            other.activations[KINDS - 1] = None;
        }
        // A sample.
        handlers[5].activations[1] = Some(Activation {
            runs: 1,
            instructions: 1,
            cycles: Cycles {
                zero: 168 * 60 - EXCEPTION,
                five: 168 * 80 - EXCEPTION - VECTOR - 2 * LINE_READ,
            },
            fills: 2,
        });
        let off = |us: u64| Cycles { zero: 168 * us, five: 336 * us };
        Tasks { handlers, all_off: off(1), some_off: off(2) }
    }

    #[test]
    fn responses_by_hand() {
        let schedule = Schedule::new(&tasks(168_000), None).unwrap();
        let task = |name: &str| schedule.0.iter().find(|task| task.name == name).unwrap();
        let close = |name: &str, us: [f64; 2]| {
            let Task { response_us, response_5ws_us, .. } = task(name);
            for (response, us) in [response_us, response_5ws_us].into_iter().zip(us) {
                let response = response.unwrap();
                assert!((response - us).abs() < 1e-6, "{name}: {response}, not {us}\n{schedule}");
            }
        };
        // Its own microsecond, the tick's, and what blocks it, all of them twice with wait states; and the
        // other line's.
        close("imu_line", [4.0, 7.0]);
        // A line's own, imu's, tick's, the other line's and what blocks it; and CAN, whose bound is from
        // its code: 100 halfwords are 13 lines, each missed twice and once more by what is preempted. With
        // wait states the other line's next byte comes in that time.
        let can = 300 + COPY + EXCEPTION;
        let can_5ws = can + 2 * 13 * LINE_READ + VECTOR + 13 * LINE_READ;
        close("service_line", [5.0 + can as f64 / 168.0, 9.0 + can_5ws as f64 / 168.0]);
        assert_eq!((task("can_frames").runs, task("can_frames").cycles), (0, can));
        // 60 us of a sample, 40 us without one, 116 turns of a microsecond, and ten that look for two.
        assert_eq!(task("output").cycles, 168 * (100 + TURNS + 2 * TICKS));
        assert_eq!(task("output").cycles_5ws, 168 * (130 + 5 * TURNS + 6 * TICKS));
        assert!(schedule.met(), "{schedule}");
    }

    /// With a deadline of 20 ms for a window and everything that preempts it, 13 ms leave a quarter to spare and 16 ms
    /// do not.
    #[test]
    fn a_deadline_met_without_spare_time_is_missed() {
        let window = |us: u64| Schedule::new(&tasks(168 * us), None).unwrap();
        let response = |schedule: &Schedule| schedule.0.last().unwrap().response_5ws_us.unwrap();
        let (spare, late) = (window(11_000), window(14_000));
        assert!(spare.met() && response(&spare) > 11_000.0, "{spare}");
        assert!(!late.met() && response(&late) < 20_000.0, "{late}");
    }

    #[test]
    fn a_deadline_that_is_missed_is_reported() {
        let schedule = Schedule::new(&tasks(168 * 21_000), None).unwrap();
        assert!(
            !schedule.met() && schedule.to_string().contains("used two samples later: MISSED"),
            "{schedule}"
        );
        let mut more = tasks(168_000);
        more.handlers[0].name = "SPI1".to_owned();
        assert_eq!(Schedule::new(&more, None), None);
    }
}
