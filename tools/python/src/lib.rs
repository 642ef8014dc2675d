//! The board in Python: `gyronet.Coprocessor` corrects the rows of a drive, numpy arrays in and out.

use embedded_can::{Frame, Id};
use gyronet::coprocessor::Config;
use gyronet::estimate::YawEstimate;
use gyronet::model::{Blob, GyroNet, weights};
use gyronet::sample::{ImuSample, Validity};
use gyronet::store::{Calibration, Configuration, Learned, Record};
use gyronet::units::{AngularRate, CentiCelsius, Micros, RangeError, SpecificForce};
use gyronet_tools::board::{Board, Step};
use gyronet_tools::calibrate::unit_file;
use gyronet_tools::drive::recording::{Row, Track, WHEELS};
use gyronet_tools::drive::vehicle::RADIUS;
use gyronet_tools::drive::wheel_frames::WheelFrames;
use gyronet_tools::network::weight_file::WeightFile;
use pyo3::buffer::PyBuffer;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::{PyByteArray, PyBytes};
use std::fmt::Display;
use std::path::PathBuf;

/// Fields of a result: the row's number, bytes, and numbers.
const BYTES: [&str; 8] = [
    "status",
    "quality",
    "faults",
    "source",
    "delayed_status",
    "delayed_quality",
    "delayed_faults",
    "standstill",
];
const NUMBERS: [&str; 10] = [
    "t_s",
    "gyro",
    "live",
    "live_sigma",
    "delayed",
    "delayed_sigma",
    "yaw",
    "complete",
    "roll_rate",
    "pitch_rate",
];

fn refused(error: impl Display) -> PyErr {
    PyValueError::new_err(error.to_string())
}

/// Size of a result in bytes.
const RECORD: usize = 8 + BYTES.len() + 8 * NUMBERS.len();

/// Numbers of a GNSS receiver in a row: course, its sigma, speed, latitude, longitude.
const GNSS: usize = 5;

/// A CAN frame that the board sent: time in microseconds, identifier, 29 bits or 11, data.
type Sent = (u64, u32, bool, Vec<u8>);

#[pyclass(module = "gyronet")]
struct Coprocessor {
    board: Board<GyroNet<'static>>,
    track: Track,
    rows: u64,
    /// Frames that were not taken yet, where they are wanted.
    frames: Option<Vec<Sent>>,
}

#[pymethods]
impl Coprocessor {
    #[new]
    #[pyo3(signature = (*, weights=None, configuration=None, calibration=None, wheels=[false; WHEELS], radius_m=RADIUS, frames=false))]
    fn new(
        weights: Option<PathBuf>,
        configuration: Option<&str>,
        calibration: Option<PathBuf>,
        wheels: [bool; WHEELS],
        radius_m: f64,
        frames: bool,
    ) -> PyResult<Self> {
        let blob = match weights {
            None => Blob::new_checked(&weights::DEFAULT.0).map_err(refused)?,
            // A network borrows its weights, at most 200 kB: they stay as long as the process.
            Some(path) => {
                Box::leak(Box::new(WeightFile::read(&path).map_err(refused)?)).blob().map_err(refused)?
            }
        };
        let mut config = Config::DEFAULT;
        if let Some(text) = configuration {
            let configuration: Configuration = serde_json::from_str(text).map_err(refused)?;
            configuration.check().map_err(refused)?;
            config = configuration.coprocessor(&Calibration::NONE, &Learned::NOTHING, blob.crc);
        }
        if let Some(path) = calibration {
            config.pipeline.gyro_map = unit_file::read_for(&path, blob.crc).map_err(refused)?;
        }
        if !(0.01..10.0).contains(&radius_m) {
            return Err(refused(format!("radius_m = {radius_m}: must be 0.01 to 10 m")));
        }
        let board = Board::new(config, WheelFrames::of(wheels, radius_m), GyroNet::new(blob));
        Ok(Self { board, track: Track::default(), rows: 0, frames: frames.then(Vec::new) })
    }

    #[pyo3(signature = (t_s, imu, wheels=None, temp_c=None, last=true, gnss=None))]
    fn run<'p>(
        &mut self,
        t_s: &Bound<'p, PyAny>,
        imu: &Bound<'p, PyAny>,
        wheels: Option<&Bound<'p, PyAny>>,
        temp_c: Option<&Bound<'p, PyAny>>,
        last: bool,
        gnss: Option<&Bound<'p, PyAny>>,
    ) -> PyResult<Bound<'p, PyAny>> {
        let py = t_s.py();
        let times = numbers(t_s, "t_s", &[])?;
        let rows = times.len();
        let imu = numbers(imu, "imu", &[rows, 6])?;
        let wheels = wheels.map(|wheels| numbers(wheels, "wheels", &[rows, WHEELS])).transpose()?;
        let temperatures = temp_c.map(|values| numbers(values, "temp_c", &[rows])).transpose()?;
        let gnss = gnss.map(|gnss| numbers(gnss, "gnss", &[rows, GNSS])).transpose()?;
        let row = |k: usize| {
            let wheels = wheels.as_ref().map(|wheels| array(&wheels[WHEELS * k..]));
            let gnss = gnss.as_ref().map(|gnss| array(&gnss[GNSS * k..]));
            (times[k], array(&imu[6 * k..]), wheels, temperatures.as_ref().map(|values| values[k]), gnss)
        };
        let bytes = py.detach(|| {
            let mut bytes = Vec::with_capacity(rows * RECORD);
            for k in 0..rows {
                let (time, imu, wheels, temperature, gnss) = row(k);
                if let Some(step) = self.row(time, imu, wheels, temperature, gnss)? {
                    self.write(&step, &mut bytes);
                }
            }
            while let Some(step) = last.then(|| self.board.end()).flatten() {
                self.write(&step, &mut bytes);
            }
            Ok::<_, PyErr>(bytes)
        })?;
        records(py, &bytes)
    }

    #[pyo3(signature = (t_s, imu, wheels=None, temp_c=None, gnss=None))]
    fn step<'p>(
        &mut self,
        py: Python<'p>,
        t_s: f64,
        imu: [f64; 6],
        wheels: Option<[f64; WHEELS]>,
        temp_c: Option<f64>,
        gnss: Option<[f64; GNSS]>,
    ) -> PyResult<Option<Bound<'p, PyAny>>> {
        let Some(step) = self.row(t_s, imu, wheels, temp_c, gnss)? else { return Ok(None) };
        let mut bytes = Vec::new();
        self.write(&step, &mut bytes);
        records(py, &bytes)?.get_item(0).map(Some)
    }

    fn finish<'p>(&mut self, py: Python<'p>) -> PyResult<Bound<'p, PyAny>> {
        let mut bytes = Vec::new();
        while let Some(step) = self.board.end() {
            self.write(&step, &mut bytes);
        }
        records(py, &bytes)
    }

    fn frames<'p>(&mut self, py: Python<'p>) -> Vec<(f64, u32, bool, Bound<'p, PyBytes>)> {
        let sent = self.frames.as_mut().map(std::mem::take).unwrap_or_default();
        let frame =
            |(time, id, extended, data): Sent| (time as f64 * 1e-6, id, extended, PyBytes::new(py, &data));
        sent.into_iter().map(frame).collect()
    }

    #[getter]
    fn gyro_bias(&self) -> Option<[f64; 3]> {
        self.board.coprocessor().pipeline().gyro_bias().map(|bias| bias.map(AngularRate::rad_per_sec))
    }
}

impl Coprocessor {
    /// Runs one row: specific force and angular rate, rates of the wheels, temperature, GNSS. NaN is not known.
    fn row(
        &mut self,
        t_s: f64,
        [ax, ay, az, gx, gy, gz]: [f64; 6],
        wheels: Option<[f64; WHEELS]>,
        temp_c: Option<f64>,
        gnss: Option<[f64; GNSS]>,
    ) -> PyResult<Option<Step>> {
        let (number, ticks) = (self.rows, (t_s * 1e4).round());
        let place = |error: RangeError| refused(format!("row {number}: {error}"));
        if !(0.0..9.0e15).contains(&ticks) {
            return Err(place(RangeError::OutOfRange));
        }
        let force = |value: f64| SpecificForce::from_metre_per_sec2(value as f32).map_err(place);
        let rate = |value: f64| AngularRate::from_rad_per_sec(value as f32).map_err(place);
        let temperature = temp_c.filter(|value| value.abs() <= 300.0);
        let sample = ImuSample {
            time: Micros(ticks as u64 * 100),
            specific_force: [force(ax)?, force(ay)?, force(az)?],
            angular_rate: [rate(gx)?, rate(gy)?, rate(gz)?],
            temperature: temperature.map(|value| CentiCelsius((100.0 * value).round() as i16)),
            validity: Validity::Good,
        };
        self.rows += 1;
        let finite = |value: f64| value.is_finite().then_some(value);
        let wheels = wheels.unwrap_or([f64::NAN; WHEELS]).map(finite);
        let heading = gnss.and_then(|gnss| {
            self.board.take_courses();
            self.track.heading(sample.time, gnss.map(finite))
        });
        let row = Row { wheels, heading, ..Row::of(number, sample) };
        self.board.row(&row).map_err(|error| refused(format!("row {number}: {error}")))
    }

    /// Appends a step as a record, and keeps its frames if they are wanted.
    fn write(&mut self, step: &Step, bytes: &mut Vec<u8>) {
        let live = &step.vehicle.live;
        let sigma = |estimate: &YawEstimate| known(estimate.sigma.map(AngularRate::rad_per_sec));
        let delayed = step.delayed.as_ref();
        let [.., gyro] = step.input.sample.angular_rate;
        bytes.extend((step.row as i64).to_le_bytes());
        bytes.extend([live.status as u8, live.quality as u8, live.faults.0, live.source as u8]);
        let sent = delayed.copied().unwrap_or_default();
        bytes.extend([sent.status as u8, sent.quality as u8, sent.faults.0, step.standstill as u8]);
        let numbers: [f64; NUMBERS.len()] = [
            step.time.0 as f64 * 1e-6,
            gyro.rad_per_sec(),
            live.rate.rad_per_sec(),
            sigma(live),
            known(delayed.map(|delayed| delayed.rate.rad_per_sec())),
            delayed.map_or(f64::NAN, sigma),
            known(delayed.map(|delayed| delayed.yaw.rad())),
            step.complete.rad_per_sec(),
            step.vehicle.roll_rate.rad_per_sec(),
            step.vehicle.pitch_rate.rad_per_sec(),
        ];
        bytes.extend(numbers.iter().flat_map(|number| number.to_le_bytes()));
        if let Some(frames) = &mut self.frames {
            frames.extend(step.frames.iter().map(|sent| {
                let (id, extended) = match sent.frame.id() {
                    Id::Standard(id) => (u32::from(id.as_raw()), false),
                    Id::Extended(id) => (id.as_raw(), true),
                };
                (sent.time.0, id, extended, sent.frame.data().to_vec())
            }));
        }
    }
}

fn known(value: Option<f64>) -> f64 {
    value.unwrap_or(f64::NAN)
}

fn array<const N: usize>(values: &[f64]) -> [f64; N] {
    std::array::from_fn(|k| values[k])
}

/// Returns an array's numbers in C order, if it has this shape; an empty shape stands for any length.
fn numbers(value: &Bound<'_, PyAny>, name: &str, shape: &[usize]) -> PyResult<Vec<f64>> {
    let py = value.py();
    let array = py.import("numpy")?.call_method1("ascontiguousarray", (value, "f8"))?;
    let buffer = PyBuffer::<f64>::get(&array)?;
    if buffer.dimensions() != shape.len().max(1) || !shape.is_empty() && buffer.shape() != shape {
        let wanted = if shape.is_empty() { "(n,)".to_owned() } else { format!("{shape:?}") };
        return Err(refused(format!("{name} has the shape {:?}, not {wanted}", buffer.shape())));
    }
    buffer.to_vec(py)
}

fn records<'p>(py: Python<'p>, bytes: &[u8]) -> PyResult<Bound<'p, PyAny>> {
    let mut fields = vec![("row", "<i8")];
    fields.extend(BYTES.map(|name| (name, "u1")));
    fields.extend(NUMBERS.map(|name| (name, "<f8")));
    let numpy = py.import("numpy")?;
    let dtype = numpy.call_method1("dtype", (fields,))?;
    numpy.call_method1("frombuffer", (PyByteArray::new(py, bytes), dtype))
}

#[pymodule]
fn _core(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_class::<Coprocessor>()
}
