//! A scene is an undamaged run of a drive with one part. Every damaged run begins at one of the scene's stored
//! states, which saves running the drive up to there, and is compared with the scene.

use super::board::Board;
use super::drive::{Drive, Reading};
use super::encode::encode;
use super::fault::{Fault, Line, Span};
use super::judge::{Baseline, Limits, Outcome, Times};
use super::motion::disturb;
use super::networks::{Collecting, Known, Networks, Remembering};
use super::receiver::Receiver;
use super::wire::{Message, damage};
use crate::drive::wheel_frames;
use crate::parts::Part;
use gyronet::can::slcan;
use gyronet::compensate::{CompensateConfig, Hop, Mode};
use gyronet::pipeline::PipelineConfig;
use gyronet::sample::{PERIOD_US, RATE_HZ};
use gyronet::units::{AngularRate, Micros};
use std::ops::Range;

/// Runs may begin this many rows apart.
pub const STATE_EVERY: usize = RATE_HZ as usize;
/// A wheel frame arrives this long before the end of its row, microseconds.
const WHEEL_BEFORE_US: u64 = 3_000;
/// The board polls this often, microseconds.
const TURN_US: u64 = 1_000;

/// Holds a drive, a part, and the undamaged run of both.
#[derive(Debug, Clone)]
pub struct Scene<'d> {
    /// The drive.
    pub drive: &'d Drive,
    /// The part.
    pub part: Part,
    /// The networks' estimates for the undamaged run.
    pub known: Known,
    /// The messages of the undamaged run.
    pub baseline: Baseline,
    gyro_bias: [AngularRate; 3],
    /// The states before every [`STATE_EVERY`]th row.
    states: Vec<(Board, Receiver)>,
}

/// With this configuration a window is due with every sample.
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
    pub fn new(drive: &'d Drive, part: Part, networks: &mut impl Networks) -> Self {
        let messages = messages(&drive.readings, 0, part);
        let mut collecting = Collecting::default();
        let mut board = Board::new(part, EVERY);
        whole(&mut board, drive, &messages, &mut collecting, |_, _| {});
        let Collecting(known) = collecting;
        let mut board = Board::new(part, PipelineConfig::DEFAULT);
        let mut receiver = Receiver::new(part);
        let (mut states, mut seen) = (vec![(board.clone(), receiver.clone())], Vec::new());
        let rows = drive.readings.len();
        let mut events = Vec::with_capacity(rows);
        let mut networks = Remembering { networks, known: &known };
        whole(&mut board, drive, &messages, &mut networks, |board, out| {
            out.iter().for_each(|message| receiver.receive(message, &mut seen));
            events.push(board.events());
            if events.len() % STATE_EVERY == 0 {
                states.push((board.clone(), receiver.clone()));
            }
        });
        // A fibre-optic gyro's rate is that of its newest step.
        let (lag, limits) = match part {
            Part::Dsp1760 => (0, Limits::FIBRE_OPTIC),
            _ => (CompensateConfig::DEFAULT.lag.samples(), Limits::INERTIAL),
        };
        let late = |yaw: &Vec<f64>| (0..rows).map(|row| yaw[row.saturating_sub(lag)]).collect();
        let truth = drive.truth.as_ref().map(late);
        let baseline = Baseline::new(rows, &seen, &events, truth, limits);
        Self { drive, part, gyro_bias: board.gyro_bias(), known, baseline, states }
    }

    /// Returns the number of rows.
    #[must_use]
    pub fn rows(&self) -> usize {
        self.drive.readings.len()
    }

    /// Runs a span with faults; it must begin at a stored state.
    pub fn run(&self, span: Span, faults: &[Fault], networks: &mut impl Networks) -> Outcome {
        let mut networks = Remembering { networks, known: &self.known };
        let (mut board, mut receiver) = self.states[span.from / STATE_EVERY].clone();
        let mut readings = self.drive.readings[span.from..span.to].to_vec();
        let mut begin = None;
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
            turn(&mut board, &mut rest, row, last..reading.at, &mut networks, &mut out);
            last = reading.at;
        }
        for fault in faults.iter().filter(|fault| fault.line == Line::Out) {
            began(damage(&mut out, fault));
        }
        let mut seen = Vec::new();
        out.iter().for_each(|message| receiver.receive(message, &mut seen));
        receiver.time(last, &mut seen);
        let at = |row: usize| readings.get(row - span.from).map_or(last, |reading| reading.at);
        let over = faults.iter().map(|fault| at(fault.from + fault.rows));
        let end = over.max().unwrap_or(last);
        let begin = begin.unwrap_or(last);
        let times = Times { from: span.from, begin, end, last };
        let mut outcome = self.baseline.judge(&seen, times);
        outcome.counted = board.events() != self.baseline.events(span.to - 1);
        outcome
    }
}

/// Runs a whole drive and collects the messages of each row.
fn whole(
    board: &mut Board,
    drive: &Drive,
    messages: &[Message],
    networks: &mut impl Networks,
    mut sent: impl FnMut(&mut Board, &[Message]),
) {
    let mut rest = messages.iter().peekable();
    for (row, reading) in drive.readings.iter().enumerate() {
        let mut out = Vec::new();
        turn(board, &mut rest, row, reading.at - PERIOD_US..reading.at, networks, &mut out);
        sent(board, &out);
    }
}

/// Runs the board for the time of a row.
fn turn<'m>(
    board: &mut Board,
    rest: &mut std::iter::Peekable<impl Iterator<Item = &'m Message>>,
    row: usize,
    time: Range<u64>,
    networks: &mut impl Networks,
    out: &mut Vec<Message>,
) {
    let mut now = time.start;
    while now < time.end {
        now = (now + TURN_US).min(time.end);
        while let Some(message) = rest.next_if(|message| message.at <= now) {
            board.receive(message, Micros(now), networks, out);
        }
        board.poll(Micros(now), row, networks, out);
    }
}

/// Returns all messages of these rows in order of arrival.
fn messages(readings: &[Reading], first_row: usize, part: Part) -> Vec<Message> {
    let mut messages = Vec::new();
    for (row, reading) in (first_row..).zip(readings) {
        if row.is_multiple_of(wheel_frames::FRAME_ROWS) {
            messages.extend(wheel_frame(row, reading));
        }
        encode(part, row, reading, &mut messages);
    }
    messages.sort_by_key(|message| message.at);
    messages
}

/// Returns the vehicle's wheel frame as an SLCAN line; `None` if the drive has no wheels.
fn wheel_frame(row: usize, reading: &Reading) -> Option<Message> {
    let line = slcan::emit(&wheel_frames::frame(reading.wheels)?)?;
    Some(Message { line: Line::Wheels, row, at: reading.at - WHEEL_BEFORE_US, bytes: line.to_vec() })
}
