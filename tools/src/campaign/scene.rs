//! A drive with one part, undamaged: where every run begins, and what it is held against.

use super::board::{Board, Known, Remembering};
use super::drive::{Drive, Reading};
use super::fault::{Fault, Line, Span};
use super::judge::{Baseline, Outcome, Times};
use super::motion::disturb;
use super::part::Part;
use super::receiver::Receiver;
use super::wire::{Message, damage};
use embedded_can::{Frame, StandardId};
use gyronet::can::{DataFrame, slcan};
use gyronet::compensate::{CompensateConfig, Hop, Mode};
use gyronet::model::{Estimate, SCALE_MIN, WindowNetwork};
use gyronet::pipeline::PipelineConfig;
use gyronet::sample::{PERIOD_US, RATE_HZ, WHEELS};
use gyronet::units::{AngularRate, Micros};
use gyronet::window::{Features, WINDOW};
use std::ops::Range;
use std::sync::OnceLock;

/// Runs may begin so many rows apart.
pub const STATE_EVERY: usize = RATE_HZ as usize;
/// Wheel frames come with every second row.
const WHEEL_ROWS: usize = 2;
/// When in a row they do, microseconds before its end.
const WHEEL_BEFORE_US: u64 = 3_000;
/// The board looks at its clock so often.
const TURN_US: u64 = 1_000;

/// A drive, a part, and the undamaged run of both.
#[derive(Debug, Clone)]
pub struct Scene<'d> {
    /// The drive.
    pub drive: &'d Drive,
    /// The part.
    pub part: Part,
    /// What the network says of it.
    pub known: Known,
    /// What a receiver gets.
    pub baseline: Baseline,
    gyro_bias: [AngularRate; 3],
    /// Before every [`STATE_EVERY`]th row.
    states: Vec<(Board, Receiver)>,
}

/// Says nothing and takes note of what it is asked.
struct Collecting(Known);

impl WindowNetwork for Collecting {
    fn estimate(&mut self, window: &[Features; WINDOW]) -> Estimate {
        self.0.insert(*window, OnceLock::new());
        Estimate { corrections: [AngularRate::ZERO; WINDOW], scale: SCALE_MIN, clamped_inputs: 0 }
    }
}

/// A window with every sample.
const EVERY: PipelineConfig = PipelineConfig {
    compensate: CompensateConfig {
        mode: match Hop::new(1) {
            Some(hop) => Mode::Overlap { hop },
            None => Mode::Newest,
        },
        ..CompensateConfig::DEFAULT
    },
    ..PipelineConfig::DEFAULT
};

impl<'d> Scene<'d> {
    /// Runs the drive undamaged.
    #[must_use]
    pub fn new(drive: &'d Drive, part: Part, network: &mut impl WindowNetwork) -> Self {
        let messages = messages(&drive.readings, 0, part);
        let mut collecting = Collecting(Known::new());
        let mut board = Board::new(part, EVERY);
        whole(&mut board, drive, &messages, &mut collecting, |_, _| {});
        let Collecting(known) = collecting;
        let mut board = Board::new(part, PipelineConfig::DEFAULT);
        let mut receiver = Receiver::new();
        let (mut states, mut seen) = (vec![(board.clone(), receiver.clone())], Vec::new());
        let rows = drive.readings.len();
        let mut events = Vec::with_capacity(rows);
        let mut network = Remembering { network, known: &known };
        whole(&mut board, drive, &messages, &mut network, |board, out| {
            out.iter().for_each(|message| receiver.receive(message, &mut seen));
            events.push(board.events());
            if events.len() % STATE_EVERY == 0 {
                states.push((board.clone(), receiver.clone()));
            }
        });
        let lag = CompensateConfig::DEFAULT.lag.samples();
        let baseline = Baseline::new(rows, &seen, &events, drive.truth.as_deref(), lag);
        Self { drive, part, gyro_bias: board.gyro_bias(), known, baseline, states }
    }

    /// Rows.
    #[must_use]
    pub fn rows(&self) -> usize {
        self.drive.readings.len()
    }

    /// Runs a stretch with faults; it begins where a state is kept.
    pub fn run(&self, span: Span, faults: &[Fault], network: &mut impl WindowNetwork) -> Outcome {
        self.run_on(span, faults, None, &mut Remembering { network, known: &self.known }, |_, _| {})
    }

    /// [`Scene::run`] on a network that is asked about every window; `upset`: when something else
    /// than the faults is done, microseconds; `reach`: called before each row with its number.
    pub fn run_on(
        &self,
        span: Span,
        faults: &[Fault],
        upset: Option<u64>,
        network: &mut impl WindowNetwork,
        mut reach: impl FnMut(usize, &mut Board),
    ) -> Outcome {
        let (mut board, mut receiver) = self.states[span.from / STATE_EVERY].clone();
        let mut readings = self.drive.readings[span.from..span.to].to_vec();
        let mut begin = upset;
        let mut began = |at: Option<u64>| begin = begin.into_iter().chain(at).min();
        for fault in faults {
            began(disturb(&mut readings, span.from, fault, self.part, self.gyro_bias));
        }
        let mut messages = messages(&readings, span.from, self.part);
        for fault in faults.iter().filter(|fault| fault.line != Line::Out) {
            began(damage(&mut messages, fault));
        }
        let mut out = Vec::new();
        let mut rest = messages.iter().peekable();
        let start = readings.first().map_or(0, |reading| reading.at - PERIOD_US);
        let mut last = start;
        for (row, reading) in (span.from..).zip(&readings) {
            reach(row, &mut board);
            turn(&mut board, &mut rest, row, last..reading.at, network, &mut out);
            last = reading.at;
        }
        for fault in faults.iter().filter(|fault| fault.line == Line::Out) {
            began(damage(&mut out, fault));
        }
        let mut seen = Vec::new();
        out.iter().for_each(|message| receiver.receive(message, &mut seen));
        receiver.time(last, &mut seen);
        let at = |row: usize| readings.get(row - span.from).map_or(last, |reading| reading.at);
        let over = faults.iter().map(|fault| at(fault.from + fault.rows)).chain(upset);
        let end = over.max().unwrap_or(last);
        let begin = begin.unwrap_or(last);
        let times = Times { from: span.from, to: span.to, begin, end, last };
        let mut outcome = self.baseline.judge(&seen, times);
        outcome.counted = board.events() != self.baseline.events(span.to - 1);
        outcome
    }
}

/// A whole drive; what went out in each row.
fn whole(
    board: &mut Board,
    drive: &Drive,
    messages: &[Message],
    network: &mut impl WindowNetwork,
    mut sent: impl FnMut(&mut Board, &[Message]),
) {
    let mut rest = messages.iter().peekable();
    for (row, reading) in drive.readings.iter().enumerate() {
        let mut out = Vec::new();
        turn(board, &mut rest, row, reading.at - PERIOD_US..reading.at, network, &mut out);
        sent(board, &out);
    }
}

/// A row's time on the board.
fn turn<'m>(
    board: &mut Board,
    rest: &mut std::iter::Peekable<impl Iterator<Item = &'m Message>>,
    row: usize,
    time: Range<u64>,
    network: &mut impl WindowNetwork,
    out: &mut Vec<Message>,
) {
    let mut now = time.start;
    while now < time.end {
        now = (now + TURN_US).min(time.end);
        while let Some(message) = rest.next_if(|message| message.at <= now) {
            board.receive(message, Micros(now), network, out);
        }
        board.poll(Micros(now), row, network, out);
    }
}

/// All messages of some rows, in the order of their coming.
fn messages(readings: &[Reading], first_row: usize, part: Part) -> Vec<Message> {
    let mut messages = Vec::new();
    for (row, reading) in (first_row..).zip(readings) {
        if row.is_multiple_of(WHEEL_ROWS) {
            messages.extend(wheel_frame(row, reading));
        }
        part.send(row, reading, &mut messages);
    }
    messages.sort_by_key(|message| message.at);
    messages
}

/// The vehicle's wheel frame as an SLCAN line; `None` where the drive has no wheels.
fn wheel_frame(row: usize, reading: &Reading) -> Option<Message> {
    let [front_left, front_right, rear_left, rear_right] = reading.wheels;
    let mut data = [0; 8];
    let places: [Option<f64>; WHEELS] = [front_right, front_left, rear_right, rear_left];
    for (bytes, speed) in data.chunks_exact_mut(2).zip(places) {
        // 0.01 km/h from -67.67.
        bytes.copy_from_slice(&((libm::round((speed? + 67.67) * 100.0)) as u16).to_be_bytes());
    }
    let frame = DataFrame::new(StandardId::new(0xAA)?, &data)?;
    let line = slcan::emit(&frame)?;
    Some(Message { line: Line::Wheels, row, at: reading.at - WHEEL_BEFORE_US, bytes: line.to_vec() })
}
