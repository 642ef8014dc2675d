//! A heading reference of the vehicle: course and speed over ground with their accuracies, from CAN or a serial line.
//!
//! [`nmea2000`] has the messages of GNSS receivers on boats and machines, [`j1939`] those of trucks; any other frame is
//! read by its description. [`GnssLine`] reads UBX and NMEA 0183. [`HeadingReceiver`] takes what the configuration names,
//! and [`Estimator`] learns.

mod course_config;
mod described;
mod estimator;
mod failing;
pub(crate) mod filter;
mod gain;
mod gnss;
pub mod j1939;
pub mod latitude;
mod nmea;
pub mod nmea2000;
mod receiver;
mod turns;
mod ubx;

pub use course_config::CourseConfig;
pub use described::HeadingSignal;
pub(crate) use estimator::{BRIDGED, gain_knowledge};
pub use estimator::{CourseCounters, CourseState, Estimator, Refusal};
pub use gain::Gain;
pub use gnss::{GnssLine, GnssProtocol, GnssSettings};
pub use receiver::{HeadingConfigError, HeadingReceiver, HeadingSettings, Received};

use embedded_can::{Frame, Id};

/// Course and speed over ground.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Heading {
    /// Direction of motion, rad from true north, clockwise from above, 0 to 2 pi.
    pub course: Option<f32>,
    /// Accuracy of the course, 1 sigma, rad.
    pub course_sigma: Option<f32>,
    /// Speed over ground, m/s.
    pub speed: Option<f32>,
    /// Accuracy of the speed, 1 sigma, m/s.
    pub speed_sigma: Option<f32>,
}

/// What a message of a GNSS receiver says.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Fix {
    /// Course and speed; `None` if the message has neither.
    pub heading: Option<Heading>,
    /// Degrees, north positive. The course is used even if the latitude is an error.
    pub latitude: Result<Option<f32>, HeadingError>,
}

impl Fix {
    /// A message without a fix: the receiver sees too few satellites.
    pub const NONE: Self = Self { heading: Some(Heading::UNKNOWN), latitude: Ok(None) };
}

/// What a message gives; `None` if it is one that is not used.
type Read = Option<Result<Fix, HeadingError>>;

#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[allow(missing_docs, reason = "its messages say it")]
pub enum HeadingError {
    #[error("heading frame of {0} bytes is too short")]
    Short(usize),
    #[error("the course is not from true north: reference {0}")]
    Reference(u8),
    #[error("heading: {what} = {value} is out of range")]
    Range { what: &'static str, value: f32 },
    #[error("latitude jumps from {from} to {to}")]
    Jump { from: f32, to: f32 },
    #[error("the checksum of a GNSS message is wrong")]
    Checksum,
    #[error("a GNSS message of {0} bytes is cut, too long or of another version")]
    Length(usize),
    #[error("a GNSS message: its {0} is not a valid field")]
    Field(&'static str),
    #[error("the GNSS receiver computes its course with sensors of its own")]
    Reckoned,
}

impl Heading {
    /// A message without values.
    pub const UNKNOWN: Self = Self { course: None, course_sigma: None, speed: None, speed_sigma: None };

    /// Checks that each value can be that of a vehicle.
    pub fn checked(self) -> Result<Self, HeadingError> {
        // A code of a full turn is rounded up, and a vehicle is never faster than 150 m/s.
        let limits = [
            ("course", self.course, core::f32::consts::TAU + 1e-3),
            ("course accuracy", self.course_sigma, core::f32::consts::TAU),
            ("speed", self.speed, 150.0),
            ("speed accuracy", self.speed_sigma, 150.0),
        ];
        for (what, value, most) in limits {
            if let Some(value) = value
                && !(0.0..=most).contains(&value)
            {
                return Err(HeadingError::Range { what, value });
            }
        }
        Ok(self)
    }
}

/// Returns the eight bytes of a frame of a parameter group that is sent to all (SAE J1939-21, 5.2.5).
fn group(frame: &impl Frame, group: u32) -> Option<Result<[u8; 8], HeadingError>> {
    let Id::Extended(id) = frame.id() else { return None };
    let found = id.as_raw() >> 8 & 0x3_FFFF;
    let data = frame.data();
    (found == group).then(|| data.try_into().map_err(|_| HeadingError::Short(data.len())))
}

/// Returns a 16-bit number unless it is one of the codes from `from` on, which stand for errors and for no value.
fn word(bytes: [u8; 2], from: u16) -> Option<f32> {
    let code = u16::from_le_bytes(bytes);
    (code < from).then(|| f32::from(code))
}
