//! An ECU that reads the board's yaw messages, of the inertial sensor or of the fibre-optic gyro, and collects the
//! faults that they report.
//!
//! The ECU checks E2E, accepts a set of rate, angle and detail only if all three carry the same sample counter, and
//! treats silence as a fault.

use super::line::Message;
use embedded_can::{Frame, Id, StandardId};
use gyronet::can::config::Config;
use gyronet::can::e2e::{Checker, Verdict};
use gyronet::can::fog_encoder::FogEncoder;
use gyronet::can::slcan::assembler::LineAssembler;
use gyronet::can::yaw::{AngleMessage, DetailMessage, FOG_IDS, Quality, RateMessage, SIGMA_UNKNOWN};
use gyronet::can::{DataFrame, slcan};
use gyronet_tools::parts::Part;

/// The sender counts as silent after this time without a complete set, microseconds: three and a half periods.
pub const TIMEOUT_US: u64 = 35_000;
/// Up to this many consecutive missing messages count as lost; more count as out of sequence.
const MAX_DELTA: u8 = 10;

/// Reports of a receiver, one bit each; bits 0 to 7 are the fault byte.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Reports(pub u32);

impl Reports {
    pub const NOT_GOOD: Self = Self(1 << 8);
    /// The quality is "not to be used".
    pub const UNUSABLE: Self = Self(1 << 9);
    /// The checksum is wrong, or the bytes are not a frame.
    pub const DAMAGED: Self = Self(1 << 10);
    /// Messages are missing, repeated, or out of order.
    pub const SEQUENCE: Self = Self(1 << 11);
    /// No set arrived for [`TIMEOUT_US`].
    pub const SILENT: Self = Self(1 << 12);

    pub const fn beyond(self, other: Self) -> Self {
        Self(self.0 & !other.0)
    }

    pub const fn is_nothing(self) -> bool {
        self.0 == 0
    }

    fn add(&mut self, other: Self) {
        self.0 |= other.0;
    }
}

/// The values of a complete set of messages.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Set {
    /// Row of the sample with which the set was sent.
    pub row: usize,
    /// Accumulated yaw, 360 deg / 2^32.
    pub yaw: i32,
    /// Expected error over a second, rad; `None` where not known.
    pub sigma: Option<f64>,
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Seen {
    /// Microseconds of the board's clock.
    pub at: u64,
    pub reports: Reports,
    /// The set that the observed message completed, if any.
    pub set: Option<Set>,
}

#[derive(Debug, Clone)]
pub struct Receiver {
    messages: Vec<(Id, Checker)>,
    assembler: LineAssembler,
    rate: Option<(u8, RateMessage)>,
    angle: Option<(u8, AngleMessage)>,
    last: Option<u64>,
}

impl Receiver {
    /// A receiver of the messages that the board sends for this part.
    pub fn new(part: Part) -> Self {
        let own = || Config::DEFAULT.settings().yaw.map(|yaw| (yaw.ids, yaw.e2e.profiles()));
        let fog = || Some((FOG_IDS, FogEncoder::profiles(FOG_IDS)));
        let messages = if part == Part::Dsp1760 { fog() } else { own() };
        let checked = messages.into_iter().flat_map(|(ids, profiles)| {
            let ids = ids.map(|id| StandardId::new(id).map(Id::Standard));
            ids.into_iter().flatten().zip(profiles.map(|profile| Checker::new(profile, MAX_DELTA)))
        });
        let messages = checked.collect();
        Self { messages, assembler: LineAssembler::new(), rate: None, angle: None, last: None }
    }

    /// Reads bytes from the board's CAN line and appends the observations.
    pub fn receive(&mut self, message: &Message, seen: &mut Vec<Seen>) {
        self.time(message.at, seen);
        for byte in &message.bytes {
            let Some(line) = self.assembler.receive(*byte) else { continue };
            // The board answers each wheel frame with a line that is not a frame. If a damaged frame looks like an
            // answer, its counter shows the loss.
            let line = line.map(|line| line.strip_prefix(b"\x07").unwrap_or(line));
            let frame = match line {
                Ok([b't' | b'T', ..]) => line.ok().and_then(|line| slcan::parse::<DataFrame>(line).ok()),
                Ok(_) => continue,
                Err(_) => None,
            };
            match frame {
                Some(frame) => seen.extend(self.frame(&frame, message)),
                None => seen.push(Seen { at: message.at, reports: Reports::DAMAGED, set: None }),
            }
        }
    }

    /// Advances the time, and reports a silent board.
    pub fn time(&mut self, now: u64, seen: &mut Vec<Seen>) {
        if let Some(last) = self.last
            && now > last + TIMEOUT_US
        {
            seen.push(Seen { at: last + TIMEOUT_US, reports: Reports::SILENT, set: None });
            self.last = Some(now);
        }
    }

    fn frame(&mut self, frame: &DataFrame, message: &Message) -> Option<Seen> {
        let (id, data) = (frame.id(), frame.data());
        let index = self.messages.iter().position(|(own, _)| *own == id)?;
        let mut seen = Seen { at: message.at, reports: Reports::default(), set: None };
        match self.messages[index].1.check(data) {
            Err(_) => seen.reports.add(Reports::DAMAGED),
            Ok(Verdict::First | Verdict::Ok) => {}
            Ok(Verdict::Lost(_) | Verdict::Repeated | Verdict::WrongSequence { .. }) => {
                seen.reports.add(Reports::SEQUENCE);
            }
        }
        if !seen.reports.is_nothing() {
            return Some(seen);
        }
        let counter = data[2];
        match index {
            0 => self.rate = RateMessage::parse(data).ok().map(|rate| (counter, rate)),
            1 => self.angle = AngleMessage::parse(data).ok().map(|angle| (counter, angle)),
            _ => return self.set(counter, data, message.row, seen),
        }
        None
    }

    fn set(&mut self, counter: u8, data: &[u8], row: usize, mut seen: Seen) -> Option<Seen> {
        let detail = DetailMessage::parse(data).ok()?;
        let ((rate_counter, rate), (angle_counter, angle)) = (self.rate.take()?, self.angle.take()?);
        if [rate_counter, angle_counter] != [counter; 2] {
            return None;
        }
        self.last = Some(seen.at);
        seen.reports.add(Reports(angle.faults.0.into()));
        if rate.quality != Quality::Good {
            seen.reports.add(Reports::NOT_GOOD);
        }
        if rate.quality == Quality::Unusable {
            seen.reports.add(Reports::UNUSABLE);
        }
        // 1e-5 deg/s over a second.
        let sigma = (detail.sigma != SIGMA_UNKNOWN).then(|| (f64::from(detail.sigma) * 1e-5).to_radians());
        seen.set = Some(Set { row, yaw: angle.yaw, sigma });
        Some(seen)
    }
}
