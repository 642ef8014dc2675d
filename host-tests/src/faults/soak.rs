//! Hours of a simulated drive without a fault, in which every clock and counter wraps.
//!
//! The part's 10 kHz ticks and the 32-bit microseconds of the board and of the fibre-optic gyro wrap in the middle of
//! the drive; the counters of packets and messages and the accumulated yaw wrap many times. Every input is known, so
//! every output can be checked.

use super::board::Board;
use super::drive::Reading;
use super::fault::Line;
use super::networks::Networks;
use super::scene::messages;
use gyronet::can::config::Config;
use gyronet::health::Status;
use gyronet::sample::{ImuSample, PERIOD_US, RATE_HZ, Validity, WHEELS};
use gyronet::units::{AngularRate, Micros, SpecificForce};
use gyronet_tools::client::monitor::{Counts, Monitor};
use gyronet_tools::parts::Part;
use gyronet_tools::parts::dsp1760::MESSAGES;
use gyronet_tools::simulate::{self, Sample, Simulation};

const WRAP: u64 = 1 << 32;
/// Frames for each sample with the messages of [`Config::DEFAULT`], and for each step of the fibre-optic gyro.
const FRAMES: u64 = 6;
const FOG_FRAMES: u64 = 3;
/// At most this many steps of the fibre-optic gyro may be lost at the ends of the drive.
const FOG_ENDS: u64 = 3;
/// Largest number of samples before the first corrected one, with a margin.
const INITIALISED: u64 = 100 * RATE_HZ as u64;
/// Tolerance of the yaw, deg: half a least significant bit of the angle message, and one of each value that is
/// summed.
const YAW_TOLERANCE: f64 = 1e-6;
/// Tolerance of the sum of drop-in rates, deg: half a least significant bit of the rate for 10 ms, and the rounding
/// of a sum of floats.
const DROP_IN_TOLERANCE: f64 = 2.5e-5 + 1e-9;
/// Growth of the memory in the second half of the drive, KiB.
const GROWTH_KIB: u64 = 64;

/// Runs a drive of this many samples and returns a line for each check: what it measured, and whether it holds.
pub fn run(samples: u64) -> Vec<(String, bool)> {
    let start = WRAP - samples / 2 * PERIOD_US;
    // The board starts long after time 0, so the gyro is not expected from then on.
    let mut board = Board::new(Part::Dsp1760, false);
    let (mut networks, mut monitor) = (Networks::default(), Monitor::new(&Config::DEFAULT));
    let (mut early, mut ready, mut turned, mut drop_in_error) = (None, 0_u64, 0.0, 0.0);
    let mut yaw = None;
    let simulation = Simulation::new(&simulate::Config::DEFAULT);
    for (row, sample) in (0..samples).zip(simulation) {
        let now = start + row * PERIOD_US;
        let mut messages = messages(&[reading(now, &sample)], row as usize, Part::Dsp1760);
        // The board's time begins with the first sample.
        let from = if row == 0 { now - 1 } else { now - PERIOD_US };
        messages.retain(|message| message.at > from || message.line == Line::Wheels);
        let out = board.run(row as usize, (from, now), &mut messages.into_iter().peekable(), &mut networks);
        for line in out {
            monitor.take_line(std::str::from_utf8(&line.bytes).expect("ASCII").trim_end(), 0.0);
        }
        let vehicle = board.newest.expect("a sample in each row");
        let good = matches!(vehicle.live.status, Status::Degraded | Status::Ready);
        ready += u64::from(good);
        if good {
            let received = monitor.drop_in.unwrap_or(f64::NAN);
            drop_in_error += (received - vehicle.live.rate.rad_per_sec().to_degrees()) / f64::from(RATE_HZ);
        }
        let newest = vehicle.delayed.yaw;
        yaw = Some((yaw.map_or(newest, |(first, _)| first), newest));
        turned += sample.reference[2].abs() / f64::from(RATE_HZ) / std::f64::consts::TAU;
        if row == samples / 2 {
            early = resident_kib();
        }
    }
    let pipeline = board.coprocessor.pipeline().counters();
    let watch = board.coprocessor.monitor_counters();
    let fog = board.coprocessor.fog_counters();
    let Counts { frames, foreign, lost, repeated, out_of_sequence, damaged, unreadable } = monitor.counts;
    let fog_frames = frames.saturating_sub(FRAMES * samples);
    let fog_steps = samples - FOG_ENDS..=samples;
    let (first, last) = yaw.unwrap_or_default();
    let yaw_error = monitor.state.yaw.unwrap_or(f64::NAN) - (last.rad() - first.rad()).to_degrees();
    let memory = early.zip(resident_kib());
    let pipeline_errors = [pipeline.missing, pipeline.misplaced, pipeline.clock_jumps, pipeline.late];
    let fog_all = u64::from(fog.samples) == MESSAGES * (samples - 1) + 1;
    let receiver_errors = [foreign, lost, repeated, out_of_sequence, damaged, unreadable];
    vec![
        (format!("{} samples of the pipeline", pipeline.samples), u64::from(pipeline.samples) == samples),
        (format!("{pipeline_errors:?} missing, misplaced, clock jumps, late"), pipeline_errors == [0; 4]),
        (
            format!("{} times silent, {} stuck", watch.silences, watch.stuck),
            watch.silences + watch.stuck == 0,
        ),
        (format!("{} bad frames of the parts", board.input.bad_frames()), board.input.bad_frames() == 0),
        (format!("{} samples of the fibre-optic gyro", fog.samples), fog_all),
        // The grid's first step is incomplete.
        (format!("{} gaps, {} misplaced", fog.gaps, fog.misplaced), (fog.gaps, fog.misplaced) == (1, 0)),
        (
            format!("{frames} frames at the receiver"),
            fog_frames.is_multiple_of(FOG_FRAMES) && fog_steps.contains(&(fog_frames / FOG_FRAMES)),
        ),
        (format!("{receiver_errors:?} wrong frames at the receiver"), receiver_errors == [0; 6]),
        (format!("{ready} samples ready or degraded"), ready + INITIALISED > samples),
        (
            format!("{yaw_error:.1e} deg of yaw at the receiver minus the pipeline's"),
            yaw_error.abs() <= YAW_TOLERANCE,
        ),
        (
            format!("{drop_in_error:.1e} deg of drop-in rates at the receiver minus the encoded ones"),
            drop_in_error.abs() <= DROP_IN_TOLERANCE,
        ),
        (
            format!("{memory:?} KiB after a half and at the end"),
            memory.is_none_or(|(early, late)| late <= early + GROWTH_KIB),
        ),
        (format!("{turned:.1} turns of the car"), turned > samples as f64 / f64::from(RATE_HZ) / 3600.0),
    ]
}

fn reading(now: u64, sample: &Sample) -> Reading {
    let rate = |rate: f64| AngularRate::from_rad_per_sec(rate as f32).expect("a rate of a car");
    let force = |force: f64| SpecificForce::from_metre_per_sec2(force as f32).expect("a force on a car");
    let imu = ImuSample {
        time: Micros(now),
        angular_rate: sample.angular_rate.map(rate),
        specific_force: sample.specific_force.map(force),
        temperature: None,
        validity: Validity::Good,
    };
    // The part's ticks are 100 us long: its 32 bits of ticks, and the low 32 bits of the gyro's microseconds, wrap
    // with the board's clock.
    let mut reading =
        Reading { epoch_us: 99 * WRAP, ..Reading::new(imu, [Some(3.6 * sample.speed); WHEELS]) };
    reading.fog = sample.reference.map(rate);
    reading
}

/// The memory of this process, KiB; `None` except on Linux.
fn resident_kib() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("RssAnon:"))?;
    line.split_whitespace().next()?.parse().ok()
}
