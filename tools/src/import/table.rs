//! Reads text tables: a CSV with any column names, by a column map, and exports of Xsens MT Manager.
//!
//! Each column of numbers becomes a channel. Three gyro columns and three accelerometer columns become an IMU;
//! latitude and longitude become a position.

use super::input::{Input, read_line};
use super::log::Log;
use super::select::{REFERENCE, WHEELS};
use super::value::{Fix, Value};
use crate::drive::vehicle::{Column, Columns};

/// Longest line, bytes.
const MAX_LINE: u64 = 1 << 16;
/// Most comment lines before the header.
const MAX_REMARKS: usize = 1_000;

/// Our column names, and the names that common exports use for the same column in the same unit.
const KNOWN: [(&str, &[&str]); 13] = [
    ("t_s", &["time_s", "timestamp_s", "timestamps"]),
    ("acc_x", &["Acc_X"]),
    ("acc_y", &["Acc_Y"]),
    ("acc_z", &["Acc_Z"]),
    ("gyr_x", &["Gyr_X"]),
    ("gyr_y", &["Gyr_Y"]),
    ("gyr_z", &["Gyr_Z"]),
    ("latitude", &["Latitude", "gnss_lat"]),
    ("longitude", &["Longitude", "gnss_lon"]),
    ("position_sigma", &[]),
    ("course", &[]),
    ("ground_speed", &[]),
    ("course_sigma", &[]),
];
/// Units and their values in SI.
const UNITS: [(&str, f64); 15] = [
    ("s", 1.0),
    ("ms", 1e-3),
    ("us", 1e-6),
    ("ns", 1e-9),
    ("m/s^2", 1.0),
    ("g", 9.806_65),
    ("rad/s", 1.0),
    ("deg/s", std::f64::consts::PI / 180.0),
    ("rad", 1.0),
    ("deg", std::f64::consts::PI / 180.0),
    ("m", 1.0),
    ("m/s", 1.0),
    ("km/h", 1.0 / 3.6),
    ("mph", 0.447_04),
    ("rpm", std::f64::consts::TAU / 60.0),
];
/// Units of angular rates, which are converted to rad/s.
const RATES: [&str; 3] = ["rad/s", "deg/s", "rpm"];

/// The reason why a table cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum TableError {
    #[error(transparent)]
    Io(#[from] std::io::Error),
    #[error("unknown format: neither a bag, MCAP, ULog or CAN log, nor a table with a header")]
    Unknown,
    #[error("no column {0}; the columns are {1}")]
    Column(String, String),
    #[error("unknown unit {0:?}; known units are {units}", units = UNITS.map(|(unit, _)| unit).join(", "))]
    Unit(String),
    #[error(
        "no time column; name it in the vehicle file: [columns] t_s = {{ name = \"...\", unit = \"ms\" }}; the columns are {0}"
    )]
    Time(String),
    #[error("an Xsens DOT export, whose units differ by version; name its columns in the vehicle file")]
    Dot,
}

/// A column that gives the time.
#[derive(Clone, Copy)]
enum Time {
    Column(usize, f64),
    /// A counter of 32 bits, in units of 0.1 ms.
    Fine(usize),
    /// A counter of 16 bits, and the counts per second.
    Packets(usize, f64),
}

impl Time {
    fn column(self) -> usize {
        let (Self::Column(at, _) | Self::Fine(at) | Self::Packets(at, _)) = self;
        at
    }
}

pub fn read(input: &mut Input<'_>, columns: &Columns, log: &mut Log) -> Result<(), TableError> {
    let (header, rate) = header(input)?;
    let (header, separator) = header;
    let names: Vec<String> = split(&header, separator).into_iter().map(str::to_owned).collect();
    let find = |ours: &str| find(&names, columns, ours);
    let at = |name: &str| names.iter().position(|column| column == name);
    let times = match find("t_s")? {
        Some((at, unit)) => vec![Time::Column(at, unit)],
        None => {
            let fine = at("SampleTimeFine").map(Time::Fine);
            let packets = at("PacketCounter").zip(rate).map(|(at, rate)| Time::Packets(at, rate));
            fine.into_iter().chain(packets).collect()
        }
    };
    if times.is_empty() {
        return Err(TableError::Time(names.join(", ")));
    }
    let mut places = Vec::new();
    for (ours, _) in &KNOWN[1..] {
        places.push(find(ours)?);
    }
    let [ax, ay, az, gx, gy, gz, lat, lon, sigma, course, speed, course_sigma] = places[..] else {
        return Err(TableError::Unknown);
    };
    let others = named_others(&names, columns, &places)?;
    for (at, ..) in &others {
        log.units.insert(names[*at].clone(), unit_of(&names[*at], columns).to_owned());
    }
    let mut clock = Clock { times, last: None, turns: 0.0 };
    while let Some(line) = read_line(input, MAX_LINE)? {
        if line.trim().is_empty() {
            continue;
        }
        let mut row = split(&line, separator);
        // Some exports end each row, but not the header, with a separator.
        if row.len() == names.len() + 1 {
            row.pop_if(|last| last.is_empty());
        }
        let number = |place: Option<(usize, f64)>| {
            let (at, unit) = place?;
            Some(unit * row.get(at)?.parse::<f64>().ok()?)
        };
        if row.len() != names.len() {
            log.drop("rows whose length differs from the header".to_owned());
            continue;
        }
        let Some(seconds) = clock.seconds(number) else {
            log.drop("rows without a time".to_owned());
            continue;
        };
        let vector = |places: [Option<(usize, f64)>; 3]| {
            let [x, y, z] = places.map(number);
            Some([x?, y?, z?])
        };
        if let (Some(_), Some(_)) = (gx, ax) {
            match (vector([ax, ay, az]), vector([gx, gy, gz])) {
                (Some(force), Some(rate)) => log.add("imu", seconds, Value::Imu(force, rate)),
                _ => log.drop("rows without six numbers for the IMU".to_owned()),
            }
        }
        if let (Some(latitude), Some(longitude)) = (number(lat), number(lon)) {
            let velocity = || Some([number(speed)?, number(course)?, number(course_sigma)?]);
            let fix = Fix { degrees: [latitude, longitude], sigma_m: number(sigma), velocity: velocity() };
            log.add("position", seconds, Value::Position(fix));
        }
        for (at, unit) in &others {
            if let Some(value) = number(Some((*at, *unit))) {
                log.add(&names[*at], seconds, Value::Number(value));
            }
        }
    }
    Ok(())
}

/// The header line, its separator, and the sample rate that a comment before it gives, Hz.
type Header = ((String, Option<char>), Option<f64>);

fn header(input: &mut Input<'_>) -> Result<Header, TableError> {
    let mut rate = None;
    for _ in 0..MAX_REMARKS {
        let Some(line) = read_line(input, MAX_LINE)? else { return Err(TableError::Unknown) };
        let line = line.trim_start_matches('\u{feff}');
        if line.contains("DeviceTag") {
            return Err(TableError::Dot);
        }
        if line.starts_with("//") || line.starts_with('#') || line.trim().is_empty() {
            if let Some((_, text)) = line.split_once("Update Rate:") {
                rate = text.trim().trim_end_matches("Hz").parse().ok().filter(|rate| *rate > 0.0);
            }
            continue;
        }
        let separator = [',', ';', '\t'].into_iter().find(|separator| line.contains(*separator));
        let text = line.chars().all(|c| !c.is_control() || c == '\t');
        let words = line.split([',', ';', '\t', ' ']).filter(|word| !word.is_empty()).count();
        return if text && words >= 2 {
            Ok(((line.to_owned(), separator), rate))
        } else {
            Err(TableError::Unknown)
        };
    }
    Err(TableError::Unknown)
}

/// Splits a row at the separator, or else at white space.
fn split(line: &str, separator: Option<char>) -> Vec<&str> {
    match separator {
        Some(separator) => line.split(separator).map(|field| field.trim().trim_matches('"')).collect(),
        None => line.split_whitespace().collect(),
    }
}

/// Returns the index of one of our columns, and its unit in SI.
fn find(names: &[String], columns: &Columns, ours: &str) -> Result<Option<(usize, f64)>, TableError> {
    if let Some(Column { name, unit }) = columns.get(ours) {
        let at = names.iter().position(|column| column == name);
        let at = at.ok_or_else(|| TableError::Column(name.clone(), names.join(", ")))?;
        return Ok(Some((at, scale(unit.as_deref(), matches!(ours, "latitude" | "longitude"))?)));
    }
    let others = KNOWN.iter().find(|(name, _)| *name == ours).map_or(&[][..], |(_, others)| others);
    Ok(names.iter().position(|name| name == ours || others.contains(&name.as_str())).map(|at| (at, 1.0)))
}

/// Returns the value of a unit in SI; latitude and longitude stay in degrees.
fn scale(unit: Option<&str>, keeps_degrees: bool) -> Result<f64, TableError> {
    match unit {
        None => Ok(1.0),
        Some("deg") if keeps_degrees => Ok(1.0),
        Some(unit) => UNITS
            .iter()
            .find(|(known, _)| *known == unit)
            .map(|(_, scale)| *scale)
            .ok_or_else(|| TableError::Unit(unit.to_owned())),
    }
}

/// Returns the index and the unit of the other columns, which become signals of the same name.
fn named_others(
    names: &[String],
    columns: &Columns,
    known: &[Option<(usize, f64)>],
) -> Result<Vec<(usize, f64)>, TableError> {
    let mut others = Vec::new();
    for (at, name) in names.iter().enumerate() {
        if known.iter().flatten().all(|(used, _)| *used != at) {
            let unit = columns
                .values()
                .find(|column| column.name == *name)
                .and_then(|column| column.unit.as_deref());
            others.push((at, scale(unit, false)?));
        }
    }
    Ok(others)
}

/// Returns the unit of a column after conversion to SI, as far as it is an angular rate. In our own drives the wheels
/// and the reference are rates.
fn unit_of(name: &str, columns: &Columns) -> &'static str {
    let given = columns.values().find(|column| column.name == name).and_then(|column| column.unit.as_deref());
    match given {
        Some(unit) if RATES.contains(&unit) => "rad/s",
        None if WHEELS.contains(&name) || name == REFERENCE => "rad/s",
        _ => "",
    }
}

/// A clock whose counter wraps.
struct Clock {
    /// The columns that may give the time. The first one with a value is used from then on: exports have columns that
    /// are empty in every row.
    times: Vec<Time>,
    last: Option<f64>,
    turns: f64,
}

impl Clock {
    fn seconds(&mut self, number: impl Fn(Option<(usize, f64)>) -> Option<f64>) -> Option<f64> {
        if self.times.len() > 1 {
            let first = *self.times.iter().find(|time| number(Some((time.column(), 1.0))).is_some())?;
            self.times = vec![first];
        }
        let (at, period, second) = match *self.times.first()? {
            Time::Column(at, unit) => return number(Some((at, unit))),
            Time::Fine(at) => (at, 4_294_967_296.0, 1e4),
            Time::Packets(at, rate) => (at, 65_536.0, rate),
        };
        let count = number(Some((at, 1.0)))?;
        // A wrap steps back by more than half of the counter's range; a smaller step is a jump of the clock.
        if self.last.is_some_and(|last| count < last - 0.5 * period) {
            self.turns += period;
        }
        self.last = Some(count);
        Some((self.turns + count) / second)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table(text: &str, columns: &str) -> Result<Log, TableError> {
        let columns: Columns = toml::from_str(columns).unwrap();
        let mut log = Log::default();
        read(&mut text.as_bytes(), &columns, &mut log)?;
        Ok(log)
    }

    #[test]
    fn a_packet_counter_that_wraps_goes_on() {
        let text = "// Start Time: Unknown\n// Update Rate: 100.0Hz\n// Filter Profile: none\n\
                    PacketCounter\tAcc_X\tAcc_Y\tAcc_Z\tGyr_X\tGyr_Y\tGyr_Z\n\
                    65535\t1\t2\t3\t0.1\t0.2\t0.3\n00000\t1\t2\t3\t0.1\t0.2\t0.3\n";
        let log = table(text, "").unwrap();
        let imu: Vec<_> = log.channels["imu"].iter().collect();
        assert_eq!(imu[1], (655.36, Value::Imu([1.0, 2.0, 3.0], [0.1, 0.2, 0.3])));
        assert!((imu[1].0 - imu[0].0 - 0.01).abs() < 1e-9);
    }

    #[test]
    fn columns_of_an_export_that_are_empty_throughout_do_no_harm() {
        // As MT Manager 4.6 exports an MTw Awinda: only the counter gives the time, and no row has a position.
        let text = "// Update Rate: 40.0Hz\r\nPacketCounter\tSampleTimeFine\tYear\tAcc_X\tAcc_Y\tAcc_Z\tGyr_X\tGyr_Y\tGyr_Z\t\
                    Latitude\tLongitude\r\n03583\t\t\t3.0\t5.2\t-7.7\t0.1\t0.2\t0.3\t\t\r\n\
                    03584\t\t\t3.0\t5.2\t-7.7\t0.1\t0.2\t0.3\t\t\r\n";
        let log = table(text, "").unwrap();
        assert_eq!(log.channels.keys().collect::<Vec<_>>(), ["PacketCounter", "imu"]);
        assert_eq!((log.channels["imu"].len(), log.channels["imu"].first().0), (2, 3_583.0 / 40.0));
        assert!(log.dropped.is_empty(), "{log:?}");
    }

    #[test]
    fn a_column_map_has_names_and_units() {
        let map = "t_s={name='Zeit',unit='ms'}\nacc_x={name='a',unit='g'}\nacc_y={name='b',unit='g'}\n\
                   acc_z={name='c',unit='g'}\ngyr_x={name='d',unit='deg/s'}\ngyr_y={name='e',unit='deg/s'}\n\
                   gyr_z={name='f',unit='deg/s'}\nspeed={name='v',unit='km/h'}";
        let log = table("v;Zeit;a;b;c;d;e;f\n36;1000;0;0;1;0;0;180\n36;x;0;0;1;0;0;180\n1;2\n", map).unwrap();
        let (seconds, Value::Imu(force, rate)) = log.channels["imu"].first() else { panic!() };
        assert_eq!((seconds, force[2]), (1.0, 9.806_65));
        assert!((rate[2] - std::f64::consts::PI).abs() < 1e-12);
        assert_eq!(log.channels["v"].iter().collect::<Vec<_>>(), [(1.0, Value::Number(10.0))]);
        assert_eq!(log.dropped.values().collect::<Vec<_>>(), [&1, &1]);
    }

    #[test]
    fn what_cannot_be_a_table_is_refused_with_the_reason() {
        let message = |text: &str, map: &str| table(text, map).unwrap_err().to_string();
        assert!(message("\u{1}\u{2}\u{3} x", "").starts_with("unknown format"));
        assert!(message("a,b\n1,2\n", "").starts_with("no time column"));
        assert_eq!(message("a,b\n", "t_s={name='c'}"), "no column c; the columns are a, b");
        assert!(
            message("a,b\n", "t_s={name='a',unit='fortnights'}").starts_with("unknown unit \"fortnights\"")
        );
    }
}
