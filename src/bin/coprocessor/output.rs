//! The output task: moves samples and frames between the lines and the coprocessor. Nothing in it waits.
//!
//! It also announces that the buses will be silent, because the flash is erased or the board restarts. Idle requests the
//! announcement and waits for it; from then on the task sends message sets without a rate, until idle's work is done. A
//! receiver can tell from them that the silence is intended.

use crate::boards::BOARD;
use crate::diagnosis::{self, FROM_SLCAN};
use crate::frames::{self, FRAMES, Outgoing};
use crate::idle;
use crate::imu::{BYTES_PER_STEP, Imu};
use crate::serial;
use crate::stm32f405::can::{Can, State};
use crate::stm32f405::pac::Interrupt;
use crate::stm32f405::{timer, watchdog};
use core::sync::atomic::{AtomicU8, AtomicU32, Ordering};
use embedded_can::Frame as _;
use gyronet::coprocessor::Coprocessor;
use gyronet::heading::{GnssLine, GnssSettings};
use gyronet::health::count;
use gyronet::sensor::dsp1760::Dsp1760;
use gyronet::sensor::{ByteSource as _, Source as _};
use gyronet::service::message::LineCounters;
use gyronet::store::ImuPart;
use gyronet::units::Micros;

/// Time after a sample in which the tick runs the task for received bytes only, us. A sensor counts as silent later.
const QUIET_US: u32 = 20_000;
static QUIET_UNTIL: AtomicU32 = AtomicU32::new(0);

/// Returns whether the task is to run at `now`, us, even if nothing has come.
#[inline]
pub fn is_due(now: u32) -> bool {
    now.wrapping_sub(QUIET_UNTIL.load(Ordering::Relaxed)) as i32 >= 0
}

/// Runs the task now and with the next tick: something other than an input waits for it.
pub fn attend() {
    QUIET_UNTIL.store(timer::micros() as u32, Ordering::Relaxed);
    rtic::pend(Interrupt::SPI3);
}

/// Interval at which the counters of the lines are summed and the watchdog is fed, ms.
const SLOW_MS: u32 = 6;
/// Half a period of the LED, ms; a power of two.
const BLINK_MS: u32 = 512;

/// In this state, the output task sends rates.
const RUNNING: u8 = 0;
/// In this state, idle waits for the announcement.
const REQUESTED: u8 = 1;
/// In this state, a message set without a rate has been queued.
const ANNOUNCED: u8 = 2;
/// Limits how long idle waits for the output task's announcement, us.
const ANNOUNCE_US: u64 = 20_000;
/// Time for the frames to be sent, us; six frames take 1.7 ms. Then each millisecond shows whether one is stale.
const LEAVE_US: u64 = 5_000;
/// More interrupts than come in a millisecond, so that a wait ends even if the timer stands still.
const WAKES_PER_MS: u64 = 1_000;

static STATE: AtomicU8 = AtomicU8::new(RUNNING);

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

pub struct Output {
    imu: Imu,
    fog: serial::Port,
    dsp1760: Dsp1760,
    gnss: serial::Port,
    /// Damaged and overwritten bytes of that line so far.
    gnss_lost: u32,
    receiver: Option<GnssLine>,
    outgoing: Outgoing,
    /// Time of the last sample, us.
    sampled_at: u32,
    /// True if frames of an earlier sample still waited then: their age is watched.
    is_behind: bool,
    /// Millisecond of the last poll of the other lines.
    polled_at: u32,
    /// Millisecond of the last report.
    reported_at: u32,
    /// True once CAN takes part in the bus.
    joined: bool,
    lines: LineCounters,
    /// Number of tester frames on SLCAN that found no room.
    unread: u32,
}

type Ports = ([serial::Port; 4], Option<Can>);

// The coprocessor counts the inputs that it refuses, so the task ignores its errors.
impl Output {
    /// Creates the task's state for the configured part, bit rate, and line of a GNSS receiver, if it is used.
    #[inline]
    pub fn new(
        part: ImuPart,
        bits_per_second: u32,
        line: Option<GnssSettings>,
        ([imu, fog, slcan, gnss], can): Ports,
    ) -> Self {
        Self {
            imu: Imu::new(part, imu),
            fog,
            dsp1760: Dsp1760::new(),
            gnss,
            gnss_lost: 0,
            receiver: line.map(|line| GnssLine::new(line.protocol)),
            outgoing: Outgoing::new(slcan, bits_per_second, can),
            sampled_at: 0,
            is_behind: false,
            polled_at: 0,
            reported_at: 0,
            joined: false,
            lines: LineCounters::NONE,
            unread: 0,
        }
    }

    /// Returns whether the window's task is to run: a sample may have made one due, and it reports to the watchdog.
    #[inline(never)]
    pub fn step(&mut self, coprocessor: &mut Coprocessor, lines: &mut LineCounters) -> bool {
        // A step also follows each sent CAN frame and each estimate. Inputs other than the inertial sensor are read
        // once a tick (1 ms), or before a new sample is used. The CAN controller is refilled in every step, because
        // it accepts only three frames at a time.
        let asked = QUIET_UNTIL.load(Ordering::Relaxed);
        let now = Micros(timer::micros());
        let tick = timer::whole_milliseconds(now.0);
        if !core::mem::replace(&mut self.joined, true) {
            // From here on, this task takes received frames, and every task reports to the watchdog in time.
            self.outgoing.join();
            watchdog::set(watchdog::Limit::Short);
        }
        let before = core::mem::replace(&mut self.polled_at, tick);
        let has_ticked = before != tick;
        // The LED blinks as long as this task runs.
        if let Some((led, lit)) = BOARD.led.filter(|_| (before ^ tick) & BLINK_MS != 0) {
            led.set(lit == (tick & BLINK_MS != 0));
        }
        if has_ticked {
            self.outgoing.tick(tick);
        }
        let is_polled = has_ticked || !FRAMES.is_empty();
        if is_polled {
            self.poll_inputs(coprocessor, now);
        }
        let is_requested = is_requested();
        coprocessor.pause(is_requested, &mut self.outgoing);
        if is_requested {
            self.send();
            announce();
        }
        let is_slow = has_ticked && tick.wrapping_sub(self.reported_at) >= SLOW_MS;
        let is_behind = !self.outgoing.is_sent();
        let has_sample = self.imu.has_input() && self.take_samples(coprocessor, now, is_polled);
        if has_sample {
            (self.sampled_at, self.is_behind) = (now.0 as u32, is_behind);
        }
        if !has_ticked && !has_sample {
            self.outgoing.refill();
            return false;
        }
        if is_slow {
            self.report_bus(coprocessor);
        }
        if !has_sample {
            let _ = coprocessor.poll_to(now, &mut self.outgoing);
            self.send();
        }
        if is_slow {
            self.report(tick, lines);
        }
        self.rest(now, asked, coprocessor);
        has_sample || is_slow
    }

    /// Lets the tick leave this task alone, where nothing waits but what will come, and nobody has called [`attend`] since
    /// QUIET_UNTIL was read as `asked`.
    fn rest(&self, now: Micros, asked: u32, coprocessor: &Coprocessor) {
        let now = now.0 as u32;
        let quiet = match self.outgoing.is_sent() {
            true => QUIET_US,
            false if self.is_behind => 0,
            false => LEAVE_US as u32,
        };
        let is_quiet = now.wrapping_sub(self.sampled_at) < quiet
            && self.outgoing.is_at_rest()
            && self.imu.arm_wake_up()
            && !coprocessor.is_waiting();
        let until = if is_quiet { self.sampled_at.wrapping_add(quiet) } else { now };
        let _ = QUIET_UNTIL.compare_exchange(asked, until, Ordering::Relaxed, Ordering::Relaxed);
    }

    /// Passes the waiting samples to the coprocessor, as far as they need not wait for an estimate; returns whether there
    /// was one. Before the first one the other inputs are read, unless they have been.
    // Not inlined, since most steps have no sample, and this has a large frame.
    #[inline(never)]
    fn take_samples(&mut self, coprocessor: &mut Coprocessor, now: Micros, mut is_polled: bool) -> bool {
        let mut has_sample = false;
        let mut budget = BYTES_PER_STEP;
        while coprocessor.is_ready(now) {
            match self.imu.next_sample(&mut budget) {
                Some(Ok(sample)) => {
                    if !core::mem::replace(&mut is_polled, true) {
                        self.poll_inputs(coprocessor, now);
                    }
                    self.report_bus(coprocessor);
                    let _ = coprocessor.imu_to(sample, now, &mut self.outgoing);
                    self.send();
                    has_sample = true;
                }
                Some(Err(())) => coprocessor.imu_error(),
                None => break,
            }
        }
        has_sample
    }

    /// Sums the counters of the lines and feeds the watchdog, every [`SLOW_MS`].
    #[inline(never)]
    fn report(&mut self, tick: u32, lines: &mut LineCounters) {
        self.reported_at = tick;
        let lost = [self.imu.lost(), self.fog.lost(), self.outgoing.lost(), self.gnss.lost()];
        *lines = LineCounters {
            service_errors: self.outgoing.refused(),
            overruns: self.outgoing.overruns(),
            line_errors: lost.into_iter().fold(0, u32::saturating_add),
            ..self.lines
        };
        self.outgoing.attend_if_due();
        // A new cycle begins once every task has reported.
        if REPORTS.compare_exchange(ALL_TASKS, 0, Ordering::Relaxed, Ordering::Relaxed).is_ok() {
            watchdog::feed();
        }
    }

    /// Passes the waiting CAN frames and the fibre-optic gyro's bytes to the coprocessor.
    #[inline(never)]
    fn poll_inputs(&mut self, coprocessor: &mut Coprocessor, now: Micros) {
        while let Some(frame) = FRAMES.pop() {
            let _ = coprocessor.can(&frame, now);
        }
        for _ in 0..self.fog.waiting() {
            let waiting = self.fog.received();
            if waiting.is_empty() {
                break;
            }
            let accepted = self.dsp1760.receive_some(waiting);
            self.fog.consume(accepted);
            while let Some(sample) = self.dsp1760.next_sample() {
                match sample {
                    Ok(sample) => {
                        let _ = coprocessor.fog(sample, now, &mut self.outgoing);
                    }
                    Err(_) => coprocessor.fog_error(),
                }
            }
        }
        if self.receiver.is_some() {
            self.poll_receiver(coprocessor, now);
        }
    }

    #[inline(never)]
    fn poll_receiver(&mut self, coprocessor: &mut Coprocessor, now: Micros) {
        let Some(receiver) = &mut self.receiver else { return };
        let mut is_damaged = false;
        for _ in 0..serial::RECEIVED {
            let waiting = self.gnss.received();
            let (length, byte) = (waiting.len(), waiting.first().copied());
            let lost = self.gnss.lost();
            if lost != core::mem::replace(&mut self.gnss_lost, lost) {
                is_damaged = true;
                receiver.interrupt();
            }
            let Some(byte) = byte else { break };
            if is_damaged {
                // The damaged byte is one of those that wait.
                self.gnss.consume(length);
                continue;
            }
            self.gnss.consume(1);
            receiver.receive(byte);
            while let Some(fix) = receiver.next_sample() {
                let _ = coprocessor.gnss(fix, now);
            }
        }
    }

    fn report_bus(&mut self, coprocessor: &mut Coprocessor) {
        self.lines.unsent = self.outgoing.dropped();
        self.lines.frames_lost = frames::lost().saturating_add(self.unread);
        let lost = self.lines.unsent.saturating_add(self.lines.frames_lost);
        coprocessor.bus(lost, self.outgoing.state() >= State::Passive);
    }

    /// Sends the queued frames, and takes the requests that a host has sent over SLCAN: of its other frames none is used.
    #[inline(never)]
    fn send(&mut self) {
        self.outgoing.refill();
        if !self.outgoing.is_slcan_busy() {
            return;
        }
        let unread = &mut self.unread;
        self.outgoing.service(|frame| {
            if !diagnosis::is_request(frame.id()) {
                return false;
            }
            let has_room = FROM_SLCAN.push(frame);
            idle::attend();
            count(unread, u32::from(!has_room));
            has_room
        });
    }
}

/// Announces that the buses will be silent, then runs `work`, which silences them. Idle calls this.
pub fn with_silence_announced<T>(work: impl FnOnce() -> T) -> T {
    STATE.store(REQUESTED, Ordering::Relaxed);
    attend();
    wait(ANNOUNCE_US, || STATE.load(Ordering::Relaxed) == ANNOUNCED);
    wait(LEAVE_US, || false);
    let result = work();
    STATE.store(RUNNING, Ordering::Relaxed);
    result
}

fn is_requested() -> bool {
    STATE.load(Ordering::Relaxed) != RUNNING
}

fn announce() {
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
