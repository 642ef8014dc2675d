//! The output task: moves samples and frames between the lines and the coprocessor. Nothing in it waits.

use crate::board::SUPERVISOR;
use crate::boards::BOARD;
use crate::diagnosis::{self, FROM_SLCAN};
use crate::idle::{OBSERVATIONS, Observation};
use crate::imu::{BYTES_PER_STEP, Imu};
use crate::outgoing::Outgoing;
use crate::pause;
use crate::received::{self, FRAMES};
use crate::serial;
use crate::stm32f405::can::{Can, State};
use crate::stm32f405::{timer, watchdog};
use embedded_can::Frame as _;
use gyronet::coprocessor::{self, Coprocessor};
use gyronet::health::count;
use gyronet::sensor::dsp1760::{Dsp1760, Dsp1760Config};
use gyronet::service::message::{AllCounters, LineCounters};
use gyronet::store::ImuPart;
use gyronet::units::Micros;

/// Half a period of the LED, ms; a power of two.
const BLINK_MS: u32 = 512;

/// The configuration of the output task's lines.
pub struct OutputParts {
    pub part: ImuPart,
    pub bits_per_second: u32,
    /// True if wheel and latitude frames of a host on SLCAN are used.
    pub slcan_inputs: bool,
}

/// Holds the state of the output task.
pub struct Output {
    imu: Imu,
    fog: serial::Port,
    dsp1760: Dsp1760,
    outgoing: Outgoing,
    /// Millisecond of the last poll of the other lines.
    polled_at: u32,
    /// True once CAN takes part in the bus.
    joined: bool,
    lines: LineCounters,
    /// True if wheel and latitude frames of a host on SLCAN are used.
    slcan_inputs: bool,
    /// Number of tester frames on SLCAN that found no room.
    unread: u32,
}

type Ports = (serial::Port, serial::Port, serial::Port, Option<Can>);

impl OutputParts {
    #[inline]
    pub fn connect(self, (imu, fog, slcan, can): Ports) -> Output {
        Output {
            imu: Imu::new(self.part, imu),
            fog,
            dsp1760: Dsp1760::new(Dsp1760Config::DEFAULT),
            outgoing: Outgoing::new(slcan, self.bits_per_second, can),
            polled_at: 0,
            joined: false,
            lines: LineCounters::NONE,
            slcan_inputs: self.slcan_inputs,
            unread: 0,
        }
    }
}

// The coprocessor counts the inputs that it refuses, so the task ignores its errors.
impl Output {
    /// Runs one step of the output task.
    #[inline(never)]
    pub fn step(&mut self, coprocessor: &mut Coprocessor, counters: &mut AllCounters) {
        // A step also follows each sent CAN frame and each estimate. Inputs other than the inertial sensor are read
        // once a tick (1 ms), or before a new sample is used. The CAN controller is refilled in every step, because
        // it accepts only three frames at a time.
        let now = Micros(timer::micros());
        let tick = (now.0 / 1_000) as u32;
        if !core::mem::replace(&mut self.joined, true) {
            // From here on, this task takes received frames, and every task reports to the watchdog in time.
            self.outgoing.join();
            watchdog::set(watchdog::Limit::Short);
        }
        let mut polled = core::mem::replace(&mut self.polled_at, tick) != tick;
        if polled {
            self.outgoing.tick(tick);
            // The LED blinks as long as this task runs.
            if let Some((led, lit)) = BOARD.led {
                led.set(lit == (tick & BLINK_MS != 0));
            }
            self.poll_inputs(coprocessor, now);
        }
        coprocessor.pause(pause::is_requested(), &mut self.outgoing);
        if pause::is_requested() {
            self.send(coprocessor, now);
            pause::announce();
        }
        let mut budget = BYTES_PER_STEP;
        while coprocessor.is_ready(now) {
            match self.imu.next_sample(&mut budget) {
                Some(Ok(sample)) => {
                    if !core::mem::replace(&mut polled, true) {
                        self.poll_inputs(coprocessor, now);
                    }
                    self.report_bus(coprocessor);
                    if let Ok(observation) = &coprocessor.imu(sample, now, &mut self.outgoing) {
                        self.note(observation);
                    }
                    self.send(coprocessor, now);
                }
                Some(Err(())) => coprocessor.imu_error(),
                None => break,
            }
        }
        if !polled {
            self.outgoing.refill();
            return;
        }
        self.report_bus(coprocessor);
        if let Ok(Some(observation)) = &coprocessor.poll(now, &mut self.outgoing) {
            self.note(observation);
        }
        self.send(coprocessor, now);
        *counters = AllCounters {
            pipeline: *coprocessor.pipeline().counters(),
            watch: *coprocessor.monitor_counters(),
            lines: self.lines,
            fog: *coprocessor.fog_counters(),
            inputs: *coprocessor.input_counters(),
        };
        if SUPERVISOR.complete() {
            watchdog::feed();
        }
    }

    /// Passes the waiting CAN frames and the fibre-optic gyro's bytes to the coprocessor.
    #[inline(never)]
    fn poll_inputs(&mut self, coprocessor: &mut Coprocessor, now: Micros) {
        while let Some(frame) = FRAMES.pop() {
            let _ = coprocessor.can(&frame, now);
        }
        for _ in 0..serial::RECEIVED {
            let accepted = self.dsp1760.receive_some(self.fog.received());
            if accepted == 0 {
                break;
            }
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
        self.send(coprocessor, now);
    }

    /// Reports lost frames and the state of the bus to the coprocessor.
    fn report_bus(&mut self, coprocessor: &mut Coprocessor) {
        self.lines.unsent = self.outgoing.dropped();
        self.lines.frames_lost = received::lost().saturating_add(self.unread);
        let lost = self.lines.unsent.saturating_add(self.lines.frames_lost);
        coprocessor.bus(lost, self.outgoing.state() >= State::Passive);
    }

    /// Hands an observation to idle.
    #[inline(never)]
    fn note(&mut self, observation: &coprocessor::Observation) {
        let coprocessor::Observation { sample, vehicle, wheels, .. } = observation;
        let (tick, status, faults) = (vehicle.tick, vehicle.live.status, vehicle.live.faults);
        let note = Observation { sample: *sample, tick, status, faults, wheels: *wheels };
        count(&mut self.lines.overruns, u32::from(!OBSERVATIONS.push(note)));
    }

    /// Sends the queued frames, and takes the frames that a host has sent over SLCAN.
    #[inline(never)]
    fn send(&mut self, coprocessor: &mut Coprocessor, now: Micros) {
        let (unread, takes_inputs) = (&mut self.unread, self.slcan_inputs);
        self.outgoing.service(|frame| {
            if diagnosis::is_request(frame.id()) {
                count(unread, u32::from(!FROM_SLCAN.push(frame)));
            } else if takes_inputs {
                let _ = coprocessor.can(&frame, now);
            }
        });
        let lost = [self.imu.lost(), self.fog.lost(), self.outgoing.lost()];
        self.lines.line_errors = lost.into_iter().fold(0, u32::saturating_add);
    }
}
