//! This module prints the schedule as a table with one line per task.

use super::{Burst, SPARE, Schedule, Task};
use crate::target::parser_load::CLOCK_HZ;
use std::fmt;

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
