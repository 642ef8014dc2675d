//! This module runs a board with everything connected: an MTi, a fibre-optic gyro that is simulated from the reference,
//! and wheel frames over SLCAN. A board in the emulator and one on the host take the same inputs, one after the other.

use crate::recordings::Row;
use crate::{qemu, replay};
use embedded_can::{Frame, Id, StandardId};
use gyronet::can::bosch::TX1_ID;
use gyronet::can::yaw::RateMessage;
use gyronet::can::{DataFrame, slcan};
use gyronet::model::{Blob, weights};
use gyronet::sensor::dsp1760::message::{Extra, Message, Validity};
use gyronet::sensor::xsens::MtData2;
use gyronet::service::message::AllCounters;
use gyronet::store::Configuration;
use std::time::{Duration, Instant};

const LIMIT: Duration = Duration::from_secs(60);
const IMU: usize = 1;
const SLCAN: usize = 2;
const FOG: usize = 3;
/// The number of USARTs that such a board needs.
pub const USARTS: usize = qemu::SERVICE;
/// The gyro sends this many messages in 10 ms.
const MESSAGES_PER_ROW: usize = 10;
/// The gyro has this resolution, rad.
const FOG_STEP: f64 = 4e-8;
/// A sample of the MTi makes this many frames.
const FRAMES_PER_SAMPLE: usize = 6;
/// TX1 begins like this when the sensor is silent: no rate, failed.
const SILENT_TX1: &[u8] = b"t1748008020FF0080";
/// Wheel frames are this many samples apart.
const WHEEL_INTERVAL: usize = 2;
/// The vehicle stands for this many samples.
const STANDING_SAMPLES: usize = 600;

/// Holds the inputs of 10 ms, in order.
#[derive(Debug, Clone)]
pub struct Step {
    /// The frame of all four wheels, in the steps that have one.
    pub wheels: Option<DataFrame>,
    /// The message of the MTi.
    pub imu: MtData2,
    /// The bytes of the fibre-optic gyro.
    pub fog: Vec<u8>,
}

impl Step {
    /// Returns the inputs that belong to a row.
    #[must_use]
    pub fn from_row(number: usize, row: &Row) -> Self {
        let speed = if number < STANDING_SAMPLES { 0.0 } else { 20.0 };
        Self {
            wheels: number.is_multiple_of(WHEEL_INTERVAL).then(|| wheels(speed)),
            imu: replay::message(number, row),
            fog: fog_bytes(number, fog_reading(number, row)),
        }
    }

    fn inputs(self) -> impl Iterator<Item = Input> {
        let wheels = self.wheels.map(Input::Wheels);
        wheels.into_iter().chain([Input::Imu(self.imu.emit().to_vec()), Input::Fog(self.fog)])
    }
}

/// Returns each of the gyro's readings in the 10 ms that end with a row, rad: a tenth of the turn.
#[must_use]
pub fn fog_reading(number: usize, row: &Row) -> f32 {
    // A gyro that repeats itself counts as stuck, so no reading equals the one before.
    let noise = if number.is_multiple_of(2) { FOG_STEP / 4.0 } else { -FOG_STEP / 4.0 };
    ((row.reference * 0.01 / MESSAGES_PER_ROW as f64 / FOG_STEP).round() * FOG_STEP + noise) as f32
}

/// Returns the bytes that the gyro sends in the 10 ms that end with a row. For the first row it sends only the last
/// message, so that a message set always follows the last message of a row.
#[must_use]
pub fn fog_bytes(number: usize, reading: f32) -> Vec<u8> {
    let message = |part: usize| Message {
        rotation: [0.0, 0.0, reading],
        acceleration: [0.0; 3],
        extra: Extra::Temperature(25),
        validity: Validity::ALL,
        sequence: ((number * MESSAGES_PER_ROW + part) % 128) as u8,
    };
    let first = if number == 0 { MESSAGES_PER_ROW - 1 } else { 0 };
    (first..MESSAGES_PER_ROW).flat_map(|part| message(part).emit().to_vec()).collect()
}

/// Returns the frame of four wheels at the same speed, km/h.
fn wheels(speed: f64) -> DataFrame {
    let code = ((speed + 67.67) * 100.0).round() as u16;
    let id = StandardId::new(0xAA).expect("11 bits");
    DataFrame::new(id, &[code.to_be_bytes(); 4].concat()).expect("eight bytes")
}

/// One input on one line.
enum Input {
    Wheels(DataFrame),
    Imu(Vec<u8>),
    Fog(Vec<u8>),
}

impl Input {
    /// Passes the input to the host's board. Returns whether the frames show that all of it has been processed.
    fn pass_to(&self, host: &mut replay::Board) -> bool {
        match self {
            Self::Wheels(frame) => host.wheel(frame),
            Self::Imu(bytes) => host.push(bytes),
            Self::Fog(bytes) => {
                let before = host.fog().samples;
                let (last, rest) = bytes.split_last().expect("the gyro sends all the time");
                host.push_fog(rest);
                let lines = host.lines.len();
                host.push_fog(&[*last]);
                return host.lines.len() > lines || host.fog().samples == before;
            }
        }
        true
    }

    fn usart_and_bytes(&self) -> (usize, Vec<u8>) {
        match self {
            Self::Wheels(frame) => (SLCAN, slcan::emit(frame).expect("a data frame").to_vec()),
            Self::Imu(bytes) => (IMU, bytes.clone()),
            Self::Fog(bytes) => (FOG, bytes.clone()),
        }
    }
}

/// Holds the results of both boards.
pub struct Outcome {
    /// The host's board, which never finds its sensor silent.
    pub host: replay::Board,
    /// The host's board that was silent whenever the emulated one was.
    pub followed: replay::Board,
    /// The number of frames of the emulated board.
    pub sent: usize,
    /// The counters of the emulated board.
    pub counters: AllCounters,
}

/// Passes each input to the emulated board once the board has processed the previous one, since their order matters.
/// Every frame must equal the host's.
///
/// # Panics
/// When a frame differs or is missing.
#[must_use]
pub fn run(board: &mut qemu::Board, configuration: &Configuration, steps: &[Step]) -> Outcome {
    let mut device = board.device(LIMIT);
    let weights = || Blob::new_checked(&weights::DEFAULT.0).expect("they come with the library");
    let mut host = replay::Board::configured(configuration, weights());
    let mut answers = 0;
    let inputs: Vec<Input> = steps.iter().cloned().flat_map(Step::inputs).collect();
    let mut host_silent = 0;
    for input in &inputs {
        let before = host.lines.len();
        let is_processed = input.pass_to(&mut host);
        host_silent += host.lines[before..].iter().filter(|line| line.starts_with(SILENT_TX1)).count();
        let (usart, bytes) = input.usart_and_bytes();
        board.send(usart, &bytes, LIMIT);
        answers += usize::from(usart == SLCAN);
        let awaited = host.lines.len() + answers;
        board.await_sent(SLCAN, LIMIT, |sent| {
            let lines = sent.split_inclusive(|byte| *byte == b'\r');
            let (all, silent) = lines.fold((0, 0), |(all, silent), line| {
                (all + usize::from(line.ends_with(b"\r")), silent + usize::from(line.starts_with(SILENT_TX1)))
            });
            all + host_silent * FRAMES_PER_SAMPLE >= awaited + silent * FRAMES_PER_SAMPLE
        });
        let until = Instant::now() + LIMIT;
        while !is_processed && counters(&mut device).fog.samples != host.fog().samples {
            assert!(Instant::now() < until, "the gyro's messages are not taken");
        }
    }
    let counters = counters(&mut device);
    let sent = frames(&board.lines(SLCAN, b'\r', 0, LIMIT));
    let mut followed = replay::Board::configured(configuration, weights()).follow_lines(sent.clone());
    for input in &inputs {
        input.pass_to(&mut followed);
    }
    replay::assert_same(&sent, &followed.lines);
    // Silences caused by a busy host are followed and compared too, but must not be most of what is compared.
    assert!(followed.followed < steps.len() as u64 / 2, "the host was busy: {}", followed.followed);
    Outcome { host, followed, sent: sent.len(), counters }
}

/// Returns the counters of a board.
///
/// # Panics
/// Where it does not answer.
pub fn counters(device: &mut qemu::Tester) -> AllCounters {
    // Idle copies the counters before it checks for a request: if the output task ran in between, the answer is too
    // old. The next one is not.
    let _ = device.counters();
    device.counters().expect("counters")
}

/// Returns a board on the host with this configuration, after these steps.
///
/// # Panics
/// When the library's own weights are refused.
#[must_use]
pub fn on_host(configuration: &Configuration, steps: &[Step]) -> replay::Board {
    let weights = Blob::new_checked(&weights::DEFAULT.0).expect("they come with the library");
    let mut host = replay::Board::configured(configuration, weights);
    for input in steps.iter().cloned().flat_map(Step::inputs) {
        input.pass_to(&mut host);
    }
    host
}

/// Returns the frames among lines, without the answers to the wheel frames.
fn frames(lines: &[Vec<u8>]) -> Vec<Vec<u8>> {
    lines.iter().filter(|line| line.starts_with(b"t")).cloned().collect()
}

/// Returns the frames with an identifier of 11 bits among lines, each with the number of the MTi's sample before it.
pub fn frames_with_id(lines: &[Vec<u8>], id: u16) -> impl Iterator<Item = (usize, DataFrame)> {
    let id = Id::Standard(StandardId::new(id).expect("11 bits"));
    let frames = lines.iter().map(|line| slcan::parse::<DataFrame>(line).expect("a frame"));
    let numbered = frames.scan(0, move |samples, frame| {
        *samples += usize::from(frame.id() == Id::Standard(TX1_ID));
        Some((samples.saturating_sub(1), frame))
    });
    numbered.filter(move |(_, frame)| frame.id() == id)
}

/// Returns the rates with an identifier, each with the number of the MTi's sample before it.
pub fn rates(lines: &[Vec<u8>], id: u16) -> impl Iterator<Item = (usize, RateMessage)> {
    frames_with_id(lines, id)
        .map(|(samples, frame)| (samples, RateMessage::parse(frame.data()).expect("a rate")))
}
