//! This module feeds the emulated image while it is counted.

use crate::simulate::{Config, Sample, Simulation};
use crate::target::emulator::{Board, EmulatorError};
use gyronet::sensor::dsp1760::message::{Extra, Message, Validity};
use gyronet::sensor::xsens::MtData2;
use gyronet::service::frame::{Deframer, emit};
use gyronet::service::message::AllCounters;
use gyronet::service::{Reply, Request};
use std::path::Path;
use std::time::{Duration, Instant};

/// The image gets this many samples: for static initialisation, and forty windows.
const SAMPLES: usize = 500;
/// A sample may take at most this long.
const TURN: Duration = Duration::from_secs(10);
const ASK: Duration = Duration::from_millis(20);
/// At least this many windows of the network must have run for its cost to be known.
const WINDOWS: u32 = 20;
/// An instruction takes 8 ns: the board's clock and its instructions keep the ratio of about 125 million instructions a
/// second.
const ICOUNT: &str = "shift=3";
/// The fibre-optic gyro sends this many messages a sample.
const GYRO_MESSAGES: usize = 10;
/// USARTs of the board.
const IMU: usize = 1;
const SLCAN: usize = 2;
const GYRO: usize = 3;
const SERVICE: usize = 6;

/// Sends everything, one sample after the other, and ends the emulator; returns the plugin's output.
pub fn run(image: &Path, plugin: &str) -> Result<String, EmulatorError> {
    let mut board = Board::boot(image, SERVICE, &["-icount", ICOUNT, "-plugin", plugin])?;
    let [info, configuration, log] = [Request::Info, Request::GetConfiguration, Request::Log { after: 0 }]
        .map(|request| emit(1, &request).unwrap_or_default());
    let mut answers = Answers::default();
    for (k, sample) in Simulation::new(&Config::DEFAULT).take(SAMPLES).enumerate() {
        // Toyota's frame says that the vehicle stands; from time to time a host sends a request.
        board.send(SLCAN, b"t0AA81A6F1A6F1A6F1A6F\r", TURN)?;
        if k % 50 == 0 {
            board.send(SLCAN, b"V\rN\rF\r", TURN)?;
        }
        let numbers = GYRO_MESSAGES * k..GYRO_MESSAGES * (k + 1);
        let messages: Vec<u8> = numbers.flat_map(|number| increment(number, &sample).emit()).collect();
        // The gyro's messages of ten milliseconds come first, then the sample: the schedule adds up the activations
        // that process them.
        board.send(GYRO, &messages, TURN)?;
        answers.wait(&mut board, "the gyro's messages", |answers| {
            answers.messages as usize >= GYRO_MESSAGES * (k + 1)
        })?;
        board.send(IMU, &message(k, &sample).emit(), TURN)?;
        ask(&mut board, [&info, &configuration, &log][k % 3])?;
        answers.wait(&mut board, "the sample", |answers| answers.samples as usize > k)?;
    }
    if answers.windows < WINDOWS {
        return Err(board.failed(format!("only {} windows were used", answers.windows)));
    }
    board.quit()
}

/// Sends a request byte by byte, so that some bytes come while an answer goes out, as on a slow line.
fn ask(board: &mut Board, question: &[u8]) -> Result<(), EmulatorError> {
    question.iter().try_for_each(|byte| board.send(SERVICE, &[*byte], TURN))
}

/// Holds the image's answers about its pipeline.
#[derive(Default)]
struct Answers {
    deframer: Deframer,
    /// Bytes of the service line that have been read.
    read: usize,
    samples: u32,
    windows: u32,
    /// Messages of the fibre-optic gyro.
    messages: u32,
}

impl Answers {
    /// Asks until the image has got so far, however slow the host is.
    fn wait(
        &mut self,
        board: &mut Board,
        what: &str,
        is_done: impl Fn(&Self) -> bool,
    ) -> Result<(), EmulatorError> {
        let counters = emit(1, &Request::Counters).unwrap_or_default();
        let until = Instant::now() + TURN;
        while !is_done(self) {
            if Instant::now() > until {
                let Self { samples, messages, .. } = self;
                let so_far = format!("{samples} samples and {messages} messages of the gyro were");
                return Err(board.failed(format!("{what} was not processed; {so_far}")));
            }
            ask(board, &counters)?;
            // Without an answer in time, the request is repeated.
            let _ = board.await_sent(SERVICE, ASK, |bytes| {
                self.read(bytes);
                is_done(self)
            });
        }
        Ok(())
    }

    /// Reads the newest of all answers.
    fn read(&mut self, bytes: &[u8]) {
        for byte in bytes.get(self.read..).unwrap_or_default() {
            if let Some(Ok((_, Reply::Counters(AllCounters { pipeline, fog, .. })))) =
                self.deframer.receive(*byte)
            {
                (self.samples, self.windows, self.messages) =
                    (pipeline.samples, pipeline.windows, fog.samples);
            }
        }
        self.read = bytes.len();
    }
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
