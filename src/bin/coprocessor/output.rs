//! The output task: moves samples and frames between the lines and the coprocessor. Nothing in it waits.

use crate::boards::BOARD;
use crate::frames::{self, Outgoing};
use crate::imu::{BYTES_PER_STEP, Imu};
use crate::queues::{FRAMES, FROM_SLCAN, is_request};
use crate::serial;
use crate::stm32f405::can::{Can, State};
use crate::stm32f405::{timer, watchdog};
use crate::tasks::{self, LEAVE_US, QUIET_UNTIL};
use core::sync::atomic::Ordering;
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
/// Interval at which the counters of the lines are summed and the watchdog is fed, ms.
const SLOW_MS: u32 = 6;
/// Half a period of the LED, ms; a power of two.
const BLINK_MS: u32 = 512;

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
        let is_requested = tasks::is_silence_requested();
        coprocessor.pause(is_requested, &mut self.outgoing);
        if is_requested {
            self.send();
            tasks::silence_announced();
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

    /// Lets the tick leave this task alone, where nothing waits but what will come, and nobody has woken it since
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
        tasks::feed_watchdog();
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
            if !is_request(frame.id()) {
                return false;
            }
            let has_room = FROM_SLCAN.push(frame);
            tasks::wake_idle();
            count(unread, u32::from(!has_room));
            has_room
        });
    }
}
