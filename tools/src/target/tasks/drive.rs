//! This module sends input to the emulated image while its handlers are counted.

use crate::client::bus::SlcanBus;
use crate::client::connection::Connection;
use crate::client::device::Device;
use crate::client::device::error::DeviceError;
use crate::client::device::requests::FOG_MESSAGES;
use crate::simulate::{Config, Sample, Simulation};
use crate::target::emulator::{Board, EmulatorError};
use embedded_can::{Frame, Id};
use gyronet::can::yaw::RateMessage;
use gyronet::can::{DataFrame, slcan};
use gyronet::sensor::dsp1760::message::{Extra, Message, Validity};
use gyronet::sensor::xsens::MtData2;
use std::path::Path;
use std::time::{Duration, Instant};

/// Number of samples for the image: for static initialisation and forty windows.
const SAMPLES: usize = 500;
/// Timeout of sending and processing a sample.
const TURN: Duration = Duration::from_secs(10);
/// Least number of windows of the network that must run for a reliable cost.
const WINDOWS: u32 = 20;
/// One instruction takes 8 ns of the board's clock, so the board runs about 125 million instructions a second.
const ICOUNT: &str = "shift=3";
/// Number of the fibre-optic gyro's messages per sample.
const GYRO_MESSAGES: usize = 10;
/// Identifier of the inertial sensor's rate.
const IMU_RATE: u16 = 0x1A0;
/// Largest number of attempts if the host is too slow.
const ATTEMPTS: u32 = 3;
/// Numbers of the board's USARTs.
const IMU: usize = 1;
const SLCAN: usize = 2;
const GYRO: usize = 3;
const SERVICE: usize = 6;

/// Runs the image with input and returns the plugin's output. `loaded` are the arguments that load the flash. The run
/// is repeated if the host was so slow that the image found its sensor silent, because that changes the load.
pub fn run(image: &Path, plugin: &str, loaded: &[String]) -> Result<String, EmulatorError> {
    let (mut silences, mut output) = attempt(image, plugin, loaded)?;
    for _ in 1..ATTEMPTS {
        if silences > 0 {
            (silences, output) = attempt(image, plugin, loaded)?;
        }
    }
    Ok(output)
}

/// Sends all input, sample by sample, and ends the emulator; returns the number of times that the sensor was found
/// silent, and the plugin's output.
fn attempt(image: &Path, plugin: &str, loaded: &[String]) -> Result<(u32, String), EmulatorError> {
    let mut arguments = vec!["-icount", ICOUNT, "-plugin", plugin];
    arguments.extend(loaded.iter().map(String::as_str));
    let mut board = Board::boot(image, SERVICE, &arguments)?;
    // Sends a line end once the image listens.
    board.send(SERVICE, b"\r", TURN)?;
    let address = board.serve(SERVICE)?.to_string();
    let line = SlcanBus::open(&address, 0).map_err(|error| board.failed(error.to_string()))?;
    let mut device = Device::new(line, &address);
    for (k, sample) in Simulation::new(&Config::DEFAULT).take(SAMPLES).enumerate() {
        // The wheel frame (Toyota's) says that the vehicle stands. A host sends commands every 50 samples.
        board.send(SLCAN, b"t0AA81A6F1A6F1A6F1A6F\r", TURN)?;
        if k % 50 == 0 {
            board.send(SLCAN, b"V\rN\rF\r", TURN)?;
        }
        let numbers = GYRO_MESSAGES * k..GYRO_MESSAGES * (k + 1);
        let messages: Vec<u8> = numbers.flat_map(|number| increment(number, &sample).emit()).collect();
        // The gyro's messages of 10 ms arrive before the sample, so that no activation processes both: the schedule
        // adds them up.
        board.send(GYRO, &messages, TURN)?;
        await_messages(&mut board, &mut device, GYRO_MESSAGES * (k + 1))?;
        board.send(IMU, &message(k, &sample).emit(), TURN)?;
        if k % 10 == 0 {
            // The answers to these commands are sent while the request arrives.
            board.send(SERVICE, b"V\rN\rV\rN\r", TURN)?;
            ask(&mut device, k / 10).map_err(|error| board.failed(error.to_string()))?;
        }
        board.await_sent(SLCAN, TURN, |sent| sets(sent) > k)?;
    }
    let counters = device.counters().map_err(|error| board.failed(error.to_string()))?;
    let windows = counters.pipeline.windows;
    if windows < WINDOWS {
        return Err(board.failed(format!("only {windows} windows were used")));
    }
    Ok((counters.watch.silences, board.quit()?))
}

/// Requests one of the longer responses.
fn ask(device: &mut Device<SlcanBus<Connection>>, number: usize) -> Result<(), DeviceError> {
    match number % 3 {
        0 => device.info().map(drop),
        1 => device.configuration().map(drop),
        _ => device.log(0).map(drop),
    }
}

/// Waits until the image has received `least` messages of the gyro. The response fits in one frame, so the host's
/// speed has little effect.
fn await_messages(
    board: &mut Board,
    device: &mut Device<SlcanBus<Connection>>,
    least: usize,
) -> Result<(), EmulatorError> {
    let until = Instant::now() + TURN;
    loop {
        let taken = device.read(FOG_MESSAGES).map_err(|error| board.failed(error.to_string()))?;
        let taken = taken.first_chunk().map_or(0, |word| u32::from_be_bytes(*word));
        if taken as usize >= least {
            return Ok(());
        }
        if Instant::now() > until {
            return Err(board.failed(format!("{taken} of {least} messages of the gyro were taken")));
        }
    }
}

/// Returns the number of samples whose rate was sent; a silent sensor's message has no rate.
fn sets(sent: &[u8]) -> usize {
    let lines = sent.split(|byte| *byte == b'\r').filter_map(|line| slcan::parse::<DataFrame>(line).ok());
    let own = lines.filter(|frame| matches!(frame.id(), Id::Standard(found) if found.as_raw() == IMU_RATE));
    own.filter_map(|frame| RateMessage::parse(frame.data()).ok())
        .filter(|rate| rate.deg_per_sec().is_some())
        .count()
}

fn message(k: usize, sample: &Sample) -> MtData2 {
    MtData2 {
        packet_counter: Some(k as u16),
        sample_time_fine: Some(100 * k as u32),
        acceleration: Some(sample.specific_force.map(|force| force as f32)),
        rate_of_turn: Some(sample.angular_rate.map(|rate| rate as f32)),
        temperature: Some(25.0),
        status: Some(3),
    }
}

fn increment(number: usize, sample: &Sample) -> Message {
    // The reading changes, because a gyro that repeats itself counts as stuck.
    let noise = if (number / GYRO_MESSAGES).is_multiple_of(2) { 1e-8 } else { -1e-8 };
    Message {
        rotation: sample.reference.map(|rate| (rate * 1e-3 + noise) as f32),
        acceleration: [0.0, 0.0, 1.0],
        extra: Extra::Temperature(25),
        validity: Validity::GYRO,
        sequence: (number % 128) as u8,
    }
}
