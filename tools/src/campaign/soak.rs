//! This module runs hours of a simulated drive through the coprocessor, as fast as the host can. The input is bytes
//! of an MTi and of a DSP-1760, and wheel frames. The output is frames as SLCAN text, which a receiver reads. As on
//! the board, the coprocessor is polled every millisecond, to notice a silent sensor.
//!
//! Every clock and counter wraps during the drive: the part's 10 kHz ticks and the 32-bit microseconds of the board
//! and of the gyro start half the drive before they wrap, the counters of packets and messages wrap, SLCAN's stamps
//! restart each minute, and the accumulated yaw wraps many times. Every input sample is known, so every output can be
//! checked.

use crate::client::monitor::{Counts, Monitor};
use crate::drive::wheel_frames;
use crate::simulate::{Config as Simulated, Sample, Simulation};
use gyronet::can::slcan::emit_stamped;
use gyronet::coprocessor::{Config, Coprocessor, TimedFrame};
use gyronet::fog::FogCounters;
use gyronet::health::{Counters, MonitorCounters, Status};
use gyronet::model::WindowNetwork;
use gyronet::sample::{PERIOD_US, RATE_HZ, WHEELS};
use gyronet::sensor::dsp1760::message::{Extra, Message, Validity};
use gyronet::sensor::dsp1760::{Dsp1760, Dsp1760Config, OutputRate};
use gyronet::sensor::xsens::{MtData2, Mti};
use gyronet::units::{Micros, Yaw};
use serde::Serialize;
use std::fmt;

/// A sample lasts this many ticks of SampleTimeFine.
const TICKS: u32 = (PERIOD_US / 100) as u32;
/// The status word of a good sample: self-test passed, filter valid.
const GOOD: u32 = 3;
/// Number of frames for each sample with the messages of [`Config::DEFAULT`], and for each step of the fibre-optic
/// gyro.
const FRAMES: u64 = 6;
const FOG_FRAMES: u64 = 3;
/// At most this many steps of the fibre-optic gyro may be lost at the ends of the drive.
const FOG_ENDS: u64 = 3;
/// Passes a frame to the receiver as SLCAN text.
fn take(monitor: &mut Monitor, sent: &TimedFrame) {
    let line = emit_stamped(&sent.frame, sent.time).expect("a data frame");
    let line = std::str::from_utf8(&line).expect("ASCII").trim_end();
    monitor.take_line(line, 0.0);
}

/// The board polls its inputs every millisecond.
const LOOK_US: u64 = 1_000;
/// Largest number of samples before the first corrected one, with a margin.
const INITIALISED: u32 = 100 * RATE_HZ;
/// Tolerance of the yaw, deg: half a least significant bit of the angle message, and one of each value that is
/// summed.
const YAW_TOLERANCE: f64 = 1e-6;

/// Tolerance of the sum of drop-in rates, deg: half a least significant bit of the rate for 10 ms, and the rounding
/// of a sum of floats.
const DROP_IN_TOLERANCE: f64 = 2.5e-5 + 1e-9;

/// Holds the results of a soak.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Soak {
    /// Samples sent.
    pub samples: u32,
    /// The pipeline's counters.
    pub pipeline: Counters,
    /// The sensor monitor's counters.
    pub watch: MonitorCounters,
    /// The fibre-optic gyro's counters.
    pub fog: FogCounters,
    /// The receiver's counters.
    pub receiver: Counts,
    /// Samples with each status: initialising, degraded, ready.
    pub statuses: [u32; 3],
    /// Time of the last sample at the pipeline minus the time that it was sent with, us.
    pub clock_error_us: i64,
    /// Time of the gyro's last message minus the time that it was sent with, us.
    pub gyro_clock_error_us: i64,
    /// Messages of the gyro that its parser reported missing or refused.
    pub gyro_lost: u32,
    /// Yaw at the receiver minus that of the pipeline, deg.
    pub yaw_error_deg: f64,
    /// Sum of the drop-in rates at the receiver minus that of the rates they were encoded from, deg. Each message
    /// carries the residual of the one before, so the difference stays below half a least significant bit for 10 ms.
    pub drop_in_error_deg: f64,
    /// Total angle that the car turned, left and right added, in turns.
    pub turns: f64,
    /// Times that the part's ticks, the board's and the gyro's 32-bit microseconds wrapped.
    pub wraps: [u32; 3],
    /// Resident memory after a tenth of the drive and at its end, KiB; `None` where the system does not report it.
    pub memory_kib: Option<[u64; 2]>,
}

/// Runs a drive of this many samples. `tick` is called once per simulated minute.
///
/// # Panics
/// If the parsers reject the module's own bytes.
pub fn run(samples: u32, network: &mut impl WindowNetwork, mut tick: impl FnMut()) -> Soak {
    let mut drive = Drive::new(samples);
    let mut early = None;
    let simulation = Simulation::new(&Simulated::DEFAULT);
    for (k, sample) in (0..samples).zip(simulation) {
        drive.sample(k, &sample, network);
        if k == samples / 10 {
            early = resident_kib();
        }
        if k % (60 * RATE_HZ) == 0 {
            tick();
        }
    }
    drive.finish(samples, early)
}

struct Drive {
    mti: Mti,
    gyro: Dsp1760,
    coprocessor: Coprocessor,
    monitor: Monitor,
    /// First values of the part's ticks, the board's clock, the gyro's clock.
    starts: [u32; 3],
    statuses: [u32; 3],
    /// Yaw of the pipeline, and of the receiver, when the receiver first had one.
    yaw: Option<(Yaw, Yaw)>,
    turned: f64,
    drop_in_error: f64,
    clock_error_us: i64,
    gyro_clock_error_us: i64,
    gyro_lost: u32,
}

impl Drive {
    fn new(samples: u32) -> Self {
        let half = samples / 2;
        let rate = OutputRate::new(RATE_HZ as u16).expect("a rate that the part offers");
        let micros = half.wrapping_mul(PERIOD_US as u32);
        Self {
            mti: Mti::new(),
            gyro: Dsp1760::new(Dsp1760Config { rate, ..Dsp1760Config::DEFAULT }),
            coprocessor: Coprocessor::new(Config {
                wheels: Some(wheel_frames::receiver()),
                ..Config::DEFAULT
            }),
            monitor: Monitor::new(&Config::DEFAULT.can),
            starts: [
                0u32.wrapping_sub(half.wrapping_mul(TICKS)),
                0u32.wrapping_sub(micros),
                0u32.wrapping_sub(micros),
            ],
            statuses: [0; 3],
            yaw: None,
            turned: 0.0,
            drop_in_error: 0.0,
            clock_error_us: 0,
            gyro_clock_error_us: 0,
            gyro_lost: 0,
        }
    }

    fn sample(&mut self, k: u32, sample: &Sample, network: &mut impl WindowNetwork) {
        let message = MtData2 {
            packet_counter: Some(k as u16),
            sample_time_fine: Some(self.starts[0].wrapping_add(k.wrapping_mul(TICKS))),
            acceleration: Some(sample.specific_force.map(|force| force as f32)),
            rate_of_turn: Some(sample.angular_rate.map(|rate| rate as f32)),
            temperature: None,
            status: Some(GOOD),
        };
        message.emit().iter().for_each(|byte| self.mti.receive(*byte));
        let received = self.mti.next_sample().and_then(Result::ok).expect("a message of our own");
        let sent = u64::from(self.starts[0]) * 100 + u64::from(k) * PERIOD_US;
        self.clock_error_us = received.time.0 as i64 - sent as i64;

        let now = Micros(u64::from(self.starts[1]) + u64::from(k) * PERIOD_US + LOOK_US);
        if k > 0 {
            for look in (now.0 - PERIOD_US + LOOK_US..now.0).step_by(LOOK_US as usize) {
                let silent = self.coprocessor.poll(Micros(look), &mut ()).expect("time goes on");
                assert!(silent.is_none(), "the sensor is not silent");
            }
        }
        self.gyro(k, sample, now);
        let wheels = wheel_frames::frame([Some(3.6 * sample.speed); WHEELS]).expect("four speeds");
        self.coprocessor.can(&wheels, now).expect("a good wheel frame");
        let Self { coprocessor, monitor, .. } = self;
        let mut send = |sent: TimedFrame| take(monitor, &sent);
        let vehicle = coprocessor.imu(received, now, &mut send).expect("a place on the grid").vehicle;
        if let Some(due) = self.coprocessor.window() {
            let estimate = network.estimate(&due.features);
            self.coprocessor.deliver(due.end, estimate).expect("the window that is due");
        }
        match vehicle.prompt.status {
            Status::Init => self.statuses[0] += 1,
            Status::Degraded => self.statuses[1] += 1,
            Status::Ready => self.statuses[2] += 1,
            // The sensor monitor counts any other status.
            _ => {}
        }
        if matches!(vehicle.prompt.status, Status::Degraded | Status::Ready) {
            let received = self.monitor.drop_in.unwrap_or(f64::NAN);
            self.drop_in_error +=
                (received - vehicle.prompt.rate.rad_per_sec().to_degrees()) / f64::from(RATE_HZ);
        }
        let yaw = vehicle.navigation.yaw;
        self.yaw = Some((self.yaw.map_or(yaw, |(first, _)| first), yaw));
        self.turned += sample.reference[2].abs() / f64::from(RATE_HZ);
    }

    /// Sends the fibre-optic gyro's message: 100 a second with its own 32-bit microseconds.
    fn gyro(&mut self, k: u32, sample: &Sample, now: Micros) {
        let time = self.starts[2].wrapping_add(k.wrapping_mul(PERIOD_US as u32));
        // A real gyro has noise; equal increments would count as stuck. The noise has mean zero over three samples.
        let flicker = (f64::from(k % 3) - 1.0) * 1e-7;
        let message = Message {
            rotation: sample.reference.map(|rate| (rate / f64::from(RATE_HZ) + flicker) as f32),
            acceleration: [0.0; 3],
            extra: Extra::Timed { time, temperature: 25 },
            validity: Validity::GYRO,
            sequence: (k % 128) as u8,
        };
        message.emit().iter().for_each(|byte| self.gyro.receive(*byte));
        while let Some(received) = self.gyro.next_sample() {
            match received {
                Ok(received) => {
                    self.gyro_lost += received.lost;
                    let sent = u64::from(self.starts[2]) + u64::from(k) * PERIOD_US;
                    self.gyro_clock_error_us = received.time.0 as i64 - sent as i64;
                    let Self { coprocessor, monitor, .. } = self;
                    let mut send = |sent: TimedFrame| take(monitor, &sent);
                    coprocessor.fog(received, now, &mut send).expect("in order");
                }
                Err(_) => self.gyro_lost += 1,
            }
        }
    }

    fn finish(self, samples: u32, early: Option<u64>) -> Soak {
        let wraps = |start: u32, span: u64| ((u64::from(start) + u64::from(samples - 1) * span) >> 32) as u32;
        let [ticks, board, gyro] = self.starts;
        let (first, last) = self.yaw.unwrap_or_default();
        Soak {
            samples,
            pipeline: *self.coprocessor.pipeline().counters(),
            watch: *self.coprocessor.monitor_counters(),
            fog: *self.coprocessor.fog_counters(),
            receiver: self.monitor.counts,
            statuses: self.statuses,
            clock_error_us: self.clock_error_us,
            gyro_clock_error_us: self.gyro_clock_error_us,
            gyro_lost: self.gyro_lost,
            yaw_error_deg: self.monitor.state.yaw.unwrap_or(f64::NAN)
                - (last.rad() - first.rad()).to_degrees(),
            drop_in_error_deg: self.drop_in_error,
            turns: self.turned / std::f64::consts::TAU,
            wraps: [wraps(ticks, TICKS.into()), wraps(board, PERIOD_US), wraps(gyro, PERIOD_US)],
            memory_kib: early.zip(resident_kib()).map(|(early, late)| [early, late]),
        }
    }
}

impl Soak {
    /// Returns the names of the failed checks.
    #[must_use]
    pub fn faults(&self) -> Vec<String> {
        let samples = u64::from(self.samples);
        let Counters { missing, misplaced, clock_jumps, late, .. } = self.pipeline;
        let Counts { foreign, lost, repeated, out_of_sequence, damaged, unreadable, frames } = self.receiver;
        let MonitorCounters { silences, stuck, .. } = self.watch;
        let fog_frames = frames.saturating_sub(FRAMES * samples);
        let fog_steps = samples - FOG_ENDS..=samples;
        let yaw = self.yaw_error_deg.abs() <= YAW_TOLERANCE;
        let memory = self.memory_kib.is_none_or(|[early, late]| late <= early + 64);
        let [init, ..] = self.statuses;
        [
            ("samples of the pipeline", u64::from(self.pipeline.samples) == samples),
            ("missing, misplaced or late", [missing, misplaced, clock_jumps, late] == [0; 4]),
            ("silent or stuck", [silences, stuck] == [0; 2]),
            ("fibre-optic gyro's samples", u64::from(self.fog.samples) == samples),
            ("fibre-optic gyro's gaps", (self.fog.gaps, self.fog.misplaced) == (0, 0)),
            (
                "frames at the receiver",
                fog_frames.is_multiple_of(FOG_FRAMES) && fog_steps.contains(&(fog_frames / FOG_FRAMES)),
            ),
            (
                "loss at the receiver",
                [foreign, lost, repeated, out_of_sequence, damaged, unreadable] == [0; 6],
            ),
            ("initialisation", init < INITIALISED),
            ("the part's clock", self.clock_error_us == 0),
            ("the gyro's clock or sequence", (self.gyro_clock_error_us, self.gyro_lost) == (0, 0)),
            ("yaw at the receiver", yaw),
            ("drop-in rates at the receiver", self.drop_in_error_deg.abs() <= DROP_IN_TOLERANCE),
            ("memory grows", memory),
        ]
        .into_iter()
        .filter(|(_, holds)| !holds)
        .map(|(what, _)| what.to_owned())
        .collect()
    }
}

impl fmt::Display for Soak {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let hours = f64::from(self.samples) / f64::from(RATE_HZ) / 3600.0;
        let Counters { samples, windows, missing, misplaced, clock_jumps, late, .. } = self.pipeline;
        let Counts { frames, lost, repeated, out_of_sequence, damaged, .. } = self.receiver;
        let ([init, degraded, ready], [ticks, board, gyro]) = (self.statuses, self.wraps);
        let FogCounters { samples: fog, gaps, stuck, .. } = self.fog;
        writeln!(f, "{hours:.2} simulated hours, {:.0} turns of the car", self.turns)?;
        writeln!(
            f,
            "pipeline: {samples} samples, {windows} windows, {missing} missing, {misplaced} misplaced, \
             {clock_jumps} clock jumps, {late} late"
        )?;
        writeln!(f, "fibre-optic gyro: {fog} samples, {gaps} gaps, {stuck} times stuck")?;
        writeln!(f, "status: {init} initialising, {degraded} degraded, {ready} ready")?;
        writeln!(
            f,
            "receiver: {frames} frames, {lost} lost, {repeated} repeated, {out_of_sequence} out of sequence, \
             {damaged} damaged"
        )?;
        writeln!(
            f,
            "wraps: 10 kHz ticks {ticks}, board's microseconds {board}, gyro's microseconds {gyro}; clock \
             errors {} us, {} us",
            self.clock_error_us, self.gyro_clock_error_us
        )?;
        writeln!(f, "yaw at the receiver minus the pipeline's: {:.1e} deg", self.yaw_error_deg)?;
        writeln!(
            f,
            "drop-in rates at the receiver minus the encoded rates: {:.1e} deg",
            self.drop_in_error_deg
        )?;
        match self.memory_kib {
            Some([early, late]) => write!(f, "memory: {early} KiB after a tenth, {late} KiB at the end"),
            None => write!(f, "memory: unknown on this system"),
        }
    }
}

/// Returns the resident memory of this process, KiB; `None` except on Linux.
fn resident_kib() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:"))?;
    line.split_whitespace().next()?.parse().ok()
}
