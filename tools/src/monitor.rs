//! What a receiver of our messages sees: rate, yaw, quality, and everything that was lost.
//!
//! [`parse_line`] takes SLCAN lines (with time stamps or without) and `candump -L` logs;
//! [`Monitor`] checks the frames as an ECU would and keeps the accounts. Opening ports and
//! drawing the screen is for whoever calls.

use embedded_can::{ExtendedId, Frame, Id, StandardId};
use gyronet::can::bosch::{self, TX1_ID};
use gyronet::can::config::Config;
use gyronet::can::e2e::{Checker, Fault, Sequence, Verdict};
use gyronet::can::yaw::{AngleMessage, DetailMessage, Faults, Quality, RateMessage, Source};
use gyronet::can::{DataFrame, slcan};
use std::fmt::{self, Write};

/// Loss of up to this many messages in a row is counted message by message.
const MAX_DELTA: u8 = 10;

/// A line that holds no frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("neither an SLCAN line nor a line of a candump log")]
pub struct NoFrame;

/// Reads one line. The time stamp is in seconds: a log's own, or SLCAN's, which wraps every
/// minute.
///
/// # Errors
/// [`NoFrame`], also for answers to commands and empty lines.
pub fn parse_line(line: &str) -> Result<(Option<f64>, DataFrame), NoFrame> {
    let line = line.trim();
    if let Some(rest) = line.strip_prefix('(') {
        return candump(rest).ok_or(NoFrame);
    }
    let line = line.as_bytes();
    if let Ok(frame) = slcan::parse(line) {
        return Ok((None, frame));
    }
    let (frame, ms) = slcan::parse_stamped(line).map_err(|_| NoFrame)?;
    Ok((Some(f64::from(ms) / 1000.0), frame))
}

/// `seconds) interface ID#DATA`; eight digits of identifier are an extended one.
fn candump(rest: &str) -> Option<(Option<f64>, DataFrame)> {
    let (time, rest) = rest.split_once(')')?;
    let (id, digits) = rest.split_whitespace().nth(1)?.split_once('#')?;
    let raw = u32::from_str_radix(id, 16).ok()?;
    let id = match id.len() {
        3 => Id::Standard(StandardId::new(u16::try_from(raw).ok()?)?),
        8 => Id::Extended(ExtendedId::new(raw)?),
        _ => return None,
    };
    if digits.len() % 2 != 0 || !digits.is_ascii() {
        return None;
    }
    let byte = |at: usize| u8::from_str_radix(digits.get(at..at + 2)?, 16).ok();
    let data: Vec<u8> = (0..digits.len()).step_by(2).map(byte).collect::<Option<_>>()?;
    Some((Some(time.parse().ok()?), DataFrame::new(id, &data)?))
}

/// What happened to the messages so far.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Counts {
    /// Frames that are ours.
    pub frames: u64,
    /// Frames of others.
    pub foreign: u64,
    /// Messages that the counters showed to be missing.
    pub lost: u64,
    /// Messages that came twice.
    pub repeated: u64,
    /// Messages out of order, or after a longer loss.
    pub out_of_sequence: u64,
    /// Messages whose checksum did not fit.
    pub damaged: u64,
}

/// The newest values.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct State {
    /// Corrected rate, deg/s, where available.
    pub rate: Option<f64>,
    /// Where it comes from, and what it is worth.
    pub judgement: Option<(Source, Quality)>,
    /// Yaw turned since the first angle message, deg, not wrapped.
    pub yaw: f64,
    /// What is wrong at present.
    pub faults: Faults,
    /// What was taken off, deg/s.
    pub correction: f64,
    /// Code of the expected error.
    pub sigma: Option<f64>,
    /// Yaw rate of the drop-in message, deg/s, where its status is good.
    pub drop_in: Option<f64>,
}

/// Checks and reads our messages.
#[derive(Debug, Clone)]
pub struct Monitor {
    /// Identifiers of rate, angle, detail, and their checks.
    yaw: Vec<(Id, Checker)>,
    tx1: Sequence,
    last_yaw: Option<i32>,
    turned: i64,
    /// Accounts.
    pub counts: Counts,
    /// Newest values.
    pub state: State,
}

impl Monitor {
    /// For messages sent with a configuration.
    #[must_use]
    pub fn new(config: &Config) -> Self {
        let yaw = config.settings().yaw.into_iter().flat_map(|yaw| {
            let ids = yaw.ids.map(|id| StandardId::new(id).map(Id::Standard));
            let checkers = yaw.e2e.profiles().map(|profile| Checker::new(profile, MAX_DELTA));
            ids.into_iter().flatten().zip(checkers)
        });
        Self {
            yaw: yaw.collect(),
            tx1: Sequence::new(16, MAX_DELTA),
            last_yaw: None,
            turned: 0,
            counts: Counts::default(),
            state: State::default(),
        }
    }

    /// Takes a frame.
    pub fn take(&mut self, frame: &impl Frame) {
        let data = frame.data();
        if frame.id() == Id::Standard(TX1_ID) {
            return self.take_tx1(data);
        }
        let Some(index) = self.yaw.iter().position(|(id, _)| *id == frame.id()) else {
            self.counts.foreign += 1;
            return;
        };
        let verdict = self.yaw[index].1.check(data);
        if self.account(verdict) {
            match index {
                0 => self.take_rate(data),
                1 => self.take_angle(data),
                _ => self.take_detail(data),
            }
        }
    }

    /// Counts a verdict; whether the message may be used.
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

    fn take_tx1(&mut self, data: &[u8]) {
        let Ok(message) = bosch::Message::parse(data) else {
            self.counts.frames += 1;
            self.counts.damaged += 1;
            return;
        };
        let verdict = self.tx1.process(message.counter);
        if self.account(Ok(verdict)) {
            let good = message.rate_status == bosch::SignalStatus::OK;
            self.state.drop_in = good.then(|| f64::from(message.rate) * 0.005 - 163.84);
        }
    }

    fn take_rate(&mut self, data: &[u8]) {
        if let Ok(message) = RateMessage::parse(data) {
            self.state.rate = message.deg_per_sec();
            self.state.judgement = Some((message.source, message.quality));
        }
    }

    fn take_angle(&mut self, data: &[u8]) {
        if let Ok(message) = AngleMessage::parse(data) {
            // The difference in 32 bits is the angle turned, lost messages included.
            if let Some(last) = self.last_yaw.replace(message.yaw) {
                self.turned += i64::from(message.yaw.wrapping_sub(last));
            }
            self.state.yaw = self.turned as f64 * (360.0 / 4_294_967_296.0);
            self.state.faults = message.faults;
        }
    }

    fn take_detail(&mut self, data: &[u8]) {
        if let Ok(message) = DetailMessage::parse(data) {
            self.state.correction = f64::from(message.correction) * 2e-4;
            self.state.sigma = (message.sigma != u16::MAX).then(|| f64::from(message.sigma) * 1e-5);
        }
    }

    /// Heading of the table that [`Monitor::row`] gives a line of.
    pub const HEADING: &str =
        "time,rate,yaw,source,quality,faults,correction,sigma,drop_in,lost,repeated,out_of_sequence,damaged";

    /// The newest values as one line of a CSV file; empty where not known.
    #[must_use]
    pub fn row(&self, time: f64) -> String {
        let known = |value: Option<f64>| value.map(|value| value.to_string()).unwrap_or_default();
        let (source, quality) = self.judgement();
        let State { rate, yaw, faults: Faults(faults), correction, sigma, drop_in, .. } = self.state;
        let Counts { lost, repeated, out_of_sequence, damaged, .. } = self.counts;
        let (rate, sigma, drop_in) = (known(rate), known(sigma), known(drop_in));
        format!(
            "{time},{rate},{yaw},{source},{quality},{faults},{correction},{sigma},{drop_in},\
             {lost},{repeated},{out_of_sequence},{damaged}"
        )
    }

    fn judgement(&self) -> (String, String) {
        let text = |(source, quality)| (format!("{source:?}"), format!("{quality:?}"));
        self.state.judgement.map(text).unwrap_or_default()
    }
}

/// A few lines for a terminal.
impl fmt::Display for Monitor {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut known = |name: &str, value: Option<f64>| match value {
            Some(value) => writeln!(f, "{name:<15}{value:>14.6} deg/s"),
            None => writeln!(f, "{name:<15}{:>14}", "-"),
        };
        known("rate", self.state.rate)?;
        known("expected error", self.state.sigma)?;
        known("correction", Some(self.state.correction))?;
        known("drop-in rate", self.state.drop_in)?;
        writeln!(f, "{:<15}{:>14.6} deg", "yaw", self.state.yaw)?;
        let (source, quality) = self.judgement();
        writeln!(f, "{:<15}{source:>14} {}", "source", quality.to_lowercase())?;
        let Counts { frames, foreign, lost, repeated, out_of_sequence, damaged } = self.counts;
        writeln!(f, "{:<15}{frames:>14} and {foreign} of others", "messages")?;
        write!(f, "{:<15}{lost:>14}, repeated {repeated}, ", "lost")?;
        writeln!(f, "out of sequence {out_of_sequence}, damaged {damaged}")?;
        f.write_char('\n')
    }
}
