//! Reads sequences of KAIST Complex Urban, real or simulated: it merges several files of different
//! rates into one drive on a 100 Hz grid.
//!
//! Files are read in parallel, one row at a time: an hour of a 1 kHz gyro needs no more memory than its 100 Hz steps.
//! The grid begins with the first row of the inertial sensor for which all other files have data, and ends where the
//! first file ends. Values in between are interpolated linearly. Angles of the gyro and distances of the wheels are
//! interpolated as sums, so that nothing is lost or counted twice.

mod export;
mod kaist;
mod rows;
mod summary;
mod track;
mod utm;

pub use export::{HEADER, write_csv, write_whole};
pub(super) use kaist::yaw;
pub(super) use rows::columns;
pub use summary::{Seen, StreamSummary};

use crate::simulate::{
    MARKER, Spec,
    vehicles::{CAR, LATITUDE_DEG},
};
use gyronet::bias::STATIC_SAMPLES;
use gyronet::sample::{ImuSample, PERIOD_US, Validity};
use gyronet::units::{AngularRate, Micros, SpecificForce};
use gyronet_tools::drive::DT;
use gyronet_tools::drive::error::{DataError, DataFault, named};
use gyronet_tools::drive::recording::Row as RecordingRow;
use gyronet_tools::drive::stream::Recording;
use gyronet_tools::drive::vehicle::Vehicle;
use std::fs;
use std::path::{Path, PathBuf};
use track::Track;

/// A value interpolated across a longer gap than this is marked, s.
pub const MAX_GAP: f64 = 0.1;
/// Largest distance that the wheels may roll during static initialisation, m.
const STANDING: f64 = 0.01;
/// Minimum length of a sequence, s: static initialisation and one second.
const NEEDED: f64 = 4.0;

/// A step of the grid. Axes are x forward, y left, z up; heading is counter-clockwise from east.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Step {
    /// Specific force, m/s^2.
    pub specific_force: [f32; 3],
    /// Angular rate, rad/s.
    pub angular_rate: [f32; 3],
    /// True if the inertial sensor was silent around this step for longer than [`MAX_GAP`].
    pub imu_gap: bool,
    /// True if the fibre-optic gyro, the wheels or the truth were silent around this step for longer than
    /// [`MAX_GAP`].
    pub other_gap: bool,
    /// Angle turned since the previous step by the fibre-optic gyro, rad.
    pub fog: f64,
    /// Distances of the left and the right wheel since the previous step, m.
    pub wheels: [f64; 2],
    /// True position relative to the first step, m, east and north.
    pub position: [f64; 2],
    /// True heading, not wrapped, rad.
    pub yaw: f64,
    /// Heading by the filter of the inertial sensor's vendor, not wrapped, rad; of a simulated sequence the gyro's
    /// integral.
    pub vendor_yaw: f64,
}

/// Holds a drive on the 100 Hz grid.
#[derive(Debug, Clone, PartialEq)]
pub struct Sequence {
    pub name: String,
    pub path: PathBuf,
    /// The specification of a simulated sequence; `None` for a recorded one.
    pub simulated: Option<Spec>,
    /// Distance between the left and the right wheel, m.
    pub wheel_base: f64,
    /// Latitude of the first pose, deg, if poses are in UTM.
    pub latitude: Option<f64>,
    /// The time of the first step, s since 1970.
    pub start_s: f64,
    /// Position of the first step in the truth's frame, m, east and north.
    pub origin: [f64; 2],
    /// The steps, 10 ms apart.
    pub steps: Vec<Step>,
    /// Numbers of steps in a gap of the inertial sensor, the gyro, the wheels and the truth.
    pub in_gap: [u64; 4],
    /// The summaries of the files: inertial sensor, gyro, wheels, truth.
    pub files: [StreamSummary; 4],
}

struct Files {
    /// Time zero of the streams, s since 1970.
    epoch_s: f64,
    imu: Track<7>,
    fog: Track<1>,
    wheels: Track<2>,
    truth: Track<3>,
    wheel_base: f64,
}

fn is_sequence(folder: &Path) -> bool {
    folder.join("sensor_data").is_dir()
}

fn unknown(folder: &Path) -> DataError {
    let reason = "no KAIST Urban sequence, which is a folder with sensor_data in it";
    let fault = fs::metadata(folder).map_or_else(DataFault::Io, |_| DataFault::Other(reason.into()));
    DataError::of(folder.display(), fault)
}

/// Finds the sequences of a folder: the folder itself, or the folders directly below it, sorted by name.
pub fn find(folder: &Path) -> Result<Vec<PathBuf>, DataError> {
    if is_sequence(folder) {
        return Ok(vec![folder.to_owned()]);
    }
    let entries = fs::read_dir(folder).map_err(named(folder))?;
    let mut found: Vec<PathBuf> =
        entries.filter_map(|entry| entry.ok().map(|e| e.path())).filter(|path| is_sequence(path)).collect();
    found.sort();
    if found.is_empty() { Err(unknown(folder)) } else { Ok(found) }
}

impl Sequence {
    pub fn read(folder: &Path) -> Result<Self, DataError> {
        if !is_sequence(folder) {
            return Err(unknown(folder));
        }
        let simulated = marker(folder)?;
        let mut files = kaist::open(folder)?;
        let begin = files.begin()?;
        let mut steps = Vec::new();
        let mut in_gap = [0; 4];
        let mut last = None;
        while let Some((now, gaps)) = files.at(begin + steps.len() as f64 * DT)? {
            for (count, gap) in in_gap.iter_mut().zip(gaps) {
                *count += u64::from(gap);
            }
            steps.push(now.step(last.as_ref().unwrap_or(&now), gaps));
            last = Some(now);
        }
        let seconds = steps.len() as f64 * DT;
        if seconds < NEEDED {
            let reason = format!("its files have {seconds:.2} s in common, needed are {NEEDED} s");
            return Err(DataError::because(folder.display(), reason));
        }
        let origin = steps.first().map_or([0.0; 2], |step: &Step| step.position);
        let latitude = utm::latitude_deg(origin);
        for step in &mut steps {
            step.position = [step.position[0] - origin[0], step.position[1] - origin[1]];
        }
        let (wheel_base, start_s) = (files.wheel_base, files.epoch_s + begin);
        let Files { imu, fog, wheels, truth, .. } = files;
        let mut files = [imu.finish()?, fog.finish()?, wheels.finish()?, truth.finish()?];
        summary::compare_ends(&mut files);
        let name = folder.canonicalize().ok().and_then(|path| Some(path.file_name()?.to_str()?.to_owned()));
        let name = name.unwrap_or_else(|| folder.display().to_string());
        let path = folder.to_owned();
        Ok(Self { name, path, simulated, wheel_base, latitude, start_s, origin, steps, in_gap, files })
    }

    pub fn seconds(&self) -> f64 {
        self.steps.len() as f64 * DT
    }

    /// Returns the latitude for the Earth's rate: that of the simulation, or of the place where the data set was
    /// recorded.
    pub fn latitude_deg(&self) -> f64 {
        // A simulated world rotates as at the latitude of its settings, whatever the position of its map.
        self.latitude.filter(|_| self.simulated.is_none()).unwrap_or(LATITUDE_DEG)
    }

    /// Returns the true change of heading in each step, rad; zero in the first.
    pub fn turns(&self) -> Vec<f64> {
        let first = self.steps.first().map_or(0.0, |step| step.yaw);
        let mut last = first;
        self.steps.iter().map(|step| step.yaw - std::mem::replace(&mut last, step.yaw)).collect()
    }

    /// Returns the rates of the left and the right wheel in a step, rad/s, by the wheel radius of the data set's
    /// vehicle.
    pub fn wheel_rates(&self, step: &Step) -> [f64; 2] {
        step.wheels.map(|way| way / DT / CAR.wheel_radius)
    }

    /// Converts the drive to a recording, as the other commands use it. Steps in a gap of the inertial sensor are left
    /// out, because a board would not receive them. The wheels become the rear right and rear left ones.
    pub fn recording(&self) -> Recording {
        let turns = self.turns();
        let steps = self.steps.iter().zip(&turns).enumerate().filter(|(_, (step, _))| !step.imu_gap);
        let rows = steps.filter_map(|(k, (step, turn))| {
            let [fx, fy, fz] = step.specific_force.map(SpecificForce::from_metre_per_sec2);
            let [wx, wy, wz] = step.angular_rate.map(AngularRate::from_rad_per_sec);
            let sample = ImuSample {
                time: Micros(k as u64 * PERIOD_US),
                // A reading beyond the range of all parts gives no sample, and the pipeline counts a gap.
                specific_force: [fx.ok()?, fy.ok()?, fz.ok()?],
                angular_rate: [wx.ok()?, wy.ok()?, wz.ok()?],
                temperature: None,
                validity: Validity::Good,
            };
            let [left, right] = self.wheel_rates(step).map(Some);
            let wheels = [None, right, None, left];
            let reference = Some(turn / DT);
            Some(RecordingRow { reference, wheels, ..RecordingRow::of(k as u64 + 1, sample) })
        });
        let path = self.path.display().to_string();
        Recording { path, rows: rows.collect(), missing: 0, vehicle: Vehicle::default() }
    }

    pub fn needs_standstill(&self) -> Result<(), DataError> {
        let steps = self.steps.iter().take(STATIC_SAMPLES as usize);
        let metres = steps.map(|step| (step.wheels[0] + step.wheels[1]) / 2.0).sum::<f64>().abs();
        let reason = format!(
            "starts moving: its wheels roll {metres:.2} m in the first 3 s; at most {STANDING} m count as standing"
        );
        if metres > STANDING { Err(DataError::because(self.path.display(), reason)) } else { Ok(()) }
    }
}

#[derive(Debug, Clone, Copy)]
struct Values {
    imu: [f64; 7],
    fog: f64,
    wheels: [f64; 2],
    truth: [f64; 3],
}

impl Values {
    fn step(&self, last: &Self, [imu_gap, others @ ..]: [bool; 4]) -> Step {
        let [fx, fy, fz, wx, wy, wz, vendor_yaw] = self.imu;
        let [x, y, yaw] = self.truth;
        Step {
            specific_force: [fx, fy, fz].map(|value| value as f32),
            angular_rate: [wx, wy, wz].map(|value| value as f32),
            imu_gap,
            other_gap: others.contains(&true),
            fog: self.fog - last.fog,
            wheels: [self.wheels[0] - last.wheels[0], self.wheels[1] - last.wheels[1]],
            position: [x, y],
            yaw,
            vendor_yaw,
        }
    }
}

impl Files {
    /// Returns the time of the first row of the inertial sensor for which all files have data.
    fn begin(&mut self) -> Result<f64, DataError> {
        let others = [self.fog.first, self.wheels.first, self.truth.first];
        let begin = others.into_iter().fold(self.imu.first, f64::max);
        self.imu.at(begin)?;
        Ok(self.imu.reached().max(begin))
    }

    /// Returns the values at a time, and which of them are in a gap; `None` if a file has ended.
    fn at(&mut self, time: f64) -> Result<Option<(Values, [bool; 4])>, DataError> {
        let Some(imu) = self.imu.at(time)? else { return Ok(None) };
        let Some(fog) = self.fog.at(time)? else { return Ok(None) };
        let Some(wheels) = self.wheels.at(time)? else { return Ok(None) };
        let Some(truth) = self.truth.at(time)? else { return Ok(None) };
        let gaps = [imu.gap, fog.gap, wheels.gap, truth.gap].map(|gap| gap > MAX_GAP);
        let [fog] = fog.values;
        Ok(Some((Values { imu: imu.values, fog, wheels: wheels.values, truth: truth.values }, gaps)))
    }
}

/// Reads the specification of a simulated sequence; `None` for a recorded one.
fn marker(folder: &Path) -> Result<Option<Spec>, DataError> {
    let path = folder.join(MARKER);
    let error = |fault| DataError::of(path.display(), fault);
    match fs::read(&path) {
        Ok(bytes) => {
            serde_json::from_slice(&bytes).map(Some).map_err(|source| error(DataFault::Other(source.into())))
        }
        Err(source) if source.kind() == std::io::ErrorKind::NotFound => Ok(None),
        Err(source) => Err(error(source.into())),
    }
}

#[cfg(test)]
mod tests;
