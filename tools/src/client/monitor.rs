//! Monitors the CAN messages as a receiver sees them: rate, yaw, quality, and every lost message.
//!
//! [`source`] opens a port, socket or log, [`mod@line`] parses its lines, and [`Monitor`] checks the frames as an ECU
//! would and counts them.

pub mod line;
pub mod source;
mod view;
mod yaw_set;

pub use yaw_set::State;

use embedded_can::{Frame, Id};
use gyronet::can::bosch::{self, LAYOUTS};
use gyronet::can::config::Config;
use gyronet::can::e2e::{Fault, Sequence, Verdict};
use gyronet::can::fog_encoder::FogEncoder;
use gyronet::can::yaw::FOG_IDS;
use yaw_set::{Part, YawSet};

/// Up to this many consecutive missing messages count as lost; more count as out of sequence.
const MAX_DELTA: u8 = 10;
/// Frames are counted over this time to compute their rate, s.
const PACE_SECONDS: f64 = 1.0;

/// Counts of messages by the result of their check.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize)]
pub struct Counts {
    /// Frames of the board, those of a fibre-optic gyro included.
    pub frames: u64,
    /// Frames of other senders.
    pub foreign: u64,
    /// Messages that are missing according to the counters.
    pub lost: u64,
    /// Messages with the same counter as the one before.
    pub repeated: u64,
    /// Messages out of order, or after a longer loss.
    pub out_of_sequence: u64,
    /// Messages with a wrong checksum, or that cannot be parsed.
    pub damaged: u64,
    /// Lines that begin like a frame and cannot be parsed.
    pub unreadable: u64,
}

/// Checks and decodes the board's messages.
#[derive(Debug, Clone)]
pub struct Monitor {
    own_set: Option<YawSet>,
    fog_set: YawSet,
    bosch: [Sequence; LAYOUTS.len()],
    /// Start of the second that is being counted, and frames in it.
    pace: Option<(f64, u32)>,
    frames_per_second: Option<f64>,
    stamp: Option<f64>,
    pub counts: Counts,
    /// Newest values of the inertial sensor's set of messages.
    pub state: State,
    /// Newest values of a fibre-optic gyro's set, once it was received.
    pub fog: Option<State>,
    /// Yaw rate of the drop-in message, deg/s; `None` unless its status is good.
    pub drop_in: Option<f64>,
}

impl Monitor {
    /// Creates a monitor for the messages of a configuration; those of a fibre-optic gyro have the identifiers of
    /// [`FOG_IDS`].
    pub fn new(config: &Config) -> Self {
        Self {
            own_set: config.settings().yaw.map(|yaw| YawSet::new(yaw.ids, yaw.e2e.profiles())),
            fog_set: YawSet::new(FOG_IDS, FogEncoder::profiles(FOG_IDS)),
            bosch: [Sequence::new(16, MAX_DELTA); LAYOUTS.len()],
            pace: None,
            frames_per_second: None,
            stamp: None,
            counts: Counts::default(),
            state: State::default(),
            fog: None,
            drop_in: None,
        }
    }

    /// Reads a line. If it completes a set of the inertial sensor's messages, returns its time in seconds: the line's
    /// own time stamp if it has one, otherwise `time`.
    ///
    /// Answers to commands are skipped; a line that begins like a frame and is none is counted as unreadable.
    pub fn take_line(&mut self, line: &str, time: f64) -> Option<f64> {
        match line::parse_line(line) {
            Ok((stamp, frame)) => {
                self.stamp = stamp.or(self.stamp);
                let time = stamp.unwrap_or(time);
                self.take(&frame, time).then_some(time)
            }
            Err(line::NoFrame) => {
                self.counts.unreadable += u64::from(line.starts_with(['t', 'T', '(']));
                None
            }
        }
    }

    /// Checks a frame received at `time`, in seconds; returns whether it completed a set of the inertial sensor's
    /// messages.
    pub fn take(&mut self, frame: &impl Frame, time: f64) -> bool {
        self.keep_pace(time);
        let (id, data) = (frame.id(), frame.data());
        if let Some(index) = LAYOUTS.iter().position(|layout| Id::Standard(layout.id) == id) {
            self.take_bosch(index, data);
        } else if let Some(set) = self.own_set.as_mut()
            && let Some((part, verdict)) = set.take(id, data)
        {
            self.state = set.state();
            return self.account(verdict) && part == Part::Detail;
        } else if let Some((_, verdict)) = self.fog_set.take(id, data) {
            self.fog = Some(self.fog_set.state());
            self.account(verdict);
        } else {
            self.counts.foreign += 1;
        }
        false
    }

    /// Returns the newest time stamp of a line, in seconds, if lines have one.
    pub fn stamp(&self) -> Option<f64> {
        self.stamp
    }

    /// Returns the rate of all frames, 1/s, once a second has passed.
    pub fn frames_per_second(&self) -> Option<f64> {
        self.frames_per_second
    }

    fn keep_pace(&mut self, time: f64) {
        let (start, frames) = self.pace.get_or_insert((time, 0));
        let elapsed = time - *start;
        if (0.0..PACE_SECONDS).contains(&elapsed) {
            *frames += 1;
            return;
        }
        // SLCAN's stamps restart every minute.
        if elapsed >= PACE_SECONDS {
            self.frames_per_second = Some(f64::from(*frames) / elapsed);
        }
        self.pace = Some((time, 1));
    }

    /// Counts a verdict and returns whether the message may be used.
    fn account(&mut self, verdict: Result<Verdict, Fault>) -> bool {
        self.counts.frames += 1;
        match verdict {
            Err(_) => self.counts.damaged += 1,
            Ok(Verdict::First | Verdict::Ok) => {}
            Ok(Verdict::Lost(count)) => self.counts.lost += u64::from(count),
            Ok(Verdict::Repeated) => self.counts.repeated += 1,
            Ok(Verdict::WrongSequence { .. }) => self.counts.out_of_sequence += 1,
        }
        verdict.is_ok_and(Verdict::usable)
    }

    fn take_bosch(&mut self, index: usize, data: &[u8]) {
        let Ok(message) = bosch::Message::parse(data) else {
            self.counts.frames += 1;
            self.counts.damaged += 1;
            return;
        };
        let verdict = self.bosch[index].check(message.counter);
        if self.account(Ok(verdict)) && index == 0 {
            let good = message.rate_status == bosch::SignalStatus::OK;
            self.drop_in = good.then(|| message.rate_deg_per_sec());
        }
    }
}
