//! GyroNet's window on its way from the output task to the network's and back.
//!
//! An estimate has as many sample periods of board time as the pipeline uses it later, from when
//! its window was handed out. Until then the next sample stays where it waits, should samples come
//! faster than 100 times a second (an emulated part sends at the host's pace); after that it is
//! late, which the pipeline counts and flags.

use crate::queue::Queue;
use gyronet::model::{Estimate, GyroNet, WindowNetwork};
use gyronet::pipeline::{DueWindow, Pipeline};
use gyronet::sample::PERIOD_US;
use gyronet::units::Micros;

/// The window that is due, until it has been run.
static WINDOWS: Queue<DueWindow, 1> = Queue::new();
/// Its estimate.
static ESTIMATES: Queue<(u32, Estimate), 1> = Queue::new();

/// The network's task.
pub struct WindowTask {
    pub network: Option<&'static mut GyroNet<'static>>,
}

impl WindowTask {
    /// Runs the window that is due; whether there was one. It stays in its queue while it runs,
    /// so that no second one is handed over; but not when its estimate is out, since the output
    /// task may come in between and have the next one.
    pub fn run(&mut self) -> bool {
        let Some(due) = WINDOWS.peek() else { return false };
        let (end, network) = (due.end, self.network.as_mut());
        let estimate = network.map(|network| network.estimate(&due.features));
        let _ = WINDOWS.pop();
        // There is room: the estimate before was taken.
        estimate.is_some_and(|estimate| ESTIMATES.push((end, estimate)))
    }
}

/// A window that was handed out.
struct Out {
    end: u32,
    until: u64,
}

/// The output task's end.
pub struct Windows {
    /// Weights are good.
    pub has_network: bool,
    /// Samples from a window's newest one to the one that its estimate is used with.
    delay: u32,
    out: Option<Out>,
}

impl Windows {
    pub const fn new(has_network: bool, delay: u32) -> Self {
        Self { has_network, delay, out: None }
    }

    /// Hands the estimates that have come to the pipeline.
    pub fn deliver(&mut self, pipeline: &mut Pipeline) {
        while let Some((end, estimate)) = ESTIMATES.pop() {
            if self.has_network {
                pipeline.deliver(end, estimate);
            }
            self.out.take_if(|out| out.end == end);
        }
    }

    /// Whether the sample after `tick` is the one that wants the estimate, which is not late yet.
    pub fn must_wait(&self, tick: u32, now: Micros) -> bool {
        let wanted = |out: &Out| tick.wrapping_sub(out.end) + 1 >= self.delay && now.0 < out.until;
        self.out.as_ref().is_some_and(wanted)
    }

    /// Hands a window out; false where the one before is not done: this one's turn passes, and is
    /// counted as late.
    #[inline(never)]
    pub fn hand_out(&mut self, due: Option<&DueWindow>, now: Micros) -> bool {
        let Some(due) = due.filter(|_| self.has_network) else { return true };
        let end = due.end;
        let taken = WINDOWS.push(*due);
        if taken {
            self.out = Some(Out { end, until: now.0 + u64::from(self.delay) * PERIOD_US });
        }
        taken
    }
}
