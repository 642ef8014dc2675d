//! Chooses the channels of a drive from several files: by type if only one fits, by name if several fit.

use super::error::ImportError;
use super::grid::Stream;
use super::log::Log;
use super::samples::Samples;
use super::value::{Fix, Kind, Sample, Value};
use crate::drive::vehicle::Vehicle;

/// The channel name that leaves a role empty.
const NONE: &str = "none";
/// Columns of the wheels and of the reference yaw rate in our own drives.
pub const WHEELS: [&str; 4] = ["wheel1_rate", "wheel2_rate", "wheel3_rate", "wheel4_rate"];
pub const REFERENCE: &str = "ref_gyr_z";

/// A log file that was read.
#[derive(Debug)]
pub struct File {
    pub path: String,
    pub log: Log,
}

/// A channel that was chosen.
#[derive(Debug, Clone, Copy)]
pub struct Channel<'a> {
    pub file: usize,
    pub name: &'a str,
    pub samples: &'a Samples,
    pub unit: &'a str,
}

/// The channels of a drive.
#[derive(Debug)]
pub struct Selection<'a> {
    pub imu: Channel<'a>,
    pub odometry: Option<Channel<'a>>,
    pub position: Option<Channel<'a>>,
    pub reference_rate: Option<Channel<'a>>,
    /// Front right, rear right, front left, rear left: the order of a drive's columns.
    pub wheels: [Option<Channel<'a>>; 4],
}

/// Returns the names of the plain number channels that [`select`] may choose.
pub fn numbers(vehicle: &Vehicle) -> Vec<String> {
    let wheels = &vehicle.wheels;
    let named = [&wheels.front_right, &wheels.rear_right, &wheels.front_left, &wheels.rear_left];
    let named = named.into_iter().chain([&vehicle.signals.reference_rate]).flatten().cloned();
    named.chain(WHEELS.into_iter().chain([REFERENCE]).map(str::to_owned)).collect()
}

/// Chooses the channels.
pub fn select<'a>(files: &'a [File], vehicle: &'a Vehicle) -> Result<Selection<'a>, ImportError> {
    let signals = &vehicle.signals;
    let imu = by_type(files, Kind::Imu, "imu", signals.imu.as_deref())?;
    let imu = imu.ok_or_else(|| ImportError::Missing { role: "IMU", candidates: listed(files, |_| true) })?;
    let wheels = &vehicle.wheels;
    let names = [&wheels.front_right, &wheels.rear_right, &wheels.front_left, &wheels.rear_left];
    let mut names = names.map(Option::as_deref);
    let has = |name: &str| channels(files).any(|channel| channel.name == name);
    if names == [None; 4] {
        names = WHEELS.map(|name| has(name).then_some(name));
    }
    let [fr, rr, fl, rl] =
        names.map(|name| name.map(|name| by_name(files, "a wheel", name, Some(Kind::Number))).transpose());
    let wheels = [fr?, rr?, fl?, rl?];
    let odometry = match (&signals.odometry, wheels.iter().flatten().next()) {
        // If wheels are found, no odometry is needed.
        (None, Some(_)) => None,
        (name, _) => by_type(files, Kind::Odometry, "odometry", name.as_deref())?,
    };
    Ok(Selection {
        imu,
        odometry,
        position: by_type(files, Kind::Position, "position", signals.position.as_deref())?,
        reference_rate: signals
            .reference_rate
            .as_deref()
            .or(has(REFERENCE).then_some(REFERENCE))
            .map(|name| by_name(files, "the reference rate", name, None))
            .transpose()?,
        wheels,
    })
}

fn by_type<'a>(
    files: &'a [File],
    kind: Kind,
    role: &'static str,
    name: Option<&str>,
) -> Result<Option<Channel<'a>>, ImportError> {
    match name {
        Some(NONE) => return Ok(None),
        Some(name) => return by_name(files, role, name, Some(kind)).map(Some),
        None => {}
    }
    let mut found = channels(files).filter(|channel| channel.kind() == kind);
    let (first, second) = (found.next(), found.next());
    if second.is_some() {
        return Err(ImportError::Ambiguous { role, candidates: listed(files, |other| other == kind) });
    }
    Ok(first)
}

fn by_name<'a>(
    files: &'a [File],
    role: &'static str,
    name: &str,
    kind: Option<Kind>,
) -> Result<Channel<'a>, ImportError> {
    let fits = |other: Kind| kind.is_none_or(|kind| kind == other);
    let named = |channel: &Channel<'_>| {
        let file = std::path::Path::new(&files[channel.file].path).file_name();
        let file = file.and_then(|file| file.to_str()).unwrap_or_default();
        channel.name == name
            || name.strip_prefix(file).and_then(|name| name.strip_prefix(':')) == Some(channel.name)
    };
    let mut found = channels(files).filter(|channel| fits(channel.kind()) && named(channel));
    match (found.next(), found.next()) {
        (Some(channel), None) => Ok(channel),
        (Some(_), Some(_)) => Err(ImportError::Unknown {
            role,
            name: format!("{name} in one file only (several have it; write FILE:{name})"),
            candidates: Vec::new(),
        }),
        _ => Err(ImportError::Unknown { role, name: name.to_owned(), candidates: listed(files, fits) }),
    }
}

fn channels(files: &[File]) -> impl Iterator<Item = Channel<'_>> {
    files.iter().enumerate().flat_map(|(file, File { log, .. })| {
        log.channels.iter().map(move |(name, samples)| Channel {
            file,
            name,
            samples,
            unit: log.units.get(name).map_or("", String::as_str),
        })
    })
}

/// Returns at most twenty channels for a message.
fn listed(files: &[File], fits: impl Fn(Kind) -> bool) -> Vec<String> {
    let catalogue = files.iter().flat_map(|file| file.log.catalogue());
    let fitting = catalogue.filter(|(_, kind, ..)| fits(*kind));
    fitting.map(|(name, kind, _, hz)| format!("{name} ({}, {hz:.1} Hz)", kind.name())).take(20).collect()
}

impl<'a> Channel<'a> {
    fn kind(&self) -> Kind {
        self.samples.kind()
    }

    fn stream<const N: usize>(&self, of: impl Fn(Value) -> Option<[f64; N]> + 'a) -> Stream<'a, N> {
        let pick = move |(seconds, value): Sample| Some((seconds, of(value)?));
        Box::new(self.samples.iter().filter_map(pick))
    }

    /// Returns specific force and angular rate of each sample.
    pub fn imu(&self) -> Stream<'a, 6> {
        self.stream(|value| match value {
            Value::Imu([fx, fy, fz], [wx, wy, wz]) => Some([fx, fy, fz, wx, wy, wz]),
            _ => None,
        })
    }

    /// Returns speed and yaw rate of each sample of an odometry.
    pub fn odometry(&self) -> Stream<'a, 2> {
        self.stream(|value| match value {
            Value::Odometry(speed, rate) => Some([speed, rate]),
            _ => None,
        })
    }

    /// Returns the GNSS fixes with their times.
    pub fn fixes(&self) -> Vec<(f64, Fix)> {
        let fix = |(seconds, value)| match value {
            Value::Position(fix) => Some((seconds, fix)),
            _ => None,
        };
        self.samples.iter().filter_map(fix).collect()
    }

    /// Returns a wheel's speed, m/s, and false, or its rate, rad/s, and true. The unit decides; a channel without a
    /// unit is in m/s.
    pub fn speed(&self) -> (Stream<'a, 1>, bool) {
        let unit = self.unit.trim().to_lowercase();
        let scale = match unit.as_str() {
            "km/h" | "kph" | "kmh" | "km/hr" => 1.0 / 3.6,
            "mph" | "mi/h" => 0.447_04,
            "rpm" | "1/min" => std::f64::consts::TAU / 60.0,
            _ => 1.0,
        };
        // A ROS joint (its name begins with the topic's slash) has no unit and is in rad/s.
        let is_rate = matches!(unit.as_str(), "rad/s" | "rpm" | "1/min")
            || unit.is_empty() && self.name.starts_with('/');
        let speed = move |value| match value {
            Value::Number(number) => Some([scale * number]),
            _ => None,
        };
        (self.stream(speed), is_rate)
    }

    /// Returns the yaw rate of a channel, rad/s to the left.
    pub fn yaw_rate(&self) -> Stream<'a, 1> {
        let unit = self.unit.trim().to_lowercase();
        let degrees = matches!(unit.as_str(), "deg/s" | "°/s" | "degree/s" | "deg/sec" | "grad/s");
        let scale = if degrees { std::f64::consts::PI / 180.0 } else { 1.0 };
        self.stream(move |value| match value {
            Value::Imu(_, [_, _, rate]) | Value::Odometry(_, rate) => Some([rate]),
            Value::Number(rate) => Some([scale * rate]),
            Value::Position(_) => None,
        })
    }
}
