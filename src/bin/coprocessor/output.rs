//! The output task: samples, pipeline, frames. Nothing in it waits.

use crate::board::SUPERVISOR;
use crate::chip::bus::Bus;
use crate::chip::watchdog::Watchdog;
use crate::clock::{self, BoardTime};
use crate::idle::{OBSERVATIONS, Observation};
use crate::imu::{Imu, TURN};
use crate::outgoing::{Outgoing, SlcanPort};
use crate::received::{self, FRAMES};
use crate::wheels::Wheels;
use crate::window::Windows;
use crate::{board, serial};
use gyronet::can::DataFrame;
use gyronet::can::config::Config;
use gyronet::can::feeds::Feeds;
use gyronet::can::fog_feed::FogFeed;
use gyronet::can::wheel::WheelSettings;
use gyronet::fog::lane::FogLane;
use gyronet::guard::{Guard, TIMEOUT_US};
use gyronet::health::{Faults, Status, count};
use gyronet::sample::ImuSample;
use gyronet::sensor::dsp1760::{Dsp1760, Dsp1760Config};
use gyronet::service::message::{AllCounters, LineCounters};
use gyronet::store::ImuPart;
use gyronet::units::Micros;
use gyronet::vehicle::VehicleSample;

/// What was found at the start to be wrong with what is stored.
#[derive(Clone, Copy)]
pub struct Doubts {
    /// Anything at all.
    pub stored: bool,
    /// The configuration itself: the built-in one stands in for it.
    pub configuration: bool,
}

/// Everything that the output task owns, but its lines.
pub struct Unconnected {
    pub guard: &'static mut Guard,
    pub config: Config,
    pub wheels: Option<WheelSettings>,
    pub windows: Windows,
    pub part: ImuPart,
    pub fog_ids: [u16; 3],
    pub doubts: Doubts,
}

/// The output task.
pub struct Output {
    imu: Imu,
    fog: FogPort,
    dsp1760: Dsp1760,
    fog_feed: FogFeed,
    guard: &'static mut Guard,
    windows: Windows,
    doubts: Doubts,
    tick: u32,
    /// The millisecond in which the other lines were looked at.
    looked: u32,
    wheels: Wheels,
    feeds: Feeds,
    outgoing: Outgoing,
    /// Time stamp of the newest sample.
    sample_time: Micros,
    /// When it came, by the board's clock.
    heard: Micros,
    time: BoardTime,
    lines: LineCounters,
    /// Frames dropped or lost when the last sample was sent.
    dropped: u32,
    watchdog: Watchdog,
}

type FogPort = serial::Port<{ board::FOG_QUEUE }>;
type ImuPort = serial::Port<{ board::IMU_QUEUE }>;
type Ports = (ImuPort, FogPort, SlcanPort, Option<Bus>);

impl Unconnected {
    #[inline]
    pub fn connect(self, (imu, fog, slcan, can): Ports, time: BoardTime, watchdog: Watchdog) -> Output {
        let Self { guard, config, wheels, windows, part, fog_ids, doubts } = self;
        Output {
            imu: Imu::new(part, imu),
            fog,
            dsp1760: Dsp1760::new(Dsp1760Config::DEFAULT),
            fog_feed: FogFeed::new(fog_ids),
            guard,
            windows,
            doubts,
            tick: 0,
            looked: 0,
            wheels: Wheels::new(wheels),
            feeds: Feeds::new(config),
            outgoing: Outgoing::new(slcan, config.settings().bits_per_second, can),
            sample_time: Micros(0),
            heard: Micros(0),
            time,
            lines: LineCounters::NONE,
            dropped: 0,
            watchdog,
        }
    }
}

impl Output {
    /// Does what there is to do. `weights_damaged`: what idle has found out.
    #[inline(never)]
    pub fn turn(&mut self, counters: &mut AllCounters, weights_damaged: bool, lane: &mut FogLane) {
        self.windows.has_network &= !weights_damaged;
        // A part's bytes come one by one. All else is looked at with the next tick, or before the sample
        // that they make; but for the CAN controller, which takes three frames at a time.
        let tick = clock::milliseconds();
        let now = self.time.now();
        let mut looked = core::mem::replace(&mut self.looked, tick) != tick;
        if looked {
            self.look(lane, now);
        }
        let mut turn = TURN;
        loop {
            self.windows.deliver(self.guard.pipeline());
            if self.windows.must_wait(self.tick, now) {
                self.guard.wait(now);
                break;
            }
            match self.imu.next_sample(&mut turn) {
                Some(Ok(sample)) => {
                    if !core::mem::replace(&mut looked, true) {
                        self.look(lane, now);
                    }
                    self.process(sample, now);
                    self.fog_out(lane, now);
                    self.frames_out();
                }
                Some(Err(())) => count(&mut self.lines.sensor_errors, 1),
                None => break,
            }
        }
        if !looked {
            self.outgoing.refill();
            return;
        }
        if let Some(vehicle) = self.guard.poll(now) {
            self.silence(vehicle, now);
            self.frames_out();
        }
        let watch = *self.guard.counters();
        *counters = AllCounters {
            pipeline: *self.guard.pipeline().counters(),
            watch,
            lines: self.lines,
            fog: *lane.counters(),
        };
        if SUPERVISOR.complete() {
            self.watchdog.feed();
        }
    }

    /// What has come on all other lines.
    #[inline(never)]
    fn look(&mut self, lane: &mut FogLane, now: Micros) {
        self.frames_in();
        self.fog_in(lane, now);
        self.frames_out();
    }

    #[inline(never)]
    fn process(&mut self, sample: ImuSample, now: Micros) {
        self.sample_time = sample.time;
        if let Some(known) = self.wheels.at(sample.time) {
            self.guard.wheels(known);
        }
        // What has no place in time is counted and gives no frame.
        let Ok(output) = &self.guard.process(sample, now) else { return };
        self.heard = now;
        self.tick = output.prompt.tick;
        self.send(output.vehicle, sample.time);
        let taken = self.windows.hand_out(output.window.as_ref(), now);
        count(&mut self.lines.overruns, u32::from(!taken));
        self.note(Some(sample), self.tick, output.prompt.status);
    }

    /// What the fibre-optic gyro has sent.
    fn fog_in(&mut self, lane: &mut FogLane, now: Micros) {
        for _ in 0..board::FOG_QUEUE {
            let Some(byte) = self.fog.receive() else { break };
            self.dsp1760.push(byte);
            while let Some(sample) = self.dsp1760.next_sample() {
                match sample {
                    Ok(sample) => {
                        let (time, _) = self.stream_time(now);
                        lane.push(time, sample);
                        self.fog_out(lane, now);
                    }
                    Err(_) => count(&mut self.lines.fog_errors, 1),
                }
            }
        }
        self.fog_out(lane, now);
    }

    #[inline(never)]
    fn fog_out(&mut self, lane: &mut FogLane, now: Micros) {
        let (time, fresh) = self.stream_time(now);
        let inertial = self.guard.pipeline().inertial().filter(|_| fresh);
        while let Some(yaw) = lane.next_step(time, inertial, self.wheels.known.as_ref()) {
            for frame in &self.fog_feed.process::<DataFrame>(&yaw) {
                self.outgoing.push(*frame, self.sample_time);
            }
        }
    }

    /// The time that the gyro's increments are summed by, and whether the other sensor's newest sample
    /// is of that time. The emulator's parts send at the host's pace: there the time stamps are the
    /// time, as they are for the pipeline.
    fn stream_time(&self, now: Micros) -> (Micros, bool) {
        if self.time.emulated() {
            (self.sample_time, true)
        } else {
            (now, now.0.saturating_sub(self.heard.0) < TIMEOUT_US)
        }
    }

    /// The sensor says nothing: that is told by its own time, as far as it is known.
    fn silence(&mut self, vehicle: VehicleSample, now: Micros) {
        let time = Micros(self.sample_time.0 + now.0.saturating_sub(self.heard.0));
        self.send(vehicle, time);
        self.note(None, vehicle.tick, Status::Silent);
    }

    #[inline(never)]
    fn note(&mut self, sample: Option<ImuSample>, tick: u32, status: Status) {
        if !OBSERVATIONS.push(Observation { sample, tick, status }) {
            count(&mut self.lines.overruns, 1);
        }
    }

    #[inline(never)]
    fn send(&mut self, mut vehicle: VehicleSample, time: Micros) {
        vehicle.yaw.faults = vehicle.yaw.faults.with(self.faults());
        if self.doubts.configuration {
            vehicle.doubt();
        }
        for frame in &self.feeds.process::<DataFrame>(&vehicle) {
            self.outgoing.push(*frame, time);
        }
    }

    /// What the pipeline cannot know.
    fn faults(&mut self) -> Faults {
        self.lines.unsent = self.outgoing.dropped();
        self.lines.frames_lost = received::lost();
        let dropped = self.lines.unsent.saturating_add(self.lines.frames_lost);
        let lost = core::mem::replace(&mut self.dropped, dropped) < dropped;
        let bus = if lost || self.outgoing.off() { Faults::BUS } else { Faults::NONE };
        if self.windows.has_network && !self.doubts.stored { bus } else { bus.with(Faults::STORED) }
    }

    fn frames_in(&mut self) {
        while let Some(frame) = FRAMES.pop() {
            self.wheels.take(&frame, self.sample_time);
        }
    }

    #[inline(never)]
    fn frames_out(&mut self) {
        let Self { outgoing, wheels, sample_time, .. } = self;
        outgoing.service(|frame| wheels.take(&frame, *sample_time));
        let ([lost, held], [slcan_lost, slcan_held]) = (self.imu.line_faults(), outgoing.line_faults());
        self.lines.line_errors = lost.saturating_add(self.fog.lost()).saturating_add(slcan_lost);
        self.lines.held = held.saturating_add(self.fog.held()).saturating_add(slcan_held);
    }
}
