//! Scenes: undamaged runs of a drive with one part. A damaged run begins at one of the scene's stored states, which
//! saves running the drive up to there, and is compared with the scene.

use super::board::Board;
use super::drive::{Drive, Reading};
use super::encode::encode;
use super::fault::{Fault, Line, Span};
use super::judge::{Baseline, Limits, Outcome, Times};
use super::line::{Began, Damaged, Message};
use super::motion::disturb;
use super::networks::Networks;
use super::receiver::Receiver;
use gyronet::can::slcan;
use gyronet::compensate::CompensateConfig;
use gyronet::sample::{PERIOD_US, RATE_HZ};
use gyronet::units::AngularRate;
use gyronet_tools::drive::wheel_frames;
use gyronet_tools::parts::Part;

/// Runs may begin this many rows apart.
pub const STATE_EVERY: usize = RATE_HZ as usize;
/// A wheel frame arrives this long before the end of its row, microseconds.
const WHEEL_BEFORE_US: u64 = 3_000;

pub struct Scene<'d> {
    pub drive: &'d Drive,
    pub part: Part,
    pub baseline: Baseline,
    gyro_bias: [AngularRate; 3],
    /// The states before every [`STATE_EVERY`]th row.
    states: Vec<(Board, Receiver)>,
}

impl<'d> Scene<'d> {
    /// Runs the drive undamaged.
    pub fn new(drive: &'d Drive, part: Part, networks: &mut Networks) -> Self {
        let rows = drive.readings.len();
        let mut messages = messages(&drive.readings, 0, part).into_iter().peekable();
        let (mut board, mut receiver) = (Board::new(part, part == Part::Dsp1760), Receiver::new(part));
        let (mut states, mut seen) = (Vec::new(), Vec::new());
        for (row, reading) in drive.readings.iter().enumerate() {
            if row % STATE_EVERY == 0 {
                states.push((board.clone(), receiver.clone()));
            }
            let out = board.run(row, (reading.at - PERIOD_US, reading.at), &mut messages, networks);
            out.iter().for_each(|message| receiver.receive(message, &mut seen));
        }
        // A fibre-optic gyro's rate is that of its newest step.
        let (lag, limits) = match part {
            Part::Dsp1760 => (0, Limits::FIBRE_OPTIC),
            _ => (CompensateConfig::DEFAULT.lag.samples(), Limits::INERTIAL),
        };
        let late = |yaw: &Vec<f64>| (0..rows).map(|row| yaw[row.saturating_sub(lag)]).collect();
        let baseline = Baseline::new(rows, &seen, drive.truth.as_ref().map(late), limits);
        let gyro_bias = board.coprocessor.pipeline().gyro_bias().unwrap_or_default();
        Self { drive, part, baseline, gyro_bias, states }
    }

    pub fn rows(&self) -> usize {
        self.drive.readings.len()
    }

    /// Runs a span with faults; it must begin at a stored state.
    pub fn run(&self, span: Span, faults: &[Fault], networks: &mut Networks) -> Outcome {
        let (mut board, mut receiver) = self.states[span.from / STATE_EVERY].clone();
        let mut readings = self.drive.readings[span.from..span.to].to_vec();
        let began = Began::default();
        for fault in faults {
            began.at(disturb(&mut readings, span.from, fault, self.part, self.gyro_bias));
        }
        let messages = messages(&readings, span.from, self.part);
        let (outside, own): (Vec<_>, Vec<_>) = faults.iter().partition(|fault| fault.line != Line::Out);
        let mut messages = damaged(messages, &outside, &began).peekable();
        let mut out = Vec::new();
        let mut last = readings.first().map_or(0, |reading| reading.at - PERIOD_US);
        for (row, reading) in (span.from..).zip(&readings) {
            out.extend(board.run(row, (last, reading.at), &mut messages, networks));
            last = reading.at;
        }
        let mut seen = Vec::new();
        damaged(out, &own, &began).for_each(|message| receiver.receive(&message, &mut seen));
        receiver.time(last, &mut seen);
        let at = |row: usize| readings.get(row - span.from).map_or(last, |reading| reading.at);
        let end = faults.iter().map(|fault| at(fault.from + fault.rows)).max().unwrap_or(last);
        let begin = began.time().unwrap_or(last);
        self.baseline.judge(&seen, Times { from: span.from, begin, end, last })
    }
}

fn damaged<'a>(
    messages: Vec<Message>,
    faults: &[&Fault],
    began: &'a Began,
) -> Box<dyn Iterator<Item = Message> + 'a> {
    let on_a_line = faults.iter().filter(|fault| fault.kind.is_on_a_line());
    on_a_line.fold(Box::new(messages.into_iter()), |input, fault| Box::new(Damaged::new(input, fault, began)))
}

/// All messages of these rows in order of arrival.
pub fn messages(readings: &[Reading], first_row: usize, part: Part) -> Vec<Message> {
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

/// The vehicle's wheel frame as an SLCAN line; `None` if the drive has no wheels.
fn wheel_frame(row: usize, reading: &Reading) -> Option<Message> {
    let line = slcan::emit(&wheel_frames::frame(reading.wheels)?)?;
    Some(Message { line: Line::Wheels, row, at: reading.at - WHEEL_BEFORE_US, bytes: line.to_vec() })
}
