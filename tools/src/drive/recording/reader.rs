//! The rows of a recording, one at a time.

use super::position::Track;
use super::{Row, WHEELS};
use crate::drive::error::{DataError, DataFault, ValueError};
use crate::drive::vehicle::Vehicle;
use csv::StringRecord;
use gyronet::mounting::Rotation;
use gyronet::sample::{ImuSample, Validity};
use gyronet::units::{AngularRate, CentiCelsius, Micros, RangeError, SpecificForce};
use std::str::FromStr;

const TIME: &str = "t_s";
const FORCE: [&str; 3] = ["acc_x", "acc_y", "acc_z"];
const RATE: [&str; 3] = ["gyr_x", "gyr_y", "gyr_z"];
const REFERENCE: &str = "ref_gyr_z";
const COURSE: &str = "ref_yaw";
const SPEED: &str = "gnss_speed";
const DIRECTION: [&str; 2] = ["course", "course_sigma"];
const POSITION: [&str; 2] = ["gnss_lat", "gnss_lon"];
const TEMPERATURE: &str = "temp_c";
const WHEEL: [&str; WHEELS] = ["wheel1_rate", "wheel2_rate", "wheel3_rate", "wheel4_rate"];

/// Rate of the sensor's time counter, Hz.
const TICKS_PER_SECOND: f64 = 1e4;
const MICROS_PER_TICK: u64 = 100;

/// Bytes that are read from a file at once.
const BUFFER: usize = 1 << 16;

type Column = (&'static str, usize);

#[derive(Debug, Clone, Copy)]
struct Columns {
    time: Column,
    force: [Column; 3],
    rate: [Column; 3],
    reference: Option<Column>,
    course: Option<Column>,
    temperature: Option<Column>,
    wheels: [Option<Column>; WHEELS],
    speed: Option<Column>,
    direction: [Option<Column>; 2],
    position: [Option<Column>; 2],
}

impl Columns {
    fn find(path: &str, header: &StringRecord) -> Result<Self, DataError> {
        let optional = |name: &'static str| {
            // Spreadsheet programs write a byte order mark at the start of a file.
            let at = header.iter().position(|field| field.trim_start_matches('\u{feff}') == name)?;
            Some((name, at))
        };
        let needed =
            |column| optional(column).ok_or_else(|| DataError::of(path, DataFault::MissingColumn(column)));
        let three = |names: [&'static str; 3]| {
            let [x, y, z] = names.map(needed);
            Ok([x?, y?, z?])
        };
        Ok(Self {
            time: needed(TIME)?,
            force: three(FORCE)?,
            rate: three(RATE)?,
            reference: optional(REFERENCE),
            course: optional(COURSE),
            temperature: optional(TEMPERATURE),
            wheels: WHEEL.map(optional),
            speed: optional(SPEED),
            direction: DIRECTION.map(optional),
            position: POSITION.map(optional),
        })
    }
}

/// An iterator over the rows of a recording. It checks each row, and that time increases; [`super::Survey`] checks
/// the drive as a whole.
pub struct Reader<R> {
    path: String,
    columns: Columns,
    csv: csv::Reader<R>,
    record: StringRecord,
    fields: usize,
    last: Option<Micros>,
    rotation: Option<Rotation>,
    track: Track,
}

impl<R: std::io::Read> Reader<R> {
    pub fn new(path: &str, input: R) -> Result<Self, DataError> {
        let mut csv =
            csv::ReaderBuilder::new().trim(csv::Trim::Headers).buffer_capacity(BUFFER).from_reader(input);
        let header = csv.headers().map_err(|error| csv_error(path, error))?;
        if header.is_empty() {
            return Err(DataError::of(path, DataFault::Empty));
        }
        let columns = Columns::find(path, header)?;
        let fields = header.len();
        Ok(Self {
            path: path.to_owned(),
            columns,
            csv,
            record: StringRecord::new(),
            fields,
            last: None,
            rotation: None,
            track: Track::new(columns.direction[0].is_some()),
        })
    }

    /// Rotates the rows into the vehicle's axes.
    pub fn mounted(self, vehicle: &Vehicle) -> Self {
        Self { rotation: vehicle.mounting.rotation(), ..self }
    }

    fn row(&mut self) -> Result<Row, DataError> {
        let line = self.record.position().map_or(0, csv::Position::line);
        let Columns { time, force, rate, reference, course, temperature, wheels, speed, direction, position } =
            self.columns;
        let fields = Fields { path: &self.path, line, record: &self.record };
        let time = fields.time(time)?;
        if let Some(last) = self.last
            && time <= last
        {
            let [last_s, at_s] = [last, time].map(|time| time.0 as f64 * 1e-6);
            return Err(DataError::at(&self.path, line, DataFault::Time { last_s, at_s }));
        }
        let force = force
            .map(|column| fields.quantity(column, ValueError::Force, SpecificForce::from_metre_per_sec2));
        let rate =
            rate.map(|column| fields.quantity(column, ValueError::Rate, AngularRate::from_rad_per_sec));
        let ([fx, fy, fz], [wx, wy, wz]) = (force, rate);
        let optional = |column: Option<Column>| column.map_or(Ok(None), |column| fields.optional(column));
        let [w1, w2, w3, w4] = wheels.map(optional);
        let sample = ImuSample {
            time,
            specific_force: [fx?, fy?, fz?],
            angular_rate: [wx?, wy?, wz?],
            temperature: temperature.map_or(Ok(None), |column| fields.temperature(column))?,
            validity: Validity::Good,
        };
        let sample = self.rotation.map_or(sample, |rotation| rotation.sample(&sample));
        let (reference, course, speed) = (optional(reference)?, optional(course)?, optional(speed)?);
        let wheels = [w1?, w2?, w3?, w4?];
        let ([direction, sigma], [latitude, longitude]) = (direction.map(optional), position.map(optional));
        let (latitude, longitude) = (latitude?, longitude?);
        let heading = self.track.heading(time, [direction?, sigma?, speed, latitude, longitude]);
        self.last = Some(time);
        let place = latitude.zip(longitude).map(|(latitude, longitude)| [latitude, longitude]);
        Ok(Row { line, sample, reference, course, wheels, speed, heading, place })
    }
}

impl<R: std::io::Read> Iterator for Reader<R> {
    type Item = Result<Row, DataError>;

    fn next(&mut self) -> Option<Self::Item> {
        Some(match self.csv.read_record(&mut self.record) {
            Ok(true) => self.row(),
            Ok(false) => return None,
            Err(error) => Err(match *error.kind() {
                csv::ErrorKind::UnequalLengths { ref pos, len, .. } => {
                    let line = pos.as_ref().map_or(0, csv::Position::line);
                    let (found, expected) = (len as usize, self.fields);
                    DataError::at(&self.path, line, DataFault::Fields { found, expected })
                }
                _ => csv_error(&self.path, error),
            }),
        })
    }
}

struct Fields<'a> {
    path: &'a str,
    line: u64,
    record: &'a StringRecord,
}

impl Fields<'_> {
    fn error(&self, column: Column, error: ValueError) -> DataError {
        DataError::value(self.path, self.line, column.0, self.text(column), error)
    }

    fn text(&self, (_, at): Column) -> &str {
        self.record.get(at).unwrap_or_default().trim()
    }

    /// Returns the number, which may still be NaN or infinite; `None` for an empty field.
    fn number<T: FromStr>(&self, column: Column) -> Result<Option<T>, DataError> {
        match self.text(column) {
            "" => Ok(None),
            text => text.parse().map(Some).map_err(|_| self.error(column, ValueError::NotANumber)),
        }
    }

    fn optional(&self, column: Column) -> Result<Option<f64>, DataError> {
        match self.number::<f64>(column)? {
            Some(value) if !value.is_finite() => Err(self.error(column, ValueError::NotFinite)),
            value => Ok(value),
        }
    }

    fn temperature(&self, column: Column) -> Result<Option<CentiCelsius>, DataError> {
        let Some(celsius) = self.optional(column)? else { return Ok(None) };
        if celsius.abs() > 300.0 {
            return Err(self.error(column, ValueError::OutOfRange));
        }
        Ok(Some(CentiCelsius((100.0 * celsius).round() as i16)))
    }

    fn quantity<T>(
        &self,
        column: Column,
        outside: ValueError,
        code: impl Fn(f32) -> Result<T, RangeError>,
    ) -> Result<T, DataError> {
        let value = self.number(column)?.ok_or_else(|| self.error(column, ValueError::Empty))?;
        code(value).map_err(|error| {
            self.error(column, if error == RangeError::NotFinite { ValueError::NotFinite } else { outside })
        })
    }

    fn time(&self, column: Column) -> Result<Micros, DataError> {
        let seconds = self.optional(column)?.ok_or_else(|| self.error(column, ValueError::Empty))?;
        let ticks = (seconds * TICKS_PER_SECOND).round();
        // An f64 holds every integer up to 2^53.
        if !(0.0..9.0e15).contains(&ticks) {
            return Err(self.error(column, ValueError::OutOfRange));
        }
        Ok(Micros(ticks as u64 * MICROS_PER_TICK))
    }
}

fn csv_error(path: &str, error: csv::Error) -> DataError {
    DataError::of(path, if error.is_io_error() { std::io::Error::from(error).into() } else { error.into() })
}
