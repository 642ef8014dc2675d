//! The receiver of courses, speeds and latitudes from the frames, or the serial line, that the configuration names.
//!
//! One sender of NMEA 2000 or J1939 is used, and another once that one has been silent for [`SILENT`]: receivers
//! differ in latency. A described course counts when its frame comes, with other values not older than [`FRESH`].

use super::described::HeadingSignal;
use super::latitude::{LatitudeJudge, ReceivedLatitude};
use super::{Fix, GnssSettings, Heading, HeadingError, j1939, nmea2000};
use crate::can::identifier::{self, EXTENDED, packed};
use crate::units::{Duration, Micros};
use embedded_can::{ExtendedId, Frame, Id};

/// Silence of the sender after which another one is used.
const SILENT: Duration = Duration::from_millis(5_000);
/// Age of a described speed or accuracy up to which it belongs to a course.
const FRESH: Duration = Duration::from_millis(1_500);
/// Bits of an identifier that a filter compares: all, and those of a parameter group.
const ALL: u32 = u32::MAX;
const GROUP: u32 = 0x3_FFFF << 8;
/// The two groups of NMEA 2000 differ in the lowest two bits, which this leaves out.
const BOTH: u32 = GROUP & !(3 << 8);
const BAUDS: core::ops::RangeInclusive<u32> = 4_800..=460_800;

/// The source of courses, speeds and latitudes. By default there is none.
#[derive(Debug, Clone, Copy, PartialEq, Default, serde::Serialize, serde::Deserialize)]
pub struct HeadingSettings {
    /// True if course and speed (PGN 129026) and position (129025) of NMEA 2000 are used.
    pub nmea2000: bool,
    /// True if direction and speed (PGN 65256) and position (65267) of SAE J1939 are used.
    pub j1939: bool,
    /// Course, rad clockwise from true north; a negative one is a turn to the left.
    pub course: Option<HeadingSignal>,
    /// Accuracy of the course, 1 sigma, rad.
    pub course_sigma: Option<HeadingSignal>,
    /// Speed over ground, m/s.
    pub speed: Option<HeadingSignal>,
    /// Accuracy of the speed, 1 sigma, m/s.
    pub speed_sigma: Option<HeadingSignal>,
    /// Latitude, degrees, north positive.
    pub latitude: Option<HeadingSignal>,
    /// A receiver on the board's line for one, in place of all frames.
    pub line: Option<GnssSettings>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error, serde::Serialize, serde::Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[allow(missing_docs, reason = "its messages say it")]
pub enum HeadingConfigError {
    #[error("frame {0:x} is one of our own messages, or of diagnosis")]
    Own(u32),
    #[error("frame {0:x}: factor or offset is not plausible")]
    Scale(u32),
    #[error("a course needs a speed")]
    NoSpeed,
    #[error("line: frames of the bus are named, too; a board has one source of courses")]
    TwoSources,
    #[error("line: {0} baud is not within 4800 to 460800")]
    Baud(u32),
}

impl HeadingSettings {
    /// No frames.
    pub const NONE: Self = Self {
        nmea2000: false,
        j1939: false,
        course: None,
        course_sigma: None,
        speed: None,
        speed_sigma: None,
        latitude: None,
        line: None,
    };

    pub(crate) const fn has_course(&self) -> bool {
        self.nmea2000 || self.j1939 || self.course.is_some() || self.line.is_some()
    }

    fn signals(&self) -> [Option<HeadingSignal>; 5] {
        [self.course, self.course_sigma, self.speed, self.speed_sigma, self.latitude]
    }

    /// Returns identifiers of the frames, each with a mask of the bits that frames have in common with it.
    pub fn filters(&self) -> impl Iterator<Item = (Id, u32)> + use<> {
        let described = self.signals().into_iter().flatten().map(|signal| (signal.id, ALL));
        let groups = [
            (self.nmea2000, nmea2000::POSITION, BOTH),
            (self.j1939, j1939::DIRECTION_SPEED, GROUP),
            (self.j1939, j1939::POSITION, GROUP),
        ];
        let groups = groups.into_iter().filter_map(|(is_used, group, mask)| {
            let id = ExtendedId::new(group << 8).filter(|_| is_used)?;
            Some((Id::Extended(id), mask))
        });
        described.chain(groups)
    }

    /// Checks the settings beside the identifiers that are taken already.
    pub fn check(&self, taken: impl Iterator<Item = Id>) -> Result<(), HeadingConfigError> {
        if let Some(signal) = self.signals().iter().flatten().find(|signal| !signal.is_plausible()) {
            return Err(HeadingConfigError::Scale(identifier::raw(signal.id)));
        }
        if self.course.is_some() && self.speed.is_none() {
            return Err(HeadingConfigError::NoSpeed);
        }
        if let Some(GnssSettings { baud, .. }) = self.line {
            if self.filters().next().is_some() {
                return Err(HeadingConfigError::TwoSources);
            }
            if !BAUDS.contains(&baud) {
                return Err(HeadingConfigError::Baud(baud));
            }
        }
        let matches = |id, (own, mask)| (packed(id) ^ packed(own)) & (mask | EXTENDED) == 0;
        let mut taken = taken.filter(|id| self.filters().any(|own| matches(*id, own)));
        taken.next().map_or(Ok(()), |id| Err(HeadingConfigError::Own(identifier::raw(id))))
    }
}

/// The content of a frame or message.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Received {
    /// Course and speed; `None` if the message has neither.
    pub heading: Option<Heading>,
    /// A confirmed latitude, or the reason why it is refused. The course is used in both cases.
    pub latitude: Result<Option<ReceivedLatitude>, HeadingError>,
}

impl Received {
    /// Nothing to use.
    pub const NONE: Self = Self { heading: None, latitude: Ok(None) };
}

/// Reads the frames of [`HeadingSettings`].
#[derive(Debug, Clone, Copy)]
pub struct HeadingReceiver {
    settings: HeadingSettings,
    /// Address of the sender of parameter groups, and the time of its newest frame.
    sender: Option<(u8, Micros)>,
    /// Newest described accuracy of the course, speed and accuracy of the speed.
    kept: [Option<(f32, Micros)>; 3],
    latitude: LatitudeJudge,
}

impl HeadingReceiver {
    /// Creates a receiver of checked settings; `latitude` is one that is known already, degrees.
    pub fn new(settings: HeadingSettings, latitude: Option<f32>) -> Self {
        Self { settings, sender: None, kept: [None; 3], latitude: LatitudeJudge::new(latitude) }
    }

    pub(crate) const fn settings(&self) -> &HeadingSettings {
        &self.settings
    }

    /// Returns whether frames contradict the latitude in use.
    pub fn is_contested(&self) -> bool {
        self.latitude.is_contested()
    }

    /// Processes a frame received at `now`; `None` if the settings do not name it.
    pub fn decode(&mut self, frame: &impl Frame, now: Micros) -> Option<Result<Received, HeadingError>> {
        let HeadingSettings { nmea2000, j1939, .. } = self.settings;
        let mut read = None;
        if nmea2000 {
            read = nmea2000::course_speed(frame)
                .map(of_heading)
                .or_else(|| Some(nmea2000::latitude(frame)?.map(|latitude| (None, latitude))));
        }
        if j1939 && read.is_none() {
            read = j1939::direction_speed(frame)
                .map(of_heading)
                .or_else(|| Some(j1939::latitude(frame)?.map(|latitude| (None, latitude))));
        }
        let read = match read {
            Some(_) if !self.is_sender(frame.id(), now) => return Some(Ok(Received::NONE)),
            Some(read) => read,
            None => self.described(frame, now).transpose()?,
        };
        Some(read.and_then(|(heading, latitude)| self.judge(Fix { heading, latitude: Ok(latitude) }, now)))
    }

    /// Judges what a receiver says at `now`.
    pub fn judge(&mut self, Fix { heading, latitude }: Fix, now: Micros) -> Result<Received, HeadingError> {
        let heading = heading.map(Heading::checked).transpose()?;
        let latitude =
            latitude.and_then(|degrees| degrees.map_or(Ok(None), |degrees| self.latitude.take(degrees, now)));
        Ok(Received { heading, latitude })
    }

    fn is_sender(&mut self, id: Id, now: Micros) -> bool {
        let address = identifier::raw(id) as u8;
        let is_other =
            self.sender.is_some_and(|(known, newest)| known != address && now.since(newest) <= SILENT);
        if !is_other {
            self.sender = Some((address, now));
        }
        !is_other
    }

    fn described(&mut self, frame: &impl Frame, now: Micros) -> Result<Option<Content>, HeadingError> {
        let mut read = [None; 5];
        for (read, signal) in read.iter_mut().zip(self.settings.signals()) {
            *read = signal.and_then(|signal| signal.read(frame)).transpose()?;
        }
        let [course, others @ .., latitude] = read;
        for (kept, other) in self.kept.iter_mut().zip(others) {
            *kept = match other {
                Some(value) => value.map(|value| (value, now)),
                None => kept.filter(|(_, at)| now.since(*at) <= FRESH),
            };
        }
        let [course_sigma, speed, speed_sigma] = self.kept.map(|kept| kept.map(|(value, _)| value));
        let whole = |course: f32| if course < 0.0 { course + core::f32::consts::TAU } else { course };
        let heading =
            course.map(|course| Heading { course: course.map(whole), course_sigma, speed, speed_sigma });
        Ok(read.iter().any(Option::is_some).then_some((heading, latitude.flatten())))
    }
}

/// Course and speed, and a latitude that is not judged yet, degrees.
type Content = (Option<Heading>, Option<f32>);

fn of_heading(read: Result<Heading, HeadingError>) -> Result<Content, HeadingError> {
    read.map(|heading| (Some(heading), None))
}
